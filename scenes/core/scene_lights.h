#pragma once

#include <memory>
#include <vector>

#include "scenes/core/light.h"
#include "scenes/core/ray_batch.h"
#include "scenes/core/scene_description.h"
#include "scenes/core/surface_geometry.h"

/// From descriptions to lights, in scene space.
namespace penumbra {

/// The light of a shape with an emission.
/// @param geometry  of the same shape
Light make_light(const ShapeDescription& shape, const SurfaceGeometry& geometry);

/// Bounds of the triangles of a mesh light.
/// @param vertices  three per triangle
NormalBounds normal_bounds(const std::vector<Vec3>& vertices);

/// A mesh light of more triangles has a ray scene of its own. Measured: a query of that costs as
/// much as trying about 60 triangles.
inline constexpr std::size_t kMaxTriedTriangles = 64;

/// @return a committed scene of a mesh light's triangles, or nullptr where trying them is as fast
std::unique_ptr<RayScene> make_crossings(const Light& light);

/// @param diagonal  of the scene, for the message
/// @throws InputError when the light is too far away for float
Light make_light(const PointLightDescription& description, double diagonal);

/// @throws InputError as of a point light
Light make_light(const SpotLightDescription& description, double diagonal);

Light make_light(const DirectionalLightDescription& description);

Light make_light(const EnvironmentDescription& description);

}  // namespace penumbra
