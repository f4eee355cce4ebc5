// Many lights, lights of very different power, radiance far from 1, and the sky's sun.

#include <cmath>

#include "harness/stability/closed_form.h"
#include "harness/stability/small_scenes.h"
#include "harness/stability/stability_case.h"

namespace penumbra::stability {
namespace {

const std::vector<View> kFloorView{{{0.05, 0.02, 0}, {0, 0, 1}}};
constexpr double kNear = 0.01;
constexpr int kManySrl = 4;  // shadow rays per light where there are many

/// `count` equal squares on a grid of [-1, 1]^2 in the plane z = 1, every one facing down.
std::vector<RectangleShape> light_grid(int count) {
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  const double cell = 2.0 / side;
  std::vector<RectangleShape> lights;
  for (int i = 0; i < count; ++i) {
    const double x = -1 + cell * (i % side + 0.25);
    const double y = -1 + cell * (i / side + 0.25);
    lights.push_back(facing_down(x, x + 0.5 * cell, y, y + 0.5 * cell, 1));
  }
  return lights;
}

StabilityStep lit_by_all(const SceneDescription& scene) {
  StabilityStep step = on_surface(scene, kFloorView, kNear);
  set_lambert(step, [&](const ShadingPoint& p) { return irradiance_of_all(step, p); });
  return step;
}

StabilityStep many_lights(double count) {
  SceneDescription scene = small_scene("many_lights");
  add_floor(scene);
  for (const RectangleShape& light : light_grid(static_cast<int>(count))) {
    add_rectangle(scene, light, 1);
  }
  return lit_by_all(scene);
}

StabilityStep dominant_light(double ratio) {
  SceneDescription scene = small_scene("dominant_light");
  add_floor(scene);
  const std::vector<RectangleShape> lights = light_grid(64);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    add_rectangle(scene, lights[i], i == 11 ? ratio : 1);
  }
  return lit_by_all(scene);
}

StabilityStep black_lights(double count) {
  SceneDescription scene = small_scene("black_lights");
  add_floor(scene);
  const std::vector<RectangleShape> lights = light_grid(static_cast<int>(count) + 1);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    add_rectangle(scene, lights[i], 1);
    if (i > 0) scene.shapes.back().emission->radiance = Rgb(0.0f);
  }
  return lit_by_all(scene);
}

StabilityStep radiance_scale(double radiance) {
  // One light near, the other half hidden, so that adaptive estimators have something to learn.
  SceneDescription scene = small_scene("radiance");
  add_floor(scene);
  add_rectangle(scene, facing_down(-0.9, -0.4, -0.2, 0.3, 1), radiance);
  add_rectangle(scene, facing_down(0.2, 1.0, -0.2, 0.3, 1), radiance);
  add_rectangle(scene, facing_down(0.325, 1.0, -0.5, 0.5, 0.5), 0);
  StabilityStep step = on_surface(scene, kFloorView, kNear);
  // The shadow's edge on the second light, seen past the edge of the occluder.
  set_lambert(step, [&](const ShadingPoint& p) {
    const Scene& s = *step.scene;
    const double height =
        static_cast<double>(p.position.z) / s.traits().scale + s.traits().center.z;
    const double x = static_cast<double>(p.position.x) / s.traits().scale + s.traits().center.x;
    const double edge = x + (0.325 - x) * (1 - height) / (0.5 - height);
    const std::vector<Vec3d> seen{{0.2, -0.2, 1}, {0.2, 0.3, 1}, {edge, 0.3, 1}, {edge, -0.2, 1}};
    return irradiance_of(s.lights()[0], p) + radiance * irradiance_of_polygon(s, seen, p);
  });
  return step;
}

/// A sky of n rows and 2n columns, with one texel at a polar angle of about 45 degrees.
StabilityStep sky_with_sun(int rows, double sun, double background) {
  SceneDescription scene = small_scene("sun");
  add_extent(scene, 1);
  EnvironmentDescription sky;
  sky.rows = static_cast<std::uint32_t>(rows);
  sky.columns = 2 * sky.rows;
  sky.texels.assign(std::size_t{sky.rows} * sky.columns, Rgb(static_cast<float>(background)));
  const int row = rows / 4;
  sky.texels[static_cast<std::size_t>(row) * sky.columns + 1] = Rgb(static_cast<float>(sun));
  scene.environment = sky;
  StabilityStep step = in_air(scene, {0, 0, 0}, {0, 1, 0});
  const double patch =
      sky_patch_irradiance(M_PI * row / rows, M_PI * (row + 1) / rows, M_PI / rows);
  set_lambert(step,
              [&](const ShadingPoint&) { return background * M_PI + (sun - background) * patch; });
  step.condition = rows;
  return step;
}

StabilityStep sun_size(double rows) { return sky_with_sun(static_cast<int>(rows), 100, 0); }
StabilityStep sun_contrast(double ratio) { return sky_with_sun(64, ratio, 1); }

}  // namespace

std::vector<StabilityCase> distribution_cases() {
  const std::vector<double> doublings{4, 8, 16, 32, 64, 128, 256, 512};
  return {
      {"many_lights",
       "L7",
       "more and more lights on a grid",
       "number of lights",
       "sum of Lambert's polygons",
       {1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024},
       many_lights,
       {},
       kManySrl},
      {"dominant_light",
       "L7",
       "one of 64 lights outshines the others",
       "ratio of radiance",
       "sum of Lambert's polygons",
       log_steps(1, 1e10, 11),
       dominant_light,
       {},
       kManySrl},
      {"black_lights",
       "L8",
       "lights of no power beside one that shines",
       "number of black lights",
       "Lambert's polygon",
       {0, 1, 2, 4, 8, 16, 32, 64, 128},
       black_lights,
       {},
       kManySrl},
      {"bright", "W6 W7", "all radiance grows", "radiance", "Lambert's polygon",
       log_steps(1, 1e30, 11), radiance_scale},
      {"dim", "W6 W7", "all radiance falls", "radiance", "Lambert's polygon",
       log_steps(1, 1e-30, 11), radiance_scale},
      {"sun_size", "I2", "a single texel of a black sky shrinks", "rows of the sky",
       "integral over the texel", doublings, sun_size},
      {"sun_contrast", "I2", "a texel outshines a white sky", "ratio of radiance",
       "pi, and the integral over the texel", log_steps(1, 1e10, 11), sun_contrast},
  };
}

}  // namespace penumbra::stability
