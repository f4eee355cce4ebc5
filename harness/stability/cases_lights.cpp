// Lights that are tiny, huge, near, touching, edge-on, or turned away.

#include <cmath>

#include "harness/stability/closed_form.h"
#include "harness/stability/small_scenes.h"
#include "harness/stability/stability_case.h"

namespace penumbra::stability {
namespace {

constexpr double kRadiance = 3;
const std::vector<View> kFloorView{{{0.05, 0.02, 0}, {0, 0, 1}}};
constexpr double kNear = 0.01;  // rays to the floor start here

StabilityStep small_light(double side) {
  SceneDescription scene = small_scene("small_light");
  add_floor(scene);
  add_rectangle(scene, facing_down(0.3, 0.3 + side, 0.2, 0.2 + side, 1), kRadiance);
  StabilityStep step = on_surface(scene, kFloorView, kNear);
  set_lambert(step, [&](const ShadingPoint& p) { return irradiance_of_all(step, p); });
  step.condition = 1 / side;
  return step;
}

StabilityStep sliver_triangle(double height) {
  SceneDescription scene = small_scene("sliver_triangle");
  add_floor(scene);
  TriangleMeshShape mesh;
  mesh.vertices = {{-0.5, 0.2, 1}, {0.1, 0.2 + height, 1}, {0.5, 0.2, 1}};
  mesh.triangles = {{0, 1, 2}};
  add_shape(scene, mesh, kRadiance);
  StabilityStep step = on_surface(scene, kFloorView, kNear);
  // As rounded: the light's own vertices.
  const std::vector<Vec3>& rounded = step.scene->lights()[0].vertices;
  const std::vector<Vec3d> corners(rounded.begin(), rounded.end());
  set_lambert(step, [&](const ShadingPoint& p) {
    return kRadiance * polygon_irradiance(corners, Vec3d(p.position), Vec3d(p.shading_normal));
  });
  step.condition = 1 / height;
  return step;
}

StabilityStep degenerate_triangles(double count) {
  SceneDescription scene = small_scene("degenerate_triangles");
  add_floor(scene);
  TriangleMeshShape mesh;
  mesh.vertices = {{-0.3, 0.1, 1}, {-0.3, 0.7, 1}, {0.4, 0.7, 1}, {0.4, 0.1, 1}, {0.05, 0.4, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  // Without area: a corner twice, and three on a line in turn.
  for (int i = 0; i < static_cast<int>(count); ++i) {
    if (i % 2 == 0) {
      mesh.triangles.push_back({0, 2, 2});
    } else {
      mesh.triangles.push_back({0, 4, 2});
    }
  }
  add_shape(scene, mesh, kRadiance);
  StabilityStep step = on_surface(scene, kFloorView, kNear);
  set_lambert(step, [&](const ShadingPoint& p) {
    return kRadiance * irradiance_of_polygon(
                           *step.scene,
                           {mesh.vertices[0], mesh.vertices[1], mesh.vertices[2], mesh.vertices[3]},
                           p);
  });
  return step;
}

StabilityStep huge_light(double half) {
  // A tilted plane that the horizon cuts.
  SceneDescription scene = small_scene("huge_light");
  const Vec3d across(2 * half, 0, 0);
  const Vec3d along = Vec3d(0, 0.9, -0.3).normalized() * (2 * half);
  add_rectangle(scene, {Vec3d(0, 0, 1) - (across + along) * 0.5, along, across}, kRadiance);
  StabilityStep step = in_air(scene, {0, 0, 0}, kUp);
  set_lambert(step, [&](const ShadingPoint& p) { return irradiance_of_all(step, p); });
  step.condition = half;
  return step;
}

StabilityStep near_light(double distance) {
  SceneDescription scene = small_scene("near_light");
  add_rectangle(scene, facing_down(-0.5, 0.5, -0.5, 0.5, distance), kRadiance);
  StabilityStep step = in_air(scene, {0.1, 0.2, 0}, kUp);
  set_lambert(step, [&](const ShadingPoint& p) { return irradiance_of_all(step, p); });
  return step;
}

StabilityStep touching_light(double distance) {
  // It stands on the plane of the point.
  SceneDescription scene = small_scene("touching_light");
  add_rectangle(scene, {{0, -1, 0}, {0, 2, 0}, {0, 0, 1}}, kRadiance);
  StabilityStep step = in_air(scene, {distance, 0.1, 0}, kUp);
  set_lambert(step, [&](const ShadingPoint& p) { return irradiance_of_all(step, p); });
  return step;
}

StabilityStep edge_on_light(double height) {
  SceneDescription scene = small_scene("edge_on_light");
  add_rectangle(scene, {{0.5, 0, 0.2}, {0, 0, 0.8}, {1, 0, 0}}, kRadiance, true);
  StabilityStep step = in_air(scene, {0, height, 0}, kUp);
  set_lambert(step, [&](const ShadingPoint& p) { return irradiance_of_all(step, p); });
  step.condition = height > 0 ? 1 / height : 1;
  return step;
}

StabilityStep turned_light(double degrees) {
  SceneDescription scene = small_scene("turned_light");
  add_floor(scene);
  const double angle = degrees * M_PI / 180;
  const Vec3d along(0, std::cos(angle), std::sin(angle));
  add_rectangle(scene, {Vec3d(-0.25, 0.1, 1) - along * 0.25, along * 0.5, {0.5, 0, 0}}, kRadiance);
  StabilityStep step = on_surface(scene, kFloorView, kNear);
  const Light& light = step.scene->lights()[0];
  set_lambert(step, [&](const ShadingPoint& p) {
    const bool is_front = (Vec3d(p.position) - Vec3d(light.origin)).dot(Vec3d(light.normal)) > 0;
    return is_front ? irradiance_of(light, p) : 0.0;
  });
  return step;
}

StabilityStep small_sphere(double radius) {
  SceneDescription scene = small_scene("small_sphere");
  add_floor(scene);
  add_shape(scene, SphereShape{{0.3, 0.1, 0.95}, radius}, kRadiance);
  StabilityStep step = on_surface(scene, kFloorView, kNear);
  set_lambert(step, [&](const ShadingPoint& p) { return irradiance_of_all(step, p); });
  step.condition = 1 / radius;
  return step;
}

StabilityStep near_sphere(double gap) {
  SceneDescription scene = small_scene("near_sphere");
  add_shape(scene, SphereShape{{0, 0, 0}, 1}, kRadiance);
  const Vec3d direction = Vec3d(0.2, -0.3, -0.9).normalized();
  StabilityStep step = in_air(scene, direction * (1 + gap), -direction);
  set_lambert(step, [&](const ShadingPoint& p) { return irradiance_of_all(step, p); });
  return step;
}

StabilityStep inside_sphere(double gap) {
  SceneDescription scene = small_scene("inside_sphere");
  add_shape(scene, SphereShape{{0, 0, 0}, 1}, kRadiance, true);
  const Vec3d direction = Vec3d(0.2, -0.3, -0.9).normalized();
  StabilityStep step = in_air(scene, direction * (1 - gap), Vec3d(0.3, -0.5, 0.8));
  set_lambert(step, [&](const ShadingPoint&) { return kRadiance * M_PI; });
  return step;
}

StabilityStep near_point_light(double distance) {
  SceneDescription scene = small_scene("near_point_light");
  add_extent(scene, 1);
  scene.point_lights.push_back({"lamp", {0, 0, distance}, Vec3d(2)});
  StabilityStep step = in_air(scene, {0, 0, 0}, Vec3d(0.6, 0, 0.8));
  set_lambert(step, [&](const ShadingPoint& p) {
    return 2 * static_cast<double>(p.shading_normal.z) / (distance * distance);
  });
  return step;
}

StabilityStep narrow_spot(double degrees) {
  SceneDescription scene = small_scene("narrow_spot");
  add_floor(scene);
  SpotLightDescription spot{"spot", {0.05, 0.02, 1}, {0, 0, -1}, Vec3d(2)};
  spot.inner_angle_deg = 0.5 * degrees;
  spot.outer_angle_deg = degrees;
  scene.spot_lights.push_back(spot);
  StabilityStep step = on_surface(scene, kFloorView, kNear);
  set_lambert(step, [&](const ShadingPoint& p) {
    const Vec3d d = Vec3d(step.scene->lights()[0].center) - Vec3d(p.position);
    const double scale = step.scene->traits().scale;
    return 2 * scale * scale / d.dot(d);
  });
  step.condition = 10;
  return step;
}

}  // namespace

std::vector<StabilityCase> light_cases() {
  return {
      {"small_light", "L1 L12", "a square light shrinks", "side over distance", "Lambert's polygon",
       log_steps(1, 1e-5, 11), small_light},
      {"sliver_triangle", "L2 G4", "a triangle light thins out", "height over base",
       "Lambert's polygon", log_steps(1, 1e-5, 11), sliver_triangle},
      {"degenerate_faces",
       "S8",
       "triangles without area in a light",
       "number of them",
       "Lambert's polygon",
       {0, 1, 2, 4, 8, 16, 30, 31, 64},
       degenerate_triangles},
      {"huge_light", "L3", "a tilted light grows, the horizon cuts it", "half side over distance",
       "Lambert's polygon, cut at the horizon", log_steps(1, 1e5, 11), huge_light},
      {"near_light", "L3 L4", "a light comes near", "distance over side", "Lambert's polygon",
       log_steps(1, 1e-6, 13), near_light},
      {"touching_light", "L4 W11", "a point nears a light that stands on its plane",
       "distance over height", "Lambert's polygon", log_steps(1, 1e-6, 13), touching_light},
      {"edge_on_light", "L5", "a point sinks into the plane of a light", "height over distance",
       "Lambert's polygon; 0 in the plane", log_steps_then(1, 1e-5, 11, 0), edge_on_light},
      {"turned_light",
       "L10",
       "a one-sided light turns its back",
       "angle [deg]",
       "Lambert's polygon; 0 from behind",
       {0, 30, 60, 70, 80, 83, 85, 100, 135, 180},
       turned_light},
      {"small_sphere", "L6", "a sphere light shrinks", "radius over distance",
       "closed form of a sphere", log_steps(0.3, 1e-5, 10), small_sphere},
      {"near_sphere", "L6", "a point nears a sphere light from outside", "gap over radius",
       "closed form of a sphere", log_steps(1, 1e-6, 13), near_sphere},
      {"inside_sphere", "L6", "a point nears a sphere light from inside", "gap over radius",
       "pi x radiance", log_steps(1, 1e-6, 13), inside_sphere},
      {"near_point_light", "L4", "a point light comes near", "distance", "inverse square",
       log_steps(1, 1e-6, 13), near_point_light},
      {"narrow_spot", "W9", "a spot light narrows, its axis hits the point", "half angle [deg]",
       "inverse square", log_steps(60, 1e-4, 12), narrow_spot},
  };
}

}  // namespace penumbra::stability
