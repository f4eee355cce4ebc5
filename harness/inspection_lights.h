#pragma once

#include <string_view>

#include "scenes/core/scene.h"

/// Lights as `penumbra inspect` shows them, in the units of the scene's file.
namespace penumbra {

Vec3d world_position(const Light& light, const SceneTraits& traits);
Vec3d world_intensity(const Light& light, const SceneTraits& traits);
/// Area in square world units.
double world_area(const Light& light, const SceneTraits& traits);
std::string_view type_name(LightType type);
/// Half angle in degrees of a cone of 1 - cos = depth.
double half_angle_deg(double depth);

}  // namespace penumbra
