// Units, distance from the origin, detail in a wide scene, and bodies that must not shadow
// themselves.

#include <cmath>

#include "harness/stability/small_scenes.h"
#include "harness/stability/stability_case.h"

namespace penumbra::stability {
namespace {

/// A floor that a partly hidden light lights, in units of `unit`, its corner at `offset`.
/// @param extent   half side of the scene about it, in units; 0: nothing else is there
/// @param flipped  whether the floor is wound the other way round
StabilityStep lit_floor(double unit, const Vec3d& offset, double extent, bool flipped = false) {
  SceneDescription scene = small_scene("lit_floor");
  const auto add = [&](const Vec3d& origin, const Vec3d& u, const Vec3d& v, double radiance,
                       std::uint32_t material) {
    add_rectangle(scene, {offset + origin * unit, u * unit, v * unit}, radiance, false, material);
  };
  const Vec3d x(4, 0, 0);
  const Vec3d y(0, 4, 0);
  add({-2, -2, 0}, flipped ? y : x, flipped ? x : y, 0, kGrey);
  add({-0.5, -0.5, 2}, {0, 1, 0}, {1, 0, 0}, 1, kBlack);
  add({0.0625, -1, 1}, {0, 2, 0}, {1, 0, 0}, 0, kBlack);
  if (extent > 0) add_extent(scene, extent * unit);
  const std::vector<View> views{{offset + Vec3d(0.03125, 0, 0) * unit, {0, 0, 1}}};
  StabilityStep step = on_surface(scene, views, 0.25 * unit);
  set_lambert(step, [&](const ShadingPoint& p) {
    const Scene& s = *step.scene;
    const Vec3d at = (Vec3d(p.position) / s.traits().scale + s.traits().center - offset) / unit;
    const double edge = at.x + (0.0625 - at.x) * (2 - at.z) / (1 - at.z);
    std::vector<Vec3d> seen{{-0.5, -0.5, 2}, {-0.5, 0.5, 2}, {edge, 0.5, 2}, {edge, -0.5, 2}};
    for (Vec3d& corner : seen) corner = offset + corner * unit;
    return irradiance_of_polygon(s, seen, p);
  });
  return step;
}

StabilityStep scene_unit(double unit) { return lit_floor(unit, Vec3d(0), 0); }

StabilityStep offset(double distance) {
  StabilityStep step = lit_floor(1, Vec3d(distance, -0.5 * distance, 0.25 * distance), 0, true);
  // World coordinates are doubles.
  step.condition = 1 + distance * 0x1p-28;
  return step;
}

StabilityStep far_detail(double extent) {
  StabilityStep step = lit_floor(1, Vec3d(0.5, 0.25, -0.75) * extent, extent);
  step.condition = extent;
  return step;
}

/// Points all over a sphere of a small share of the scene, under a white sky.
StabilityStep convex_sphere(double radius) {
  SceneDescription scene = small_scene("convex_sphere");
  const Vec3d center(0.3, -0.2, 0.4);
  add_shape(scene, SphereShape{center, radius}, 0, false, kGrey);
  add_extent(scene, 1);
  scene.environment = white_sky();
  std::vector<View> views;
  constexpr double kGolden = 2.399963229728653;  // angle of a spiral that covers a sphere [rad]
  for (std::size_t i = 0; i < kTilePoints; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(kTilePoints);
    const double phi = kGolden * static_cast<double>(i);
    const double r = std::sqrt(1 - z * z);
    const Vec3d n(r * std::cos(phi), r * std::sin(phi), z);
    views.push_back({center + n * radius, n});
  }
  StabilityStep step = on_surface(scene, views, radius);
  step.exact.assign(step.points.size(), kAlbedo);
  return step;
}

/// Points on the faces of a cube, close to its edges.
StabilityStep convex_edge(double distance) {
  SceneDescription scene = small_scene("convex_edge");
  add_shape(scene, box(Vec3d(-1), Vec3d(1)), 0, false, kGrey);
  scene.environment = white_sky();
  std::vector<View> views;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      Vec3d n(0);
      n[axis] = side;
      Vec3d position = n;
      position[(axis + 1) % 3] = side * (1 - distance);
      position[(axis + 2) % 3] = 0.3;
      views.push_back({position, n});
    }
  }
  views.push_back({{1 - distance, 1 - distance, 1}, {0, 0, 1}});
  views.push_back({{-1, distance - 1, 1 - distance}, {-1, 0, 0}});
  StabilityStep step = on_surface(scene, views, 0.1);
  step.exact.assign(step.points.size(), kAlbedo);
  return step;
}

}  // namespace

std::vector<StabilityCase> geometry_cases() {
  return {
      {"unit_large", "G1", "a scene in ever larger units", "units per scene",
       "Lambert's polygon of the visible part", log_steps(1, 1e12, 9), scene_unit},
      {"unit_small", "G1", "a scene in ever smaller units", "units per scene",
       "Lambert's polygon of the visible part", log_steps(1, 1e-12, 9), scene_unit},
      {"offset", "G2 S7", "a scene ever farther from the origin, its floor wound backwards",
       "distance over size", "Lambert's polygon of the visible part", log_steps(1, 1e8, 9), offset},
      {"far_detail", "G2 G4", "the lit floor as a detail of an ever wider scene",
       "scene over detail", "Lambert's polygon of the visible part", log_steps(4, 1e4, 9),
       far_detail},
      {"convex_sphere", "G3", "a sphere shrinks in its scene, no self-shadow", "radius over scene",
       "the albedo, under a white sky", log_steps(0.5, 1e-4, 9), convex_sphere},
      {"convex_edge", "G3 G4", "points near the edges of a cube, no self-shadow",
       "distance to the edge", "the albedo, under a white sky", log_steps(0.5, 1e-6, 12),
       convex_edge},
  };
}

}  // namespace penumbra::stability
