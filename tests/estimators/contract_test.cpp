// The contract of Estimator::estimate (estimators/estimator.h) for every registered estimator, with
// its default parameters and with each choice and switch of its parameters in turn.

#include <gtest/gtest.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <ostream>

#include "tests/support/fixtures.h"

namespace {
thread_local std::uint64_t allocations = 0;

void* counted_allocation(std::size_t size, std::size_t alignment) {
  ++allocations;
  const std::size_t rounded =
      (std::max<std::size_t>(size, 1) + alignment - 1) / alignment * alignment;
  void* memory = std::aligned_alloc(alignment, rounded);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

// Not inlined: GCC would see free() for memory of operator new and warn of a mismatch.
[[gnu::noinline]] void release(void* memory) noexcept { std::free(memory); }
}  // namespace

// Counts every allocation of this program through operator new.
void* operator new(std::size_t size) { return counted_allocation(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted_allocation(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }

namespace penumbra::fixtures {
namespace {

constexpr int kWidth = 40;  // not a multiple of 16: the last tiles are narrow
constexpr int kHeight = 24;
constexpr int kCameraSamples = 2;
constexpr int kSpp = 5;  // not a multiple of the camera samples
constexpr std::uint64_t kSeed = 11;

SphereShape ball(double x, double y, double z, double radius) { return {{x, y, z}, radius}; }

ShapeDescription shape(std::string name, std::uint32_t material, Shape geometry,
                       double radiance = 0.0) {
  ShapeDescription result;
  result.name = std::move(name);
  result.material = material;
  result.shape = std::move(geometry);
  if (radiance > 0.0) {
    result.emission = EmissionDescription{
        Rgb(static_cast<float>(radiance), static_cast<float>(0.7 * radiance), 0.1f), false};
  }
  return result;
}

/// Floor with a ball under a rectangle, a sphere and a mesh light, partly seen against the void.
/// @param scale   of all emission; 0: lights that emit nothing
/// @param lifted  height of all lights above their place
SceneDescription contract_scene(double scale = 1.0, double lifted = 0.0) {
  SceneDescription scene;
  scene.name = "contract";
  scene.camera = {{0.0, -4.0, 2.5}, {0.0, 0.0, 0.6}, {0.0, 0.0, 1.0}, 60.0, {kWidth, kHeight}};
  scene.materials = {lambert("grey", 0.6),
                     lambert("black", 0.0),
                     {"phong", PhongMaterial{Rgb(0.2f), Rgb(0.5f), 40.0f}}};
  scene.shapes.push_back(shape("floor", 2, RectangleShape{{-2, -2, 0}, {4, 0, 0}, {0, 4, 0}}));
  scene.shapes.push_back(shape("ball", 0, ball(0.3, 0.2, 0.5, 0.5)));
  scene.shapes.push_back(shape("soot", 1, ball(-1.2, -1.0, 0.3, 0.3)));
  scene.shapes.push_back(
      shape("panel", 1, RectangleShape{{-1, 0, 2 + lifted}, {0, 1, 0}, {1, 0, 0}}, 3.0));
  scene.shapes.push_back(shape("lamp", 1, ball(1.5, 1.0, 1.2 + lifted, 0.2), 8.0));
  TriangleMeshShape mesh;
  mesh.vertices = {{-1.8, 1.5, 0.5 + lifted},
                   {-1.2, 1.8, 0.5 + lifted},
                   {-1.5, 1.5, 1.5 + lifted},
                   {-1.5, 1.0, 0.7 + lifted}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  scene.shapes.push_back(shape("shard", 1, mesh, 2.0));
  for (ShapeDescription& s : scene.shapes) {
    if (s.emission) s.emission->radiance *= static_cast<float>(scale);
  }
  return scene;
}

struct Image {
  std::vector<Rgb> radiance;  // [pixel row-major][estimate]
  std::vector<float> maps;    // [pixel][estimate][map]
  EstimateCounters counters;
};

struct Case {
  std::string name;
  const EstimatorEntry* entry;
  ParamSet params;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

Budget budget_of(const Case& c) {
  return c.entry->adaptive ? Budget{SamplerKind::Stratified, 4, 12}
                           : Budget{SamplerKind::Stratified, 16, 0};
}

std::unique_ptr<Estimator> create(const Case& c, const Scene& scene) {
  return c.entry->create(scene, c.params, budget_of(c));
}

// Runs one tile and scatters its results to the image.
void run_tile(Estimator& estimator, const ShadingPoints& points, const TileRect& rect,
              std::uint64_t seed, bool with_maps, Image& image, EstimateCounters& counters,
              StageClock* clock = nullptr) {
  const Tile tile{rect.x0,     rect.y0,        rect.width,
                  rect.height, points.width,   points.camera_samples,
                  kSpp,        points.of(rect)};
  const std::size_t maps = with_maps ? estimator.maps().size() : 0;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<Rgb> radiance(tile.estimate_count(), Rgb(nan));
  std::vector<float> map_values(tile.estimate_count() * maps, nan);
  TileOutput out{radiance, map_values, {}};
  out.clock = clock;
  const std::uint64_t before = allocations;
  estimator.estimate(tile, seed, out);
  EXPECT_EQ(allocations, before) << "estimate() allocates";
  for (int pixel = 0; pixel < tile.pixel_count(); ++pixel) {
    const auto from = static_cast<std::size_t>(pixel) * kSpp;
    const std::size_t to = std::size_t{tile.pixel_index(pixel)} * kSpp;
    std::copy_n(&radiance[from], kSpp, &image.radiance[to]);
    if (maps > 0) std::copy_n(&map_values[from * maps], kSpp * maps, &image.maps[to * maps]);
  }
  counters += out.counters;
}

Image blank(const ShadingPoints& points, std::size_t maps) {
  const auto estimates =
      static_cast<std::size_t>(points.width) * static_cast<std::size_t>(points.height) * kSpp;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  return {std::vector<Rgb>(estimates, Rgb(nan)), std::vector<float>(estimates * maps, nan), {}};
}

Image render(const Case& c, const Scene& scene, const ShadingPoints& points,
             std::uint64_t seed = kSeed, bool backwards = false, bool with_maps = false,
             StageClock* clock = nullptr) {
  const std::unique_ptr<Estimator> estimator = create(c, scene);
  Image image = blank(points, with_maps ? estimator->maps().size() : 0);
  std::vector<TileRect> tiles = points.tiles;
  if (backwards) std::reverse(tiles.begin(), tiles.end());
  for (const TileRect& rect : tiles) {
    run_tile(*estimator, points, rect, seed, with_maps, image, image.counters, clock);
  }
  return image;
}

bool same_bits(const Image& a, const Image& b) {
  return a.radiance.size() == b.radiance.size() &&
         std::memcmp(a.radiance.data(), b.radiance.data(), a.radiance.size() * sizeof(Rgb)) == 0;
}

// Defaults, then every choice and switch that differs from its default, one at a time.
std::vector<Case> cases() {
  std::vector<Case> result;
  for (const EstimatorEntry* entry : all_estimators()) {
    const std::string name(entry->name);
    result.push_back({name, entry, params_with(*entry, {})});
    for (const ParamSpec& spec : entry->params()) {
      std::vector<ParamValue> others;
      if (const auto* flag = std::get_if<bool>(&spec.default_value)) others.emplace_back(!*flag);
      for (const std::string& choice : spec.choices) others.emplace_back(choice);
      for (const ParamValue& value : others) {
        if (value == spec.default_value) continue;
        result.push_back({name + "_" + spec.name + "_" + to_string(value), entry,
                          params_with(*entry, {{spec.name, value}})});
      }
    }
  }
  return result;
}

class Contract : public ::testing::TestWithParam<Case> {
 protected:
  const Case& c() const { return GetParam(); }
  Scene scene_{contract_scene()};
  ShadingPoints points_ = make_shading_points(scene_, kCameraSamples, 1, 8);
};

TEST_P(Contract, WritesEveryOutputFiniteAndNotNegative) {
  const Image image = render(c(), scene_, points_);
  std::size_t lit = 0;
  for (const Rgb& value : image.radiance) {
    for (int channel = 0; channel < 3; ++channel) {
      ASSERT_TRUE(std::isfinite(value[channel])) << value;
      ASSERT_TRUE(value[channel] >= 0.0f || c().entry->may_be_negative) << value;
    }
    lit += is_black(value) ? 0u : 1u;
  }
  EXPECT_GT(2 * lit, image.counters.estimates) << "most valid points are lit";
}

TEST_P(Contract, IsZeroWherePointsAreNotValid) {
  ASSERT_GT(points_.valid_count, 0u);
  ASSERT_LT(points_.valid_count, points_.points.size());
  const Image image = render(c(), scene_, points_);
  for (const TileRect& rect : points_.tiles) {
    for (int pixel = 0; pixel < rect.width * rect.height; ++pixel) {
      for (int s = 0; s < kSpp; ++s) {
        const auto p = static_cast<std::size_t>(pixel * kCameraSamples + s % kCameraSamples);
        if (points_.points[rect.first + p].valid()) continue;
        const int x = rect.x0 + pixel % rect.width;
        const int y = rect.y0 + pixel / rect.width;
        ASSERT_TRUE(
            is_black(image.radiance[static_cast<std::size_t>((y * kWidth + x) * kSpp + s)]));
      }
    }
  }
}

TEST_P(Contract, DoesNotDependOnWhatWasEstimatedBefore) {
  EXPECT_TRUE(same_bits(render(c(), scene_, points_), render(c(), scene_, points_, kSeed, true)));
}

TEST_P(Contract, HasTheSameBitsOnAnyNumberOfThreads) {
  const Image expected = render(c(), scene_, points_);
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(threads));
    tbb::enumerable_thread_specific<std::unique_ptr<Estimator>> estimators(
        [&] { return create(c(), scene_); });
    tbb::enumerable_thread_specific<EstimateCounters> counters;
    Image image = blank(points_, 0);
    tbb::task_arena(threads).execute([&] {
      tbb::parallel_for(std::size_t{0}, points_.tiles.size(), [&](std::size_t i) {
        run_tile(*estimators.local(), points_, points_.tiles[i], kSeed, false, image,
                 counters.local());
      });
    });
    for (const EstimateCounters& part : counters) image.counters += part;
    EXPECT_TRUE(same_bits(image, expected)) << threads << " threads";
    EXPECT_EQ(image.counters.rays, expected.counters.rays) << threads << " threads";
  }
}

TEST_P(Contract, AnotherSeedGivesOtherEstimates) {
  EXPECT_FALSE(same_bits(render(c(), scene_, points_), render(c(), scene_, points_, kSeed + 1)));
}

TEST_P(Contract, TwiceTheEmissionGivesTwiceTheRadianceToTheBit) {
  const Scene doubled(contract_scene(2.0));
  const Image once = render(c(), scene_, points_);
  const Image twice = render(c(), doubled, points_);
  for (std::size_t i = 0; i < once.radiance.size(); ++i) {
    ASSERT_EQ(once.radiance[i] * 2.0f, twice.radiance[i]) << "estimate " << i;
  }
}

TEST_P(Contract, BlackLightsGiveExactlyZero) {
  const Scene dark(contract_scene(0.0));
  ASSERT_EQ(dark.lights().size(), 3u);
  for (const Rgb& value : render(c(), dark, points_).radiance) ASSERT_TRUE(is_black(value));
}

TEST_P(Contract, LightsBelowTheHorizonGiveExactlyZeroWithoutRays) {
  SceneDescription description = contract_scene(1.0, -5.0);
  std::erase_if(description.shapes, [](const ShapeDescription& s) { return s.name == "ball"; });
  const Scene below(description);
  const ShadingPoints points = make_shading_points(below, kCameraSamples, 1, 8);
  ASSERT_GT(points.valid_count, 0u);
  const Image image = render(c(), below, points);
  for (const Rgb& value : image.radiance) ASSERT_TRUE(is_black(value));
  EXPECT_EQ(image.counters.rays, 0u);
}

TEST_P(Contract, StaysWithinTheBudgetAndCoversEverySample) {
  const Image image = render(c(), scene_, points_);
  std::uint64_t valid = 0;
  for (std::size_t i = 0; i < points_.points.size(); ++i) {
    if (!points_.points[i].valid()) continue;
    // Of kSpp = 5 estimates, three are made at the first camera sample and two at the second.
    valid += i % kCameraSamples == 0 ? 3u : 2u;
  }
  EXPECT_EQ(image.counters.estimates, valid);
  EXPECT_LE(image.counters.samples,
            static_cast<std::uint64_t>(budget_of(c()).srl()) * scene_.lights().size() * valid);
  EXPECT_GT(image.counters.rays, 0u);
  EXPECT_LE(image.counters.rays, image.counters.samples);
  // Biased settings may lose samples (a component of weight 0 raised to n_min), and then the
  // counter says so.
  if (c().entry->bias_reason(c().params).empty()) {
    EXPECT_EQ(image.counters.uncovered, 0u);
  }
}

TEST_P(Contract, EstimatesCycleThroughTheCameraSamples) {
  // What an estimate is at one sample may follow from the other samples of its tile.
  const bool alone = !c().entry->shares_in_tile;
  ShadingPoints first_only = points_;
  for (std::size_t i = 1; i < first_only.points.size(); i += kCameraSamples) {
    first_only.points[i].material = ShadingPoint::kInvalid;
  }
  const Image all = render(c(), scene_, points_);
  const Image image = render(c(), scene_, first_only);
  for (std::size_t i = 0; i < image.radiance.size(); ++i) {
    if (i % kSpp % kCameraSamples == 1) {
      ASSERT_TRUE(is_black(image.radiance[i])) << "estimate " << i;
    } else if (alone && is_black(all.radiance[i])) {
      ASSERT_TRUE(is_black(image.radiance[i])) << "estimate " << i;
    }
  }
  EXPECT_GT(image.counters.estimates, 0u);
}

TEST_P(Contract, MapsAreWrittenForEveryEstimateAndDoNotChangeTheRadiance) {
  const std::size_t maps = create(c(), scene_)->maps().size();
  const Image image = render(c(), scene_, points_, kSeed, false, true);
  EXPECT_TRUE(same_bits(image, render(c(), scene_, points_)));
  ASSERT_EQ(image.maps.size(), image.radiance.size() * maps);
  for (const float value : image.maps) ASSERT_TRUE(std::isfinite(value));
}

TEST_P(Contract, TellsItsStagesToAClockAndDoesNotChangeABit) {
  StageClock clock;
  const Image image = render(c(), scene_, points_, kSeed, false, false, &clock);
  EXPECT_TRUE(same_bits(image, render(c(), scene_, points_)));
  const auto entered = [&](EstimateStage stage) {
    return clock.entered()[static_cast<std::size_t>(stage)];
  };
  EXPECT_EQ(entered(EstimateStage::SetUp), image.counters.estimates);
  EXPECT_EQ(entered(EstimateStage::Outside), points_.tiles.size());
  EXPECT_GE(entered(EstimateStage::Trace), 1u);
  EXPECT_GE(entered(EstimateStage::Sample), entered(EstimateStage::Trace));
  // One that learns nothing has nothing to adapt.
  const bool learns = c().entry->adaptive || c().entry->shares_in_tile;
  EXPECT_EQ(entered(EstimateStage::Adapt) > 0, learns);
}

INSTANTIATE_TEST_SUITE_P(AllEstimators, Contract, ::testing::ValuesIn(cases()),
                         [](const auto& test) { return test.param.name; });

// Where nothing is shared between points, the tile's size is no part of the result. ALSD shares
// within blocks of 8x8 pixels, and tiles consist of whole ones.
TEST(ContractOfPointEstimators, TileSizeDoesNotChangeABit) {
  const Scene scene(contract_scene());
  const ShadingPoints small = make_shading_points(scene, kCameraSamples, 1, 8);
  const ShadingPoints large = make_shading_points(scene, kCameraSamples, 1, 16);
  for (const Case& c : cases()) {
    if (c.entry->shares_in_tile && c.entry->name != "alsd") continue;
    EXPECT_TRUE(same_bits(render(c, scene, small), render(c, scene, large))) << c.name;
  }
}

TEST(ContractOfPmcHi, MapsAreTheWeightsOfLightsBsdfAndCone) {
  const Scene scene(contract_scene());
  const ShadingPoints points = make_shading_points(scene, kCameraSamples, 1, 8);
  for (const Case& c : cases()) {
    if (c.entry->name != "pmc_hi") continue;
    const bool as_one = c.params.text("light_mode") == "all_as_one";
    const std::vector<std::string> names =
        as_one ? std::vector<std::string>{"alpha_lights", "alpha_bsdf", "alpha_cone"}
               : std::vector<std::string>{"alpha_panel", "alpha_lamp", "alpha_shard", "alpha_bsdf",
                                          "alpha_cone"};
    const std::vector<MapInfo> maps = create(c, scene)->maps();
    ASSERT_GE(maps.size(), names.size());
    for (std::size_t k = 0; k < names.size(); ++k) EXPECT_EQ(maps[k].name, names[k]);
    const Image image = render(c, scene, points, kSeed, false, true);
    for (std::size_t i = 0; i < image.radiance.size(); ++i) {
      double sum = 0.0;
      for (std::size_t k = 0; k < names.size(); ++k) {
        const float alpha = image.maps[i * maps.size() + k];
        ASSERT_TRUE(alpha >= 0.0f && alpha <= 1.0f) << c.name << ' ' << names[k] << ' ' << alpha;
        sum += static_cast<double>(alpha);
      }
      // Each is rounded to float: half an ulp of 1 at most.
      if (!is_black(image.radiance[i])) {
        ASSERT_NEAR(sum, 1.0, 6e-8 * static_cast<double>(names.size())) << c.name;
      } else {
        ASSERT_TRUE(sum == 0.0 || std::abs(sum - 1.0) < 1e-6) << c.name << ' ' << sum;
      }
    }
  }
}

}  // namespace
}  // namespace penumbra::fixtures
