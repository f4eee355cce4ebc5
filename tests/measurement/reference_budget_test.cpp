// How good a reference must be: one of only four times a render's budget changes the debiased MSE
// by less than 3 %, where it changes the naive one by a quarter.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "harness/metrics.h"
#include "harness/render.h"
#include "harness/scene_store.h"
#include "harness/statistics.h"
#include "scenes/core/scene.h"
#include "tests/support/fixtures.h"
#include "tests/support/scenes_support.h"

namespace penumbra {
namespace {

constexpr int kSpp = 4;
constexpr int kRenders = 12;
constexpr int kReferences = 12;
constexpr int kWidth = 72;
constexpr int kHeight = 48;

/// An unoccluded rectangle light over a diffuse plane, seen from above: no pixel is much noisier
/// than the others, so that a single image tells its MSE well.
SceneDescription rectangle_over_plane() {
  SceneDescription scene;
  scene.materials = {fixtures::lambert("grey", 0.5)};
  scene.shapes = {fixtures::rectangle("plane", 0, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 0.0),
                  fixtures::rectangle("light", 0, {-1, -1, 2}, {0, 2, 0}, {2, 0, 0}, 4.0)};
  scene.camera.position = Vec3d(0, -3, 1.8);
  scene.camera.look_at = Vec3d(0, 0, 0);
  scene.camera.up = Vec3d(0, 0, 1);
  scene.camera.vertical_fov_deg = 30;
  scene.camera.resolution = {kWidth, kHeight};
  return scene;
}

class Renders {
 public:
  Renders()
      : scene_(rectangle_over_plane()), points_(make_shading_points(scene_, 1, kCameraSeed, 16)) {
    settings_.estimator = find_estimator("mis");
    settings_.params = fixtures::params_with(*settings_.estimator, {});
    settings_.budget = {SamplerKind::Independent, 2, 0};
  }

  std::vector<Rgb> image(int spp, const std::string& label) {
    settings_.spp = spp;
    settings_.seed = fixtures::test_seed(label);
    return render(scene_, points_, settings_).image().pixels;
  }

 private:
  Scene scene_;
  ShadingPoints points_;
  RenderSettings settings_;
};

/// The image of the plane by Lambert's formula for polygons: no noise, no code of the estimators.
std::vector<Rgb> exact_image() {
  const Scene scene(rectangle_over_plane());
  const ShadingPoints points = make_shading_points(scene, 1, kCameraSeed, 16);
  std::vector<Rgb> image(std::size_t{kWidth} * kHeight, Rgb(0.0f));
  for (const TileRect& tile : points.tiles) {
    const std::span<const ShadingPoint> list = points.of(tile);
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (!list[i].valid()) continue;
      const auto pixel = static_cast<int>(i);
      const double irradiance =
          4.0 *
          test::rectangle_irradiance(scene.lights()[0], list[i].position, list[i].geometric_normal);
      image[pixel_index(kWidth, tile.x0 + pixel % tile.width, tile.y0 + pixel / tile.width)] =
          Rgb(static_cast<float>(0.5 / M_PI * irradiance));
    }
  }
  return image;
}

double mean_of(const std::vector<std::vector<Rgb>>& images, const ReferenceHalves& reference,
               double ImageMetrics::*metric) {
  Welford values;
  for (const std::vector<Rgb>& image : images) {
    values.add(image_metrics(image, reference, 0.01).*metric);
  }
  return values.mean();
}

// The change is a random number of mean 0: its standard deviation, taken from the references
// themselves, must leave 3 % more than four of them away. Both claims are about every one of the 12
// references: 12 x 6e-5 false alarms.
TEST(ReferenceBudget, FourTimesTheRendersChangesTheDebiasedMseByLessThanThreePercent) {
  Renders renders;
  std::vector<std::vector<Rgb>> images;
  for (int r = 0; r < kRenders; ++r) {
    images.push_back(renders.image(kSpp, "render " + std::to_string(r)));
  }
  const std::vector<Rgb> truth = exact_image();
  const double mse = mean_of(images, {truth, truth}, &ImageMetrics::mse);
  ASSERT_GT(mse, 0.0);
  Welford debiased;
  Welford naive;
  for (int i = 0; i < kReferences; ++i) {
    const auto half = [&](const char* name) {
      return renders.image(2 * kSpp, std::string(name) + std::to_string(i));
    };
    const std::vector<Rgb> half_a = half("half a ");
    const std::vector<Rgb> half_b = half("half b ");
    const ReferenceHalves reference{half_a, half_b};
    debiased.add(mean_of(images, reference, &ImageMetrics::mse) / mse - 1.0);
    naive.add(mean_of(images, reference, &ImageMetrics::mse_naive) / mse - 1.0);
    EXPECT_NEAR(mean_of(images, reference, &ImageMetrics::mse) / mse, 1.0, 0.03) << i;
    EXPECT_GT(mean_of(images, reference, &ImageMetrics::mse_naive) / mse, 1.0 + 0.03)
        << "negative control: the naive MSE holds the reference's variance";
  }
  std::printf("debiased %+.2f %% +- %.2f %%, naive %+.2f %% +- %.2f %%\n", 100 * debiased.mean(),
              100 * std::sqrt(*debiased.variance()), 100 * naive.mean(),
              100 * std::sqrt(*naive.variance()));
  EXPECT_LT(4.0 * std::sqrt(*debiased.variance()), 0.03) << "3 % is not resolved";
  // On average there is no change: 3.89 standard errors, a false-alarm level of 1e-4.
  EXPECT_LT(std::abs(debiased.mean()), 3.89 * debiased.standard_error().value());
  EXPECT_NEAR(naive.mean(), 0.25, 3.89 * naive.standard_error().value() + 0.02)
      << "the reference has four times the samples, hence a quarter of the variance";
}

}  // namespace
}  // namespace penumbra
