#pragma once

#include <filesystem>

#include "scenes/core/located_json.h"
#include "scenes/core/scene_description.h"

namespace penumbra {

/// Reads a model file as a scene (`scene_of_model`) or a scene file (format "penumbra-scene";
/// scenes/scene.schema.json states it, scenes/README.md explains it).
///
/// Materials are sorted by name; shapes keep the order of the file, a checkerboard being replaced
/// by one quad mesh per material. Faces without area are left out, and a light of zero (an
/// emission, a point light, an environment) is taken as none; `warnings` says so.
/// @throws InputError listing every fault as "file:line:column: error: /json/pointer: message"
SceneDescription load_scene_description(const std::filesystem::path& file);

/// As above, from a document that is already parsed.
SceneDescription parse_scene_description(const LocatedJson& document);

}  // namespace penumbra
