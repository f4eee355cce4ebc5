#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "scenes/core/located_json.h"
#include "scenes/core/scene_description.h"

/// The image files that a scene file names; a part of scene_file.cpp. Every `value` obeys the
/// schema. Paths are relative to the scene file's folder.
namespace penumbra {

/// Reads the textures and the mask of a material, of which only the bytes are looked at.
/// @param pointer  JSON pointer of the material
/// @param faults   files that can not be read
void read_material_images(const nlohmann::json& value, const LocatedJson& document,
                          const std::string& pointer, MaterialDescription& material,
                          DiagnosticList& faults);

/// Reads the optional texture coordinates of a triangle mesh.
/// @param pointer  JSON pointer of the shape
/// @param faults   another number of them than of vertices
void read_uvs(const nlohmann::json& value, const LocatedJson& document, const std::string& pointer,
              TriangleMeshShape& mesh, DiagnosticList& faults);

/// Opens the environment's image and reads it with its scale and rotation.
/// @param faults    an image that can not be read, or that the scale makes too bright
/// @param warnings  a channel that is not used
void read_environment_image(const nlohmann::json& value, const LocatedJson& document,
                            EnvironmentDescription& environment, DiagnosticList& faults,
                            std::vector<std::string>& warnings);

}  // namespace penumbra
