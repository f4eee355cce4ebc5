#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "harness/stability/stability_case.h"
#include "scenes/core/scene_description.h"

/// What the cases build their scenes and points from. World coordinates with z up; materials 0
/// (black) and 1 (grey) are always there.
namespace penumbra::stability {

inline constexpr std::uint32_t kBlack = 0;
inline constexpr std::uint32_t kGrey = 1;
inline constexpr double kAlbedo = 0.5;  ///< of grey, a Lambert surface
inline const Vec3d kUp{0, 0, 1};

/// A scene with the two materials and nothing else.
SceneDescription small_scene(std::string name);

/// Adds a material; @return its index
std::uint32_t add_material(SceneDescription& scene, MaterialDescription material);

/// Adds a parallelogram. @param radiance  0: not a light
void add_rectangle(SceneDescription& scene, const RectangleShape& shape, double radiance,
                   bool two_sided = false, std::uint32_t material = kBlack);

void add_shape(SceneDescription& scene, Shape shape, double radiance, bool two_sided = false,
               std::uint32_t material = kBlack);

/// The square [-half, half]^2 in the plane z = 0, facing up.
void add_floor(SceneDescription& scene, double half = 2, std::uint32_t material = kGrey);

/// Axis-aligned rectangle in the plane of constant z that faces down.
RectangleShape facing_down(double x0, double x1, double y0, double y1, double z);

/// Axis-aligned closed box of six outward faces.
TriangleMeshShape box(const Vec3d& low, const Vec3d& high);

/// White sky of radiance 1.
EnvironmentDescription white_sky();

/// Two black specks at the far corners of a cube: they set the scene's extent and hide nothing.
void add_extent(SceneDescription& scene, double half);

/// A point that hangs in the air: it has a normal and a material, but no surface.
/// @param normal, wo  any length
StabilityStep in_air(const SceneDescription& scene, const Vec3d& position, const Vec3d& normal,
                     const Vec3d& wo, std::uint32_t material = kGrey);
StabilityStep in_air(const SceneDescription& scene, const Vec3d& position, const Vec3d& normal);

/// A view of a surface: a ray that starts close above it.
struct View {
  Vec3d position;  ///< on the surface
  Vec3d wo;        ///< unit, towards the viewer
};

/// Points where rays really meet a surface, with the offset that the core gives them. Each view
/// fills an equal share of the tile.
/// @param distance  from which the rays start
StabilityStep on_surface(const SceneDescription& scene, const std::vector<View>& views,
                         double distance);

/// Sets the exact values: reflected radiance of a Lambert surface of the albedo kAlbedo, for the
/// irradiance at each point.
template <typename Irradiance>
void set_lambert(StabilityStep& step, Irradiance irradiance) {
  step.exact.clear();
  for (const ShadingPoint& point : step.points) {
    step.exact.push_back(kAlbedo * M_1_PI * irradiance(point));
  }
}

/// Irradiance at a point from a light of the scene that nothing hides, from the single-precision
/// shape that the estimators see: rectangle (either side) or sphere above the horizon.
double irradiance_of(const Light& light, const ShadingPoint& point);

/// Sum of `irradiance_of` over all lights.
double irradiance_of_all(const StabilityStep& step, const ShadingPoint& point);

/// Irradiance at a point from a polygon in world coordinates, of radiance 1.
double irradiance_of_polygon(const Scene& scene, const std::vector<Vec3d>& corners,
                             const ShadingPoint& point);

}  // namespace penumbra::stability
