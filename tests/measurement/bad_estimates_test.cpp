// Estimates that are not finite or negative: all of them are counted, none is changed, and each
// names the component and the sample that made it so. Faults are planted in an estimator of its
// own.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "harness/pixel_record.h"
#include "harness/scene_store.h"
#include "scenes/core/error.h"
#include "tests/support/scenes_support.h"

namespace penumbra {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// What is planted at an estimate: samples that sum up to its value.
struct Fault {
  std::uint32_t pixel{0};
  int estimate{0};
  std::vector<SampleRecord> samples;
  Rgb delta{0.0f};
};

SampleRecord sample(int component, const Rgb& f, double weight = 1.0) {
  SampleRecord result;
  result.component = component;
  result.f = f;
  result.weight = weight;
  result.fate = SampleFate::Lit;
  return result;
}

// Pixels of an image of 8 x 4.
const std::vector<Fault>& faults() {
  static const std::vector<Fault> list{
      {3, 0, {sample(0, Rgb(1.0f)), sample(1, Rgb(2.0f, -3.0f, 1.0f))}},
      {9, 1, {sample(0, Rgb(0.0f), kInfinity), sample(0, Rgb(0.0f, kNan, 0.0f))}},
      {9, 2, {sample(1, Rgb(1e30f), 1e10)}},
      {17, 0, {sample(0, Rgb(3e38f)), sample(1, Rgb(3.1e38f))}},
      {30, 2, {}, Rgb(kInfinity)}};
  return list;
}

/// One everywhere, but for the faults.
class Faulty final : public Estimator {
 public:
  void estimate(const Tile& tile, std::uint64_t, TileOutput& out) noexcept override {
    for (int pixel = 0; pixel < tile.pixel_count(); ++pixel) {
      for (int e = 0; e < tile.spp; ++e) {
        Rgb& value = out.radiance[static_cast<std::size_t>(pixel * tile.spp + e)];
        value = Rgb(1.0f);
        for (const Fault& fault : faults()) {
          if (fault.pixel != tile.pixel_index(pixel) || fault.estimate != e) continue;
          value = fault.delta;
          for (const SampleRecord& s : fault.samples) {
            if (!is_black(s.f)) value += s.f * static_cast<float>(s.weight);
          }
          EstimateRecord* const record =
              out.recorder != nullptr ? out.recorder->begin(pixel, e) : nullptr;
          if (record == nullptr) continue;
          record->components = {"lamp", "bsdf"};
          record->samples = fault.samples;
          record->delta = fault.delta;
        }
      }
    }
  }
};

std::span<const ParamSpec> no_params() { return {}; }
std::unique_ptr<Estimator> create_faulty(const Scene&, const ParamSet&, const Budget&) {
  return std::make_unique<Faulty>();
}
constexpr EstimatorEntry kFaulty = {
    .name = "faulty", .summary = {}, .citation = {}, .params = no_params, .create = create_faulty};

/// All bad, and no record of it.
class AllNegative final : public Estimator {
 public:
  void estimate(const Tile&, std::uint64_t, TileOutput& out) noexcept override {
    for (Rgb& value : out.radiance) value = Rgb(1.0f, 1.0f, -1e-30f);
  }
};
std::unique_ptr<Estimator> create_negative(const Scene&, const ParamSet&, const Budget&) {
  return std::make_unique<AllNegative>();
}
constexpr EstimatorEntry kAllNegative = {.name = "negative",
                                         .summary = {},
                                         .citation = {},
                                         .params = no_params,
                                         .create = create_negative};

class BadEstimates : public testing::Test {
 protected:
  BadEstimates() {
    SceneDescription description = test::small_scene();
    description.camera.resolution = {8, 4};
    scene_.emplace(std::move(description));
    points_ = make_shading_points(*scene_, 1, kCameraSeed, 8);
  }

  RenderResult run(const EstimatorEntry& entry, int spp = 3) const {
    RenderSettings settings;
    settings.estimator = &entry;
    settings.spp = spp;
    settings.threads = 2;
    RenderResult result = render(*scene_, points_, settings);
    find_causes(*scene_, points_, settings, result);
    return result;
  }

  std::optional<Scene> scene_;
  ShadingPoints points_;
};

TEST_F(BadEstimates, AreCountedInImageOrderAndNameTheirComponent) {
  const RenderResult result = run(kFaulty);
  ASSERT_EQ(result.bad_count, 5u);
  ASSERT_EQ(result.bad.size(), 5u);
  const char* expected[] = {
      "pixel 3,0 estimate 0: (3, -2, 2); component bsdf, sample 1: f (2, -3, 1), weight 1",
      "pixel 1,1 estimate 1: (0, nan, 0); component lamp, sample 1: f (0, nan, 0), weight 1",
      "pixel 1,1 estimate 2: (inf, inf, inf); component bsdf, sample 0: f (1e+30, 1e+30, 1e+30), "
      "weight 1e+10",
      "pixel 1,2 estimate 0: (inf, inf, inf); sum of all; the largest is component bsdf, sample 1",
      "pixel 6,3 estimate 2: (inf, inf, inf); component of delta lights and mirrors"};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_TRUE(describe(result.bad[i]).starts_with(expected[i])) << describe(result.bad[i]);
  }
}

TEST_F(BadEstimates, StayInTheImageAsTheyAre) {
  const RenderResult result = run(kFaulty);
  const Image image = result.image();
  EXPECT_FLOAT_EQ(image.at(3, 0).y, (-2.0f + 1.0f + 1.0f) / 3.0f);
  EXPECT_TRUE(std::isnan(image.at(1, 1).y) || std::isinf(image.at(1, 1).y));
  EXPECT_TRUE(std::isinf(image.at(6, 3).x));
  EXPECT_EQ(image.at(0, 0), Rgb(1.0f));
}

TEST_F(BadEstimates, AreAllCountedAndTheFirstHundredListed) {
  const RenderResult result = run(kAllNegative, 4);
  EXPECT_EQ(result.bad_count, 8u * 4u * 4u);
  ASSERT_EQ(result.bad.size(), 100u);
  EXPECT_EQ(result.bad.front().cause, "component unknown: the estimator left no record");
}

TEST_F(BadEstimates, NegativeOnesAreSoundWhereTheEstimatorSaysSoAndNoOthers) {
  EstimatorEntry negative = kAllNegative;
  negative.may_be_negative = true;
  const RenderResult sound = run(negative);
  EXPECT_EQ(sound.bad_count, 0u);
  EXPECT_EQ(sound.radiance.front().z, static_cast<double>(-1e-30f)) << "nothing is clamped";
  EstimatorEntry faulty = kFaulty;
  faulty.may_be_negative = true;
  const RenderResult result = run(faulty);
  ASSERT_EQ(result.bad_count, 4u) << "those that are not finite";
  EXPECT_EQ(result.bad.front().x, 1);
}

TEST_F(BadEstimates, MoreOfThemThanMemoryShouldHoldAreRefused) {
  RenderSettings settings;
  settings.estimator = &kFaulty;
  settings.spp = 1 << 23;
  try {
    render(*scene_, points_, settings);
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              "8388608 estimates for each of 32 pixels of a tile are too many; allowed: up to "
              "134217728 together");
  }
}

}  // namespace
}  // namespace penumbra
