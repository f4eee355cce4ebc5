#pragma once

#include <array>
#include <filesystem>
#include <string>

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

/// What a list of scenes shows; read without reading models or generating geometry.
struct SceneSummary {
  std::string name, summary;
  std::array<int, 2> resolution{};  ///< width, height [pixels]
  std::size_t shapes{0};            ///< as the file counts them
};

/// Reads only what a list shows; the rest of the file is not checked.
/// @throws InputError where what it reads does not obey the schema
SceneSummary read_scene_summary(const std::filesystem::path& file);

/// As `load_scene_description`, from a document that is already parsed.
SceneDescription parse_scene_description(const LocatedJson& document);

}  // namespace penumbra
