#pragma once

#include "scenes/core/light.h"
#include "scenes/core/scene_description.h"
#include "scenes/core/surface_geometry.h"

/// From descriptions to lights, in scene space.
namespace penumbra {

/// The light of a shape with an emission.
/// @param geometry  of the same shape
Light make_light(const ShapeDescription& shape, const SurfaceGeometry& geometry);

/// @param diagonal  of the scene, for the message
/// @throws InputError when the light is too far away for float
Light make_light(const PointLightDescription& description, double diagonal);

/// @throws InputError as of a point light
Light make_light(const SpotLightDescription& description, double diagonal);

Light make_light(const DirectionalLightDescription& description);

Light make_light(const EnvironmentDescription& description);

}  // namespace penumbra
