#pragma once

#include "scenes/core/models/gltf_document.h"
#include "scenes/core/models/gltf_transform.h"

/// Cameras and lights of glTF: they look along -z of their node, with +y up.
namespace penumbra {

/// Makes the camera of a node the model's, unless it has one.
/// @return false when the model has one
/// @throws InputError when its angle of view is impossible
bool add_camera(const GltfDocument& document, ModelBuilder& builder, int node,
                const Placement& world);

/// Adds a light of KHR_lights_punctual that a node places.
/// @throws InputError when there is no such light, or its values are impossible
void add_light(const GltfDocument& document, ModelBuilder& builder, int node, int light,
               const Placement& world);

}  // namespace penumbra
