// Lights of which little is visible, occluders that touch or emit, and populations that are small.

#include <algorithm>
#include <cmath>

#include "harness/stability/closed_form.h"
#include "harness/stability/small_scenes.h"
#include "harness/stability/stability_case.h"

namespace penumbra::stability {
namespace {

const std::vector<View> kFloorView{{{0, 0, 0}, {0, 0, 1}}};
constexpr double kNear = 0.01;
constexpr double kLightHeight = 2;
constexpr double kOccluderHeight = 1;

/// World position of a point.
Vec3d world(const Scene& scene, const Vec3& position) {
  return Vec3d(position) / scene.traits().scale + scene.traits().center;
}

/// Where the line from a point through (x, y) at the occluders' height meets the lights' plane.
Vec3d projected(const Vec3d& from, double x, double y) {
  const double t = (kLightHeight - from.z) / (kOccluderHeight - from.z);
  return {from.x + (x - from.x) * t, from.y + (y - from.y) * t, kLightHeight};
}

/// Irradiance through a rectangular opening of the occluders' plane that shows light everywhere.
double through_opening(const Scene& scene, const ShadingPoint& p, double x0, double x1, double y0,
                       double y1) {
  const Vec3d from = world(scene, p.position);
  return irradiance_of_polygon(scene,
                               {projected(from, x0, y0), projected(from, x1, y0),
                                projected(from, x1, y1), projected(from, x0, y1)},
                               p);
}

/// Rectangle between two x that hides all of y.
void add_shutter(SceneDescription& scene, double x0, double x1) {
  add_rectangle(scene, facing_down(x0, x1, -1.4, 1.4, kOccluderHeight), 0);
}

/// A light of 1.6 x 1 behind shutters that leave a strip of a share `visible` of it open, and a
/// second one that is brighter and wholly hidden.
SceneDescription behind_shutters(double visible) {
  SceneDescription scene = small_scene("visible_strip");
  add_floor(scene);
  add_rectangle(scene, facing_down(-0.8, 0.8, -0.5, 0.5, kLightHeight), 1);
  add_rectangle(scene, facing_down(1.4, 1.7, -0.2, 0.2, kLightHeight), 10);
  const double open = 0.8 * visible;  // at half the height
  add_shutter(scene, -0.45, 0.37 - open);
  add_shutter(scene, 0.37, 0.95);
  return scene;
}

double through_shutters(const StabilityStep& step, const ShadingPoint& p, double visible) {
  const Scene& scene = *step.scene;
  const Vec3d from = world(scene, p.position);
  const double x0 = std::max(-0.8, projected(from, 0.37 - 0.8 * visible, 0).x);
  const double x1 = projected(from, 0.37, 0).x;
  return irradiance_of_polygon(scene,
                               {{x0, -0.5, kLightHeight},
                                {x1, -0.5, kLightHeight},
                                {x1, 0.5, kLightHeight},
                                {x0, 0.5, kLightHeight}},
                               p);
}

StabilityStep visible_strip(double visible) {
  StabilityStep step = on_surface(behind_shutters(visible), kFloorView, kNear);
  set_lambert(step, [&](const ShadingPoint& p) { return through_shutters(step, p, visible); });
  step.condition = 2 / visible;
  return step;
}

StabilityStep population(double size) {
  StabilityStep step = visible_strip(0.2);
  step.params = {{"population", static_cast<std::int64_t>(size)}};
  return step;
}

/// A hole of half width `half` in a plate under a light that fills it.
StabilityStep visible_cone(double half) {
  SceneDescription scene = small_scene("visible_cone");
  add_floor(scene);
  add_rectangle(scene, facing_down(-2, 2, -2, 2, kLightHeight), 1);
  const double x = 0.25;
  const double y = -0.15;
  add_rectangle(scene, facing_down(-1.9, x - half, -1.9, 1.9, kOccluderHeight), 0);
  add_rectangle(scene, facing_down(x + half, 1.9, -1.9, 1.9, kOccluderHeight), 0);
  add_rectangle(scene, facing_down(x - half, x + half, -1.9, y - half, kOccluderHeight), 0);
  add_rectangle(scene, facing_down(x - half, x + half, y + half, 1.9, kOccluderHeight), 0);
  StabilityStep step = on_surface(scene, kFloorView, kNear);
  set_lambert(step, [&](const ShadingPoint& p) {
    return through_opening(*step.scene, p, x - half, x + half, y - half, y + half);
  });
  step.condition = 2 / half;
  return step;
}

StabilityStep opposite_lights(double elevation) {
  // Two lights that face the point from opposite sides, lower and lower: the mean of their
  // directions loses its length. A third one behind a shutter makes a cone worth while.
  SceneDescription scene = small_scene("opposite_lights");
  const double low = elevation - 0.5 * std::min(elevation, 0.2);
  const double high = elevation + 0.5 * std::min(elevation, 0.2);
  add_rectangle(scene, {{1, -0.2, low}, {0, 0, high - low}, {0, 0.4, 0}}, 1);
  add_rectangle(scene, {{-1, -0.2, low}, {0, 0.4, 0}, {0, 0, high - low}}, 1);
  add_rectangle(scene, facing_down(-0.1, 0.1, -0.1, 0.1, 2), 1);
  add_rectangle(scene, facing_down(-0.2, 0.2, -0.2, 0.2, 1.8), 0);
  StabilityStep step = in_air(scene, {0, 0, 0}, kUp);
  set_lambert(step, [&](const ShadingPoint& p) {
    return irradiance_of(step.scene->lights()[0], p) + irradiance_of(step.scene->lights()[1], p);
  });
  step.condition = 1 / elevation;
  return step;
}

StabilityStep stacked_lights(double gap) {
  // The nearer light hides a far brighter one.
  SceneDescription scene = small_scene("stacked_lights");
  add_floor(scene);
  add_rectangle(scene, facing_down(-0.5, 0.5, -0.5, 0.5, 1), 1000);
  add_rectangle(scene, facing_down(-0.6, 0.6, -0.6, 0.6, 1 - gap), 1);
  StabilityStep step = on_surface(scene, kFloorView, kNear);
  set_lambert(step,
              [&](const ShadingPoint& p) { return irradiance_of(step.scene->lights()[1], p); });
  return step;
}

/// A light that is wholly behind a wall.
StabilityStep thin_wall(double thickness) {
  SceneDescription scene = small_scene("thin_wall");
  add_floor(scene);
  add_shape(scene, box({0, -1.9, 0}, {thickness, 1.9, 1}), 0);
  add_rectangle(scene, {{0.5, -0.5, 0.1}, {0, 0, 0.7}, {0, 1, 0}}, 1, true);
  std::vector<View> views;
  for (const double distance : {0.3, 0.1, 0.01, 0.001}) {
    views.push_back({{-distance, 0.1, 0}, Vec3d(-1, 0, 2).normalized()});
  }
  StabilityStep step = on_surface(scene, views, 0.01);
  step.exact.assign(step.points.size(), 0);
  return step;
}

/// A closed box under a white sky and beside a light; points close to an inner edge.
StabilityStep sealed_box(double distance) {
  SceneDescription scene = small_scene("sealed_box");
  TriangleMeshShape room = box({-1, -1, 0}, {1, 1, 1});
  add_shape(scene, room, 0, false, kGrey);
  add_rectangle(scene, {{1.2, -1, 0}, {0, 0, 1}, {0, 2, 0}}, 10, true);
  scene.environment = white_sky();
  std::vector<View> views;
  const Vec3d wo = Vec3d(-1, 0, 2).normalized();
  for (const double y : {-0.99, -0.5, 0.1, 0.7}) views.push_back({{1 - distance, y, 0}, wo});
  StabilityStep step = on_surface(scene, views, 0.5 * distance);
  step.exact.assign(step.points.size(), 0);
  return step;
}

}  // namespace

std::vector<StabilityCase> visibility_cases() {
  return {
      {"visible_strip", "W1 W2 W5", "shutters close before a light, a second one is hidden",
       "visible share", "Lambert's polygon of the visible part", log_steps(1, 1e-4, 9),
       visible_strip},
      {"visible_cone",
       "W2 W9",
       "light through a hole that closes",
       "half angle of the hole [rad]",
       "Lambert's polygon of the visible part",
       log_steps(0.6, 1e-3, 9),
       visible_cone,
       {},
       64},
      {"population",
       "W3 W4",
       "a strip of 20 % with ever smaller populations",
       "samples per iteration",
       "Lambert's polygon of the visible part",
       {128, 64, 32, 16, 12, 8, 6, 5, 4, 3},
       population,
       "population",
       64},
      {"opposite_lights", "W10 W11", "two opposite lights sink to the horizon",
       "height over distance", "Lambert's polygons", log_steps(1, 1e-4, 9), opposite_lights},
      {"stacked_lights", "L9 L11", "a light close behind one 1000 times dimmer",
       "gap over distance", "Lambert's polygon of the nearer", log_steps(0.3, 1e-6, 12),
       stacked_lights},
      {"thin_wall", "L11 G3", "a wall before a light thins out", "thickness over distance",
       "0: all is hidden", log_steps(0.1, 1e-6, 11), thin_wall},
      {"sealed_box", "G3 W1", "points near the edge of a closed box", "distance to the edge",
       "0: all is hidden", log_steps(0.5, 1e-6, 12), sealed_box},
  };
}

}  // namespace penumbra::stability
