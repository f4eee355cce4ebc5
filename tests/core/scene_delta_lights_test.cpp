// Spot and directional lights: closed forms, narrow cones, units, what is left out.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "scenes/core/error.h"
#include "scenes/core/normalise.h"
#include "scenes/core/scene.h"
#include "scenes/core/scene_lights.h"
#include "tests/core/trace.h"
#include "tests/support/scenes_support.h"

namespace penumbra {
namespace {

using Real = long double;

const Vec3 kUp(0.0f, 1.0f, 0.0f);

SceneDescription lit_scene() {
  SceneDescription scene = test::small_scene();
  scene.point_lights = {{"lamp", {1, 2, 0.5}, Vec3d(3, 2, 1)}};
  scene.spot_lights = {{"spot", {0.5, 2, -0.25}, {-0.5, -3, 0.25}, Vec3d(5, 6, 7), 10, 25},
                       {"beam", {-1, 3, 1}, {1, -3, -1}, Vec3d(2.0), 0, 1e-3}};
  scene.directional_lights = {{"sun", {1, -2, 0.5}, Rgb(3, 2, 1)}};
  scene.environment = EnvironmentDescription{"sky", 1, 1, {Rgb(1.0f)}};
  return scene;
}

TEST(DeltaLights, AreAreaPointSpotDirectionalEnvironmentInThisOrder) {
  const Scene scene(lit_scene());
  const std::vector<std::string> names = {"panel", "cube", "ball", "lamp",
                                          "spot",  "beam", "sun",  "sky"};
  ASSERT_EQ(scene.lights().size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(scene.lights()[i].name, names[i]);
    EXPECT_EQ(scene.lights()[i].is_delta(), i >= 3 && i <= 6) << i;
  }
  EXPECT_EQ(scene.environment_light(), 7);
  EXPECT_EQ(scene.traits().point_lights, 1u);
  EXPECT_EQ(scene.traits().spot_lights, 2u);
  EXPECT_EQ(scene.traits().directional_lights, 1u);
}

Light spot(const Vec3d& position, const Vec3d& direction, double inner_deg, double outer_deg) {
  return make_light(
      SpotLightDescription{"spot", position, direction, Vec3d(1.0), inner_deg, outer_deg}, 1.0);
}

/// The falloff by cosines in long double, as the extension's text states it.
Real falloff(Real angle_deg, Real inner_deg, Real outer_deg) {
  const Real rad = std::numbers::pi_v<Real> / 180.0L;
  const Real sine = [&](Real a, Real b) {  // cos b - cos a, which cancels as it stands
    return 2.0L * std::sin(0.5L * (a + b) * rad) * std::sin(0.5L * (a - b) * rad);
  }(outer_deg, angle_deg);
  const Real width = 2.0L * std::sin(0.5L * (outer_deg + inner_deg) * rad) *
                     std::sin(0.5L * (outer_deg - inner_deg) * rad);
  const Real share = std::clamp(sine / width, 0.0L, 1.0L);
  return share * share;
}

// A point straight below the light by 1, the axis turned away from it by each angle.
TEST(SpotLight, FallsOffAsStatedAtEveryWidth) {
  for (const double outer : {90.0, 45.0, 10.0, 1.0, 1e-2, 1e-4, 1e-6}) {
    for (const double inner_share : {0.0, 0.5, 0.999}) {
      const double inner = inner_share * outer;
      for (const double share : {0.0, 0.25, 0.5, 0.75, 0.9995, 1.001, 1.5}) {
        const double angle = share * outer * std::numbers::pi / 180.0;
        const Light light = spot({0, 1, 0}, {std::sin(angle), -std::cos(angle), 0.0}, inner, outer);
        const auto sample = sample_delta(light, Vec3(0.0f), kUp);
        const auto exact =
            static_cast<double>(falloff(static_cast<Real>(share) * static_cast<Real>(outer),
                                        static_cast<Real>(inner), static_cast<Real>(outer)));
        if (exact == 0.0) {
          EXPECT_FALSE(sample.has_value()) << "outer " << outer << " share " << share;
          continue;
        }
        ASSERT_TRUE(sample.has_value()) << "outer " << outer << " share " << share;
        // The axis in double has a rounding of 1e-16: 1e-16/angle of the angle, which a narrow
        // penumbra magnifies.
        const double width = (outer - inner) * std::numbers::pi / 180.0;
        EXPECT_NEAR(double{sample->irradiance.x}, exact, 3e-7 + 1e-15 / width)
            << "outer " << outer << " inner " << inner << " share " << share;
        EXPECT_EQ(sample->wi, kUp);
        EXPECT_EQ(sample->distance, 1.0f);
      }
    }
  }
}

TEST(SpotLight, CosinesInFloatWouldNotTellNarrowConesApart) {  // negative control
  const float outer = std::cos(1e-4f), inside = std::cos(0.5e-4f);
  EXPECT_EQ(outer, inside);
}

TEST(SpotLight, LightsNothingOutsideItsConeBehindItOrBelowTheHorizon) {
  const Light light = spot({0, 2, 0}, {0, -1, 0}, 0, 90);
  EXPECT_TRUE(sample_delta(light, {1.0f, 0.0f, 0.0f}, kUp).has_value());
  EXPECT_FALSE(sample_delta(light, {1.0f, 3.0f, 0.0f}, -kUp).has_value()) << "behind";
  EXPECT_FALSE(sample_delta(light, {1.0f, 2.0f, 0.0f}, {-1, 0, 0}).has_value()) << "at 90 degrees";
  EXPECT_FALSE(sample_delta(light, {1.0f, 0.0f, 0.0f}, -kUp).has_value()) << "below the horizon";
  EXPECT_FALSE(sample_delta(light, light.center, kUp).has_value());
  LightProposal proposal;
  EXPECT_FALSE(proposal.set_up(light, LightSampling::Area, Vec3(0.0f), kUp)) << "no density";
}

TEST(DirectionalLight, ShinesFromInfinitelyFarAwayOnWhatFacesIt) {
  const Light light =
      make_light(DirectionalLightDescription{"sun", {3e-20, -4e-20, 0}, Rgb(2, 3, 4)});
  for (const Vec3& from : {Vec3(0.0f), Vec3(1e6f, -1e6f, 3.0f)}) {
    const auto sample = sample_delta(light, from, kUp);
    ASSERT_TRUE(sample.has_value());
    EXPECT_LT((sample->wi - Vec3(-0.6f, 0.8f, 0.0f)).length(), 1e-7f);
    EXPECT_EQ(sample->distance, std::numeric_limits<float>::infinity());
    EXPECT_EQ(sample->irradiance, Rgb(2, 3, 4));
  }
  EXPECT_FALSE(sample_delta(light, Vec3(0.0f), -kUp).has_value());
  EXPECT_FALSE(sample_delta(light, Vec3(0.0f), {0, 0, 1}).has_value()) << "edge-on";
  LightProposal proposal;
  EXPECT_FALSE(proposal.set_up(light, LightSampling::Area, Vec3(0.0f), kUp)) << "no density";
}

/// The scene in another unit of length, moved by an offset in that unit.
SceneDescription in_units(SceneDescription scene, double factor, const Vec3d& offset) {
  const auto move = [&](Vec3d& p) { p = p * factor + offset; };
  scene.camera.position = Vec3d(0, 1, 5);
  move(scene.camera.position);
  move(scene.camera.look_at);
  RectangleShape floor{{-4, 0, 4}, {8 * factor, 0, 0}, {0, 0, -8 * factor}};
  move(floor.origin);
  scene.shapes = {test::shape("floor", floor)};
  scene.point_lights.clear();
  for (SpotLightDescription& light : scene.spot_lights) {
    move(light.position);
    light.intensity *= factor * factor;
    light.direction *= 0.125 * factor;  // its length means nothing
  }
  return scene;
}

TEST(DeltaLights, IrradianceIsTheClosedFormInAnyUnitAndPlace) {
  const SceneDescription description = lit_scene();
  const SpotLightDescription& light = description.spot_lights[0];
  const Vec3d place(0.375, 0.0, -0.5);
  const Vec3d d = light.position - place;
  const double angle =
      std::acos((-d).dot(light.direction) / (d.length() * light.direction.length()));
  const auto share = static_cast<double>(
      falloff(static_cast<Real>(angle * 180.0 / std::numbers::pi), 10.0L, 25.0L));
  ASSERT_GT(share, 0.1);
  ASSERT_LT(share, 0.99);
  const Vec3d exact = light.intensity * (share * d.y / std::pow(d.length(), 3));
  for (const double factor : {1e-25, 1e-3, 1.0, 1000.0, 0x1p20, 1e25}) {
    for (const Vec3d& offset : {Vec3d(0.0), Vec3d(1e3, -2e3, 5e2) * factor}) {
      const Scene scene(in_units(description, factor, offset));
      const Vec3 from = test::to_scene(scene, place * factor + offset);
      const auto sample = sample_delta(scene.lights()[0], from, kUp);
      ASSERT_EQ(scene.lights()[0].name, "spot");
      ASSERT_TRUE(sample.has_value()) << factor;
      const Vec3d found = Vec3d(sample->irradiance) * double{sample->wi.y};
      EXPECT_LT((found - exact).length(), 5e-6 * exact.length()) << factor << offset;
      const auto sun = sample_delta(scene.lights()[2], from, kUp);
      ASSERT_TRUE(sun.has_value());
      EXPECT_EQ(sun->irradiance, Rgb(3, 2, 1)) << "no unit of length in it";
      EXPECT_NEAR(double{sun->wi.y}, 2.0 / std::sqrt(5.25), 1e-7);
    }
  }
}

TEST(SpotLight, RefusesADistanceThatFloatCannotHold) {
  SceneDescription scene = lit_scene();
  scene.spot_lights[1].position.y = 1e25;
  try {
    const Scene built(scene);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("spot light \"beam\" is "), std::string::npos)
        << error.what();
  }
}

TEST(ContentHash, ChangesWithSpotAndDirectionalLights) {
  using Change = std::function<void(SceneDescription&)>;
  const std::vector<Change> changes = {
      [](auto& s) { s.spot_lights[0].inner_angle_deg += 1e-9; },
      [](auto& s) { s.spot_lights[0].outer_angle_deg += 1e-9; },
      [](auto& s) { s.spot_lights[0].direction.x += 1e-9; },
      [](auto& s) { s.spot_lights[0].position.x += 1e-9; },
      [](auto& s) { s.spot_lights[1].intensity.z += 1e-9; },
      [](auto& s) { s.spot_lights.clear(); },
      [](auto& s) { s.directional_lights[0].direction.z += 1e-9; },
      [](auto& s) { s.directional_lights[0].irradiance.z += 1e-6f; },
      [](auto& s) { s.directional_lights.clear(); }};
  std::set<std::string> hashes = {content_hash(lit_scene())};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    SceneDescription scene = lit_scene();
    changes[i](scene);
    EXPECT_TRUE(hashes.insert(content_hash(scene)).second) << "change " << i;
  }
}

}  // namespace
}  // namespace penumbra
