// What must not change an image: the unit of radiance, the unit of length, the distance from the
// origin, and what the processor does with denormal numbers. For every registered estimator.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/stability/estimator_scene.h"

namespace penumbra {
namespace {

using test::estimator_scene;
using test::EstimatorImage;
using test::image_of;

class Scaling : public test::EveryEstimator {};

double channel_mean(const EstimatorImage& image) {
  double sum = 0.0;
  for (const Rgb& value : image.radiance) {
    sum += (static_cast<double>(value.x) + static_cast<double>(value.y) +
            static_cast<double>(value.z)) /
           3.0;
  }
  return sum / static_cast<double>(image.radiance.size());
}

// Share of estimates that differ by more than a relative tolerance.
double differing_share(const EstimatorImage& a, const EstimatorImage& b, float tolerance) {
  double differing = 0.0;
  for (std::size_t i = 0; i < a.radiance.size(); ++i) {
    const float x = a.radiance[i].y;
    const float y = b.radiance[i].y;
    differing += std::abs(x - y) > tolerance * std::max(x, y) ? 1.0 : 0.0;
  }
  return differing / static_cast<double>(a.radiance.size());
}

TEST_P(Scaling, RadianceTimes2ToThe66GivesTheSameDigitsAndTheSameWeights) {
  const Scene original(estimator_scene(1.0));
  const EstimatorImage image = image_of(*GetParam(), original);
  EXPECT_GT(channel_mean(image), 0.0);
  for (const int power : {-66, 66}) {
    const auto factor = static_cast<float>(std::ldexp(1.0, power));
    const Scene scene(estimator_scene(static_cast<double>(factor)));
    const EstimatorImage scaled = image_of(*GetParam(), scene);
    ASSERT_EQ(scaled.radiance.size(), image.radiance.size());
    for (std::size_t i = 0; i < image.radiance.size(); ++i) {
      ASSERT_EQ(scaled.radiance[i], image.radiance[i] * factor) << "2^" << power << ", " << i;
    }
    EXPECT_TRUE(test::same_bits(scaled.maps, image.maps)) << "2^" << power;
    EXPECT_EQ(scaled.counters.rays, image.counters.rays);
  }
}

TEST_P(Scaling, LengthsTimesAPowerOf2GiveTheSameBits) {
  const EstimatorImage image = image_of(*GetParam(), Scene(estimator_scene(1.0)));
  for (const int power : {-17, 20}) {
    const Scene scene(estimator_scene(1.0, std::ldexp(1.0, power)));
    const EstimatorImage scaled = image_of(*GetParam(), scene);
    EXPECT_EQ(scaled.radiance, image.radiance) << "2^" << power;
  }
}

// Positions then round elsewhere: single rays fall to the other side of an edge, and what is
// learned from them is learned otherwise. The image stays the same.
TEST_P(Scaling, OtherUnitsAndPlacesGiveTheSameImage) {
  const EstimatorImage image = image_of(*GetParam(), Scene(estimator_scene(1.0)));
  const double mean = channel_mean(image);
  struct Place {
    double unit;
    Vec3d shift;
  };
  for (const Place& place : {Place{1e-5, Vec3d(0.0)}, Place{1e6, Vec3d(0.0)},
                             Place{1.0, Vec3d(1e3, -1e3, 1e3)}, Place{1.0, Vec3d(1e6, 0, -1e6)}}) {
    const EstimatorImage other =
        image_of(*GetParam(), Scene(estimator_scene(1.0, place.unit, place.shift)));
    EXPECT_NEAR(channel_mean(other) / mean, 1.0, 5e-3) << place.unit << " " << place.shift;
    EXPECT_LT(differing_share(image, other, 1e-3f), GetParam()->adaptive ? 0.3 : 0.05)
        << place.unit << " " << place.shift;
  }
}

TEST_P(Scaling, DenormalsKeptOrFlushedGiveTheSameImage) {
  const Scene scene(estimator_scene(1.0));
  const EstimatorImage kept = image_of(*GetParam(), scene, Denormals::Kept);
  const EstimatorImage flushed = image_of(*GetParam(), scene, Denormals::Flushed);
  EXPECT_EQ(differing_share(kept, flushed, 1e-6f), 0.0);
  EXPECT_EQ(kept.counters.rays, flushed.counters.rays);
}

INSTANTIATE_TEST_SUITE_P(Estimators, Scaling,
                         ::testing::ValuesIn(all_estimators().begin(), all_estimators().end()),
                         test::estimator_name);

// The dimmest radiance of all, where denormals are all there is: the mode has to show.
TEST(ScalingControl, DenormalRadianceIsLostWhenFlushed) {
  const EstimatorEntry& entry = *find_estimator("mis");
  const Scene scene(estimator_scene(1e-39));
  const EstimatorImage kept = image_of(entry, scene, Denormals::Kept);
  EXPECT_GT(differing_share(kept, image_of(entry, scene, Denormals::Flushed), 1e-6f), 0.1);
}

// Weights of 1e20, as 2^66 gives, squared and added in float: what the estimators' sums would be.
TEST(ScalingControl, SquaresOfBrightWeightsOverflowInFloat) {
  const auto weight = static_cast<float>(std::ldexp(1.0, 66));
  EXPECT_FALSE(std::isfinite(weight * weight));
}

// Not inlined, so that the product stays where the mode is set.
[[gnu::noinline]] float tenth(const volatile float& value) { return value * 0.1f; }

TEST(DenormalMode, IsSetAndRestoredAndSays) {
  const std::string_view before = DenormalMode::text();
  const volatile float tiny = 2e-38f;
  {
    const DenormalMode mode(Denormals::Flushed);
    EXPECT_EQ(tenth(tiny), 0.0f);
    EXPECT_EQ(DenormalMode::text(), "flushed to zero");
    {
      const DenormalMode inner(Denormals::Kept);
      EXPECT_GT(tenth(tiny), 0.0f);
      EXPECT_EQ(DenormalMode::text(), "kept");
    }
    EXPECT_EQ(tenth(tiny), 0.0f);
  }
  EXPECT_EQ(DenormalMode::text(), before);
}

}  // namespace
}  // namespace penumbra
