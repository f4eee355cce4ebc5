// Leaving out what a scene does not need changes no result: every unbiased estimator makes the same
// image of a scene as it is and of the same scene with everything kept, and wastes no more on it.
//
// False alarms: the decision of agreement_test.cpp, 1e-7 in all for each comparison if its noise is
// normal; there are fewer than 100. The comparisons of work have margins of many standard errors,
// stated where they are.

#include <gtest/gtest.h>

#include <cstdio>

#include "harness/render.h"
#include "tests/conformance/conformance_support.h"
#include "tests/conformance/idle_scenes.h"
#include "tests/support/fixtures.h"

namespace penumbra::conformance {
namespace {

// Estimates per pixel and replicate: enough for the control to be found.
constexpr int kSpp = 1;
// Embree and the scene work a face's normal out in two ways; this bounds their roundings.
constexpr float kNormalRounding = 1e-5f;

/// A scene as it is loaded by default and with everything kept.
struct Pair {
  std::string name;
  bool idle{false};  ///< much is left out: a scene of idle_scenes.h
  std::unique_ptr<TestScene> lean, kept;
};

const std::vector<NamedDescription>& descriptions() {
  static const std::vector<NamedDescription> all = [] {
    std::vector<NamedDescription> result = test_descriptions();
    for (NamedDescription& scene : idle_descriptions()) result.push_back(std::move(scene));
    return result;
  }();
  return all;
}

const Pair& pair_of(std::size_t index) {
  static std::vector<std::unique_ptr<Pair>> known(descriptions().size());
  if (known[index] == nullptr) {
    const std::string& name = descriptions()[index].name;
    const SceneDescription& description = descriptions()[index].description;
    known[index].reset(new Pair{name, index >= test_descriptions().size(),
                                load(name, description, kSpp),
                                load(name + "_kept", description, kSpp, SceneOptions{true})});
  }
  return *known[index];
}

struct OnPair {
  Variant variant;
  std::size_t pair;
};

std::string name_of(const OnPair& on) {
  return on.variant.name + "_" + descriptions()[on.pair].name;
}

void PrintTo(const OnPair& on, std::ostream* out) { *out << name_of(on); }

std::vector<OnPair> on_all_pairs() {
  std::vector<OnPair> result;
  for (const Variant& variant : unbiased_defaults()) {
    for (std::size_t i = 0; i < descriptions().size(); ++i) result.push_back({variant, i});
  }
  return result;
}

EstimateCounters work(const TestScene& scene, const Variant& variant) {
  RenderSettings settings;
  settings.estimator = variant.entry;
  settings.params = variant.params;
  settings.budget = budget_of(*variant.entry);
  settings.spp = 4;
  settings.seed = fixtures::seed_from(running_test());
  return render(scene.scene, scene.points, settings).counters;
}

double ratio(std::uint64_t a, std::uint64_t b) {
  return static_cast<double>(a) / static_cast<double>(b);
}

class KeepAll : public ::testing::TestWithParam<OnPair> {};

TEST_P(KeepAll, ChangesNoMean) {
  const Variant& variant = GetParam().variant;
  const Pair& pair = pair_of(GetParam().pair);
  const Decision decision =
      decide(source(*pair.lean, variant, kSpp), source(*pair.kept, variant, kSpp), running_test());
  ASSERT_TRUE(decision.first.relative_bias) << "a lit scene";
  EXPECT_FALSE(decision.differ()) << pair.name << ": " << decision.text();
}

// At 4096 estimates of 16 or more samples the ratios have standard errors of about 1 %: 5 % where
// nothing need be saved. What is left out of the idle scenes is more. Rays are saved for sure where
// no sky is sampled any more that brings nothing: black texels are not traced in any case, and
// where samples are chosen from candidates, no ray goes to what would bring nothing.
TEST_P(KeepAll, WastesNoLessThanLeavingOut) {
  const Pair& pair = pair_of(GetParam().pair);
  const EstimateCounters lean = work(*pair.lean, GetParam().variant);
  const EstimateCounters kept = work(*pair.kept, GetParam().variant);
  ASSERT_GT(lean.lit, 1000u);
  const double samples = ratio(lean.samples + lean.candidates, lean.lit) /
                         ratio(kept.samples + kept.candidates, kept.lit);
  const double rays = ratio(lean.rays, lean.lit) / ratio(kept.rays, kept.lit);
  std::printf("%-16s lean/kept: directions per lit %.3f, rays per lit %.3f\n",
              name_of(GetParam()).c_str(), samples, rays);
  EXPECT_LT(samples, pair.idle ? 0.99 : 1.05);
  const bool saves_rays = !pair.lean->scene.traits().has_environment && kept.candidates == 0;
  EXPECT_LT(rays, saves_rays ? 0.99 : 1.05);
}

INSTANTIATE_TEST_SUITE_P(AllEstimators, KeepAll, ::testing::ValuesIn(on_all_pairs()),
                         [](const auto& test) { return name_of(test.param); });

// Negative control: each scene without the light that contributes least among those that do, in
// place of the scene with everything kept. The decision must see it.
TEST(KeepAllControl, ALightThatContributesIsMissed) {
  const Variant mis = defaults().front();
  ASSERT_EQ(mis.name, "mis");
  for (const auto& [scene, light] :
       {std::pair("idle", "astride"), std::pair("diffuse", "window"), std::pair("open", "lamp")}) {
    for (const auto& [name, description, usual_spp] : descriptions()) {
      if (name != scene) continue;
      SceneDescription without = description;
      const std::string missing = light;
      for (ShapeDescription& shape : without.shapes) {
        if (shape.name == missing) shape.emission->radiance = Rgb(0.0f);
      }
      const auto a = load(name, description, kSpp);
      const auto b = load(name + "_without", without, kSpp, SceneOptions{true});
      const Decision decision =
          decide(source(*a, mis, kSpp), source(*b, mis, kSpp), running_test() + "/" + name);
      EXPECT_TRUE(decision.differ()) << name << " without " << missing << ": " << decision.text();
    }
  }
}

// Parts that are code only: kept normals stand for the faces' own, kept texture coordinates and
// filters for nothing.
TEST(KeepAllParts, ShadingPointsStayTheSame) {
  for (std::size_t i = 0; i < descriptions().size(); ++i) {
    const Pair& pair = pair_of(i);
    const std::vector<ShadingPoint>& lean = pair.lean->points.points;
    const std::vector<ShadingPoint>& kept = pair.kept->points.points;
    ASSERT_EQ(lean.size(), kept.size());
    for (std::size_t p = 0; p < lean.size(); ++p) {
      ASSERT_EQ(lean[p].material, kept[p].material) << pair.name << ", point " << p;
      ASSERT_EQ(lean[p].position, kept[p].position) << pair.name << ", point " << p;
      ASSERT_EQ(lean[p].geometric_normal, kept[p].geometric_normal) << pair.name;
      ASSERT_LT((lean[p].shading_normal - kept[p].shading_normal).length(), kNormalRounding)
          << pair.name;
    }
  }
}

TEST(KeepAllParts, AreThereWhereKeptAndAbsentWhereNotNeeded) {
  for (std::size_t i = 0; i < descriptions().size(); ++i) {
    const Pair& pair = pair_of(i);
    const SceneParts& lean = pair.lean->scene.parts();
    const SceneParts& kept = pair.kept->scene.parts();
    const SceneDescription& scene = descriptions()[i].description;
    EXPECT_FALSE(lean.textures.present() || lean.masks.present() || lean.uvs.present() ||
                 lean.normals.present())
        << pair.name << " has neither images nor normals";
    EXPECT_EQ(lean.environment.present(), scene.environment.has_value()) << pair.name;
    EXPECT_TRUE(kept.masks.present()) << pair.name;
    EXPECT_TRUE(kept.uvs.present()) << pair.name;
    EXPECT_TRUE(kept.environment.present()) << pair.name;
    EXPECT_EQ(pair.lean->scene.content_hash(), pair.kept->scene.content_hash()) << pair.name;
  }
}

}  // namespace
}  // namespace penumbra::conformance
