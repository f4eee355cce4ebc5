// Properties of every estimator in random scenes: finite and not negative, honest counters, the
// same bits again, and unbiased estimators that agree with each other.
//
// 600 scenes for the properties of one estimator, 30 for the agreement of pairs.
// PENUMBRA_FUZZ_SCENES sets both numbers and PENUMBRA_FUZZ_SEED the seed of the first; scene i has
// the seed of the first plus i. A failure prints its scene's seed and how to run it alone.
//
// False alarms of the agreement: 1e-4 for all scenes, pairs and points together (Holm within an
// estimator's row of pairs, rows by Bonferroni), and a rejection counts only where four times the
// replicates with sixteen times the estimates reject again. Left out of the agreement, not of the
// other properties: scenes with lobes sharper than alpha 0.05 or Phong exponent 200, whose tails no
// affordable number of replicates shows, and differences below 0.1 % of the scene's mean, where a
// noisy estimator may never meet the light at all.

#include <gtest/gtest.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <span>
#include <utility>

#include "harness/render.h"
#include "scenes/core/error.h"
#include "tests/conformance/conformance_support.h"
#include "tests/conformance/fuzz_scenes.h"
#include "tests/support/fixtures.h"

namespace penumbra::conformance {
namespace {

constexpr double kFamilyLevel = 1e-4;
constexpr double kConfirmLevel = 1e-5;
constexpr double kTolerance = 1e-3;
constexpr std::uint64_t kPropertyScenes = 600;
constexpr std::uint64_t kAgreementScenes = 30;
constexpr int kPropertySpp = 4;
constexpr int kAgreementSpp = 16;
constexpr int kConfirmFactor = 16;

std::uint64_t setting(const char* name, std::uint64_t fallback) {
  const char* text = std::getenv(name);
  if (text == nullptr) return fallback;
  std::uint64_t value = 0;
  const char* end = text + std::strlen(text);
  const auto [stop, error] = std::from_chars(text, end, value);
  if (error != std::errc{} || stop != end || stop == text) {
    throw InputError(std::string(name) + " = '" + text + "', allowed is a whole number from 0 on");
  }
  return value;
}

struct Loaded {
  FuzzScene fuzz;
  Scene scene;
  ShadingPoints points;

  explicit Loaded(std::uint64_t seed)
      : fuzz(fuzz_scene(seed)),
        scene(fuzz.description),
        points(make_shading_points(scene, 1, seed, 8)) {}

  std::string how_to_repeat() const {
    return "scene seed " + std::to_string(fuzz.seed) +
           "; alone: PENUMBRA_FUZZ_SEED=" + std::to_string(fuzz.seed) +
           " PENUMBRA_FUZZ_SCENES=1 penumbra_conformance_tests --gtest_filter='" + running_test() +
           "'";
  }
};

using Scenes = std::vector<std::unique_ptr<Loaded>>;

// As many as the environment says, otherwise `count`; loaded once per process.
std::span<const std::unique_ptr<Loaded>> scenes(std::uint64_t count) {
  static Scenes loaded;
  const std::uint64_t first = setting("PENUMBRA_FUZZ_SEED", 1);
  count = setting("PENUMBRA_FUZZ_SCENES", count);
  while (loaded.size() < count) loaded.push_back(std::make_unique<Loaded>(first + loaded.size()));
  return std::span(loaded).first(count);
}

RenderResult run(const Loaded& s, const Variant& variant, int spp, std::uint64_t seed) {
  RenderSettings settings;
  settings.estimator = variant.entry;
  settings.params = variant.params;
  settings.budget = budget_of(*variant.entry);
  settings.spp = spp;
  settings.seed = seed;
  return render(s.scene, s.points, settings);
}

class Fuzz : public ::testing::TestWithParam<Variant> {};

TEST_P(Fuzz, IsFiniteCountedAndRepeatable) {
  const Variant& variant = GetParam();
  const bool unbiased = variant.entry->bias_reason(variant.params).empty();
  std::size_t lit = 0;
  const auto all = scenes(kPropertyScenes);
  for (const auto& s : all) {
    SCOPED_TRACE(s->how_to_repeat());
    const RenderResult result = run(*s, variant, kPropertySpp, s->fuzz.seed);
    ASSERT_EQ(result.bad_count, 0u)
        << "first: estimate " << result.bad[0].estimate << " of pixel (" << result.bad[0].x << ", "
        << result.bad[0].y << "): " << result.bad[0].value;
    const EstimateCounters& c = result.counters;
    ASSERT_EQ(c.estimates, s->points.valid_count * kPropertySpp);
    ASSERT_LE(c.rays, c.samples);
    ASSERT_LE(c.samples, static_cast<std::uint64_t>(budget_of(*variant.entry).srl()) *
                             s->scene.lights().size() * c.estimates);
    if (unbiased) {
      ASSERT_EQ(c.uncovered, 0u);
    }
    const RenderResult again = run(*s, variant, kPropertySpp, s->fuzz.seed);
    ASSERT_EQ(result.radiance, again.radiance);
    lit += std::any_of(result.radiance.begin(), result.radiance.end(),
                       [](const Vec3d& v) { return v.x + v.y + v.z > 0; })
               ? 1u
               : 0u;
  }
  EXPECT_GE(2 * lit, all.size()) << "most scenes are lit";
}

INSTANTIATE_TEST_SUITE_P(AllEstimators, Fuzz, ::testing::ValuesIn(defaults()),
                         [](const auto& test) { return test.param.name; });

TileReplicates point_replicates(const Loaded& s, const Variant& variant, int spp, int count,
                                const std::string& label) {
  const int one_point[] = {1};
  TileReplicates result(bias_tiles(kFuzzWidth, kFuzzHeight, one_point));
  for (int r = 0; r < count; ++r) {
    const std::string text =
        label + "/" + variant.name + "/" + std::to_string(s.fuzz.seed) + "/" + std::to_string(r);
    result.add(run(s, variant, spp, fixtures::seed_from(text)).radiance);
  }
  return result;
}

// Replicates of the first step, made once per process.
const TileReplicates& first_replicates(const Loaded& s, const Variant& variant) {
  static std::map<std::pair<std::uint64_t, std::string>, TileReplicates> known;
  const auto key = std::make_pair(s.fuzz.seed, variant.name);
  const auto found = known.find(key);
  if (found != known.end()) return found->second;
  return known.emplace(key, point_replicates(s, variant, kAgreementSpp, kReplicates, "fuzz"))
      .first->second;
}

struct Comparison {
  const Loaded* scene;
  Variant other;
  BiasTestResult result;
};

BiasTestResult compare(const TileReplicates& a, const TileReplicates& b, double level) {
  BiasTestOptions options;
  options.level = level;
  options.tolerance = kTolerance;
  return bias_test(a, b, options);
}

class FuzzAgreement : public ::testing::TestWithParam<Variant> {};

// The estimators that row i compares with: half of the others, so that every pair is in one row.
std::vector<Variant> partners(const std::vector<Variant>& all, const Variant& variant) {
  const std::size_t n = all.size();
  std::vector<Variant> result;
  for (std::size_t i = 0; i < n; ++i) {
    if (all[i].entry != variant.entry) continue;
    for (std::size_t step = 1; 2 * step <= n; ++step) {
      // Half way round the circle both ends see each other.
      if (2 * step < n || i < step) result.push_back(all[(i + step) % n]);
    }
  }
  return result;
}

TEST_P(FuzzAgreement, OfUnbiasedEstimatorsInRoughScenes) {
  const Variant& variant = GetParam();
  const std::vector<Variant> all = unbiased_defaults();
  const std::vector<Variant> others = partners(all, variant);
  std::vector<Comparison> comparisons;
  std::vector<double> p;
  for (const auto& s : scenes(kAgreementScenes)) {
    if (!s->fuzz.rough) continue;
    for (const Variant& other : others) {
      comparisons.push_back(
          {s.get(), other,
           compare(first_replicates(*s, variant), first_replicates(*s, other), kFamilyLevel)});
      for (const TileResult& tile : comparisons.back().result.tiles) p.push_back(tile.test.p);
    }
  }
  if (comparisons.empty())
    GTEST_SKIP() << "no other unbiased estimator in its row, or no rough scene";
  const std::vector<double> adjusted = holm_adjusted(p);
  std::size_t next = 0;
  int confirmed = 0;
  for (const Comparison& c : comparisons) {
    const auto from = adjusted.begin() + static_cast<std::ptrdiff_t>(next);
    next += c.result.tiles.size();
    const double smallest =
        *std::min_element(from, adjusted.begin() + static_cast<std::ptrdiff_t>(next));
    if (smallest > kFamilyLevel / static_cast<double>(all.size())) continue;
    ++confirmed;
    const int spp = kAgreementSpp * kConfirmFactor;
    const BiasTestResult again = compare(
        point_replicates(*c.scene, variant, spp, kConfirmReplicates, "fuzz again"),
        point_replicates(*c.scene, c.other, spp, kConfirmReplicates, "fuzz again"), kConfirmLevel);
    EXPECT_FALSE(again.rejected) << variant.name << " and " << c.other.name << ": "
                                 << describe(c.result) << "\n  confirmation: " << describe(again)
                                 << "\n  " << c.scene->how_to_repeat();
  }
  std::printf("%zu comparisons, %d repeated\n", comparisons.size(), confirmed);
}

INSTANTIATE_TEST_SUITE_P(AllEstimators, FuzzAgreement, ::testing::ValuesIn(unbiased_defaults()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace penumbra::conformance
