// Environment and point lights of a scene: indices, shading points, units, content hash.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "scenes/core/error.h"
#include "scenes/core/normalise.h"
#include "scenes/core/scene.h"
#include "tests/core/trace.h"
#include "tests/support/scenes_support.h"

namespace penumbra {
namespace {

EnvironmentDescription sky() {
  return {"sky", 2, 2, {Rgb(1, 2, 3), Rgb(4, 5, 6), Rgb(7, 8, 9), Rgb(10, 11, 12)}};
}

SceneDescription lit_scene() {
  SceneDescription scene = test::small_scene();
  scene.point_lights = {{"lamp", {1, 2, 0.5}, Vec3d(3, 2, 1)}, {"bulb", {-1, 1, 0}, Vec3d(1.0)}};
  scene.environment = sky();
  return scene;
}

TEST(SceneLights, AreAreaLightsThenPointsThenTheEnvironment) {
  const Scene scene(lit_scene());
  ASSERT_EQ(scene.lights().size(), 6u);
  EXPECT_EQ(scene.environment_light(), 5);
  EXPECT_EQ(scene.lights()[3].name, "lamp");
  EXPECT_EQ(scene.lights()[5].name, "sky");
  EXPECT_EQ(scene.traits().point_lights, 2u);
  EXPECT_TRUE(scene.traits().has_environment);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(scene.lights()[i].is_delta(), i == 3 || i == 4) << i;
  }
  const Scene dark(test::small_scene());
  EXPECT_EQ(dark.environment_light(), kNoLight);
  EXPECT_EQ(dark.traits().point_lights, 0u);
  EXPECT_FALSE(dark.traits().has_environment);
}

TEST(SceneLights, CameraRaysThatMeetNothingSeeTheEnvironment) {
  for (const bool with_sky : {true, false}) {
    SceneDescription description = lit_scene();
    if (!with_sky) description.environment.reset();
    description.camera.look_at = {0, 2.5, 0};  // floor below, nothing above
    const Scene scene(description);
    const ShadingPoints points = make_shading_points(scene, 1, 1, 16);
    int misses = 0;
    for (const ShadingPoint& p : points.points) {
      const RayHit hit = test::trace(scene, scene.camera().position(), -p.wo);
      if (hit.hit()) {
        EXPECT_NE(p.light, 5);
        continue;
      }
      ++misses;
      EXPECT_FALSE(p.valid());
      EXPECT_EQ(p.light, with_sky ? 5 : kNoLight);
    }
    EXPECT_GT(misses, 100);
    EXPECT_LT(misses, static_cast<int>(points.points.size()) - 100);
  }
}

TEST(SceneLights, PointsOfIrradianceAreTheSamePlacesAndLookAlongTheNormal) {
  SceneDescription description = lit_scene();
  description.camera.look_at = {0, 2.5, 0};
  description.materials.push_back(test::lambert(0.0f, "black"));
  description.shapes[4].material = 2;  // black surfaces have an irradiance as well
  const Scene scene(description);
  const ShadingPoints radiance = make_shading_points(scene, 2, 5, 16);
  const ShadingPoints irradiance = make_shading_points(scene, 2, 5, 16, Quantity::Irradiance);
  EXPECT_EQ(radiance.quantity, Quantity::Radiance);
  EXPECT_EQ(irradiance.quantity, Quantity::Irradiance);
  ASSERT_EQ(radiance.points.size(), irradiance.points.size());
  std::size_t valid = 0;
  int black = 0;
  for (std::size_t i = 0; i < radiance.points.size(); ++i) {
    const ShadingPoint& a = radiance.points[i];
    const ShadingPoint& b = irradiance.points[i];
    EXPECT_EQ(b.light, kNoLight);
    const bool met = test::trace(scene, scene.camera().position(), -a.wo).hit();
    ASSERT_EQ(b.valid(), met);
    if (!met) continue;
    ++valid;
    black += a.valid() ? 0 : 1;
    EXPECT_EQ(b.material, scene.irradiance_material());
    EXPECT_EQ(b.position, a.position);
    EXPECT_EQ(b.geometric_normal, a.geometric_normal);
    EXPECT_EQ(b.wo, b.shading_normal);
    EXPECT_GT(dot(b.geometric_normal, a.wo), 0.0f) << "on the viewer's side";
  }
  EXPECT_EQ(irradiance.valid_count, valid);
  EXPECT_GT(black, 0);
}

TEST(SceneLights, IrradianceMaterialReflectsTheCosine) {
  const Scene scene(lit_scene());
  const BoundBsdf bsdf(scene.bsdf(scene.irradiance_material()), Vec3(0.0f, 0.0f, 1.0f));
  for (const float cosine : {0.01f, 0.5f, 1.0f}) {
    const Vec3 wi(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine);
    EXPECT_NEAR(bsdf.evaluate(wi).f_cos.x, cosine, 1e-6f * cosine);
  }
}

/// The scene in another unit of length, in which numbers for lengths are `factor` times as large.
SceneDescription in_units(SceneDescription scene, double factor) {
  scene.camera.position *= factor;
  scene.camera.look_at *= factor;
  scene.shapes = {test::shape(
      "floor",
      RectangleShape{{-4 * factor, 0, 4 * factor}, {8 * factor, 0, 0}, {0, 0, -8 * factor}})};
  for (PointLightDescription& light : scene.point_lights) {
    light.position *= factor;
    light.intensity *= factor * factor;
  }
  return scene;
}

Vec3d irradiance(const Scene& scene, const Vec3d& world, std::size_t light) {
  const auto sample =
      sample_delta(scene.lights()[light], test::to_scene(scene, world), Vec3(0.0f, 1.0f, 0.0f));
  return sample ? Vec3d(sample->irradiance) * double{sample->wi.y} : Vec3d(-1.0);
}

TEST(PointLight, IrradianceIsIntensityTimesCosineOverDistanceSquaredInAnyUnit) {
  const Vec3d place(0.25, 0.0, -0.5);
  const SceneDescription description = lit_scene();
  // Lengths of 1e-25 and 1e25 have squares beyond the range of float.
  for (const double factor : {1e-25, 1e-3, 1.0, 1000.0, 0x1p20, 1e25}) {
    const Scene scene(in_units(description, factor));
    for (std::size_t i = 0; i < 2; ++i) {
      const PointLightDescription& light = description.point_lights[i];
      const Vec3d d = light.position - place;
      const Vec3d exact = light.intensity * (d.y / std::pow(d.length(), 3));
      const Vec3d found = irradiance(scene, place * factor, i);
      EXPECT_LT((found - exact).length(), 2e-6 * exact.length()) << factor << " " << found << exact;
    }
  }
}

TEST(PointLight, IntensityStaysWithoutItsUnitTheIrradianceDoesNot) {  // negative control
  SceneDescription description = in_units(lit_scene(), 1000.0);
  const Vec3d before = irradiance(Scene(description), {0, 0, 0}, 0);
  description.point_lights[0].intensity /= 1e6;
  const Vec3d after = irradiance(Scene(description), {0, 0, 0}, 0);
  EXPECT_NEAR(after.x / before.x, 1e-6, 1e-11);
}

TEST(PointLight, HasNoSampleBelowTheHorizonOrAtItself) {
  Light light;
  light.type = LightType::Point;
  light.intensity = Vec3d(1.0);
  light.center = {1.0f, 2.0f, 3.0f};
  const Vec3 up(0.0f, 1.0f, 0.0f);
  EXPECT_TRUE(sample_delta(light, {1.0f, 1.9f, 3.0f}, up).has_value());
  EXPECT_FALSE(sample_delta(light, {1.0f, 2.1f, 3.0f}, up).has_value());
  EXPECT_FALSE(sample_delta(light, {0.0f, 2.0f, 3.0f}, up).has_value()) << "in the plane";
  EXPECT_FALSE(sample_delta(light, light.center, up).has_value());
  EXPECT_TRUE(light.is_delta());
  LightProposal proposal;
  EXPECT_FALSE(proposal.set_up(light, LightSampling::Area, Vec3(0.0f), up)) << "no density";
}

TEST(PointLight, RefusesADistanceThatFloatCannotHold) {
  SceneDescription scene = lit_scene();
  scene.point_lights[1].position.y = 1e25;
  try {
    const Scene built(scene);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("point light \"bulb\" is "), std::string::npos)
        << error.what();
  }
  scene.point_lights[1].position.y = 1e15;
  EXPECT_NO_THROW(Scene{scene});
}

TEST(ContentHash, ChangesWithEnvironmentAndPointLights) {
  using Change = std::function<void(SceneDescription&)>;
  const std::vector<Change> changes = {
      [](auto& s) { s.environment.reset(); },
      [](auto& s) { s.environment->texels[3].z = 12.0001f; },
      [](auto& s) { std::swap(s.environment->texels[0], s.environment->texels[1]); },
      [](auto& s) { s.environment->columns = 4, s.environment->rows = 1; },
      [](auto& s) { s.environment->columns = 1, s.environment->rows = 4; },
      [](auto& s) { s.point_lights[0].intensity.y += 1e-9; },
      [](auto& s) { s.point_lights[1].position.x += 1e-9; },
      [](auto& s) { s.point_lights.pop_back(); },
      [](auto& s) { s.point_lights.clear(); },
      [](auto& s) { s.point_lights.push_back(s.point_lights[0]); }};
  std::set<std::string> hashes = {content_hash(test::small_scene()), content_hash(lit_scene())};
  ASSERT_EQ(hashes.size(), 2u);
  for (std::size_t i = 0; i < changes.size(); ++i) {
    SceneDescription scene = lit_scene();
    changes[i](scene);
    EXPECT_TRUE(hashes.insert(content_hash(scene)).second) << "change " << i;
  }
  SceneDescription renamed = lit_scene();
  renamed.environment->name = "dome";
  renamed.point_lights[0].name = "candle";
  EXPECT_EQ(content_hash(renamed), content_hash(lit_scene()));
}

}  // namespace
}  // namespace penumbra
