// Spot and directional lights through every unbiased registered estimator: no matter of chance, so
// every estimate is the closed form, to a few roundings and without variance.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/fixtures.h"

namespace penumbra::fixtures {
namespace {

constexpr double kAlbedo = 0.7;
const Vec3d kPosition(0.3, -0.2, 0.1);
const Vec3d kNormal = Vec3d(0.1, 0.2, 0.9).normalized();
const Vec3d kLamp(1.0, 0.5, 1.6);
const Vec3d kSun(0.4, -0.3, -1.2);

PlacedPoint placed(const SceneDescription& description, std::uint32_t material = 0) {
  PlacedPoint result{std::make_unique<Scene>(description), {}};
  result.point = place(*result.scene, kPosition, kNormal, kNormal, material);
  return result;
}

/// One spot light off its axis by half the penumbra in cosines, one directional light.
SceneDescription lit() {
  SceneDescription scene;
  scene.materials = {lambert("grey", kAlbedo),
                     lambert("black", 0.0),
                     {"plastic", MetallicRoughnessMaterial{Rgb(0.5f), 0.2f, 0.4f}}};
  scene.shapes = {rectangle("base", 1, {-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, 0.0)};
  scene.spot_lights = {{"spot", kLamp, kPosition - kLamp + Vec3d(0.3, 0, 0), Vec3d(3.0), 2, 20}};
  scene.directional_lights = {{"sun", kSun, Rgb(1.5f)}, {"below", -kSun, Rgb(7.0f)}};
  return scene;
}

double spot_irradiance(const SceneDescription& scene) {
  const SpotLightDescription& spot = scene.spot_lights[0];
  const Vec3d d = spot.position - kPosition;
  const double cosine = -d.dot(spot.direction) / (d.length() * spot.direction.length());
  const double outer = std::cos(spot.outer_angle_deg * M_PI / 180.0);
  const double inner = std::cos(spot.inner_angle_deg * M_PI / 180.0);
  const double share = std::min(1.0, std::max(0.0, (cosine - outer) / (inner - outer)));
  return spot.intensity.x * share * share * d.dot(kNormal) / std::pow(d.length(), 3);
}

double sun_irradiance() { return 1.5 * -kSun.normalized().dot(kNormal); }

void expect_exactly(const PlacedPoint& point, double exact, std::uint64_t rays,
                    std::string_view label) {
  for (const EstimatorEntry* entry : all_estimators()) {
    const ParamSet params = params_with(*entry, {});
    if (!entry->bias_reason(params).empty()) continue;
    const RunStatistics run = estimate_many(*entry, params, {SamplerKind::Independent, 4, 12},
                                            point, exact, test_seed(label), 512);
    EXPECT_NEAR(run.mean, exact, 3e-6 * exact) << label << ", " << entry->name;
    EXPECT_LE(run.variance, 1e-28 * exact) << label << ", " << entry->name;
    EXPECT_EQ(run.counters.rays, rays * run.counters.estimates) << label << ", " << entry->name;
  }
}

TEST(DeltaLights, ReflectionIsExactWithOneRayForEachLight) {
  const SceneDescription scene = lit();
  const double spot = spot_irradiance(scene);
  ASSERT_GT(spot, 0.1);
  expect_exactly(placed(scene), kAlbedo / M_PI * (spot + sun_irradiance()), 2, "free");

  SceneDescription aside = scene;  // the point is outside the cone
  aside.spot_lights[0].direction = kPosition - kLamp + Vec3d(1.5, 0, 0);
  ASSERT_EQ(spot_irradiance(aside), 0.0);
  expect_exactly(placed(aside), kAlbedo / M_PI * sun_irradiance(), 1, "outside the cone");
}

TEST(DeltaLights, ReflectionByAGlossySurfaceIsItsBsdfTimesIrradiance) {
  SceneDescription scene = lit();
  scene.spot_lights.clear();
  const PlacedPoint point = placed(scene, 2);
  const BoundBsdf bsdf(point.scene->bsdf(2), Vec3(0, 0, 1));  // wo is the normal
  const double cosine = -kSun.normalized().dot(kNormal);
  const auto sine = static_cast<float>(std::sqrt(1.0 - cosine * cosine));
  const double f_cos =
      static_cast<double>(bsdf.evaluate({sine, 0.0f, static_cast<float>(cosine)}).f_cos.x);
  expect_exactly(point, 1.5 * f_cos, 1, "glossy");
}

TEST(DeltaLights, AnOccluderHidesThemAndOneBehindTheLightDoesNot) {
  const SceneDescription scene = lit();
  const double spot = spot_irradiance(scene);
  const auto with_screen = [&](const Vec3d& middle) {
    SceneDescription result = scene;
    result.shapes.push_back(
        rectangle("screen", 1, middle - Vec3d(0.05, 0.05, 0), {0.1, 0, 0}, {0, 0.1, 0}, 0.0));
    return result;
  };
  expect_exactly(placed(with_screen((kLamp + kPosition) * 0.5)), kAlbedo / M_PI * sun_irradiance(),
                 2, "spot hidden");
  expect_exactly(placed(with_screen(kLamp + (kLamp - kPosition) * 0.2)),
                 kAlbedo / M_PI * (spot + sun_irradiance()), 2, "screen behind the spot");
  // However far away the screen is: directional light comes from beyond every shape.
  expect_exactly(placed(with_screen(kPosition - kSun)), kAlbedo / M_PI * spot, 2, "sun hidden");
  SceneDescription far = with_screen(kPosition);
  far.spot_lights.clear();
  far.shapes.back().shape =
      RectangleShape{kPosition - kSun * 1e4 - Vec3d(500, 500, 0), {1000, 0, 0}, {0, 1000, 0}};
  expect_exactly(placed(far), 0.0, 1, "sun hidden far away");
}

}  // namespace
}  // namespace penumbra::fixtures
