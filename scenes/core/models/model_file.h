#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scenes/core/scene_description.h"

/// Model files of other programs: OBJ with MTL, PLY, glTF 2.0.
namespace penumbra {

/// What a model file holds, in its own units.
struct Model {
  std::vector<MaterialDescription> materials;  ///< never empty where there are shapes
  std::vector<ShapeDescription> shapes;        ///< material: index into `materials`; names unique
  std::vector<PointLightDescription> point_lights;
  std::vector<SpotLightDescription> spot_lights;
  std::vector<DirectionalLightDescription> directional_lights;
  std::optional<CameraDescription> camera;     ///< the first one of the file
  std::vector<std::string> warnings;           ///< what was left out, and why
  std::vector<std::string> material_warnings;  ///< the same of materials alone
};

/// How faces are taken.
enum class ModelFaces : std::uint8_t {
  Triangles,    ///< polygons are cut into triangles
  Subdivision,  ///< polygons stay: each mesh becomes a SubdivisionShape
};

/// Reads a model; the format follows from the file's extension (.obj, .ply, .gltf, .glb).
/// @throws InputError naming the file, the place, what was found and what is allowed
Model load_model(const std::filesystem::path& file, ModelFaces faces = ModelFaces::Triangles);

/// Opens the module of the importers, as `load_model` does by itself.
void open_model_importers();

/// Whether a file's extension is one that `load_model` reads.
bool is_model_file(const std::filesystem::path& file);

}  // namespace penumbra
