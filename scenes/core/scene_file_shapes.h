#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "scenes/core/located_json.h"
#include "scenes/core/scene_description.h"

/// The meshes of a scene file; a part of scene_file.cpp. Every `value` obeys the schema.
namespace penumbra {

/// What a message about a shape needs.
struct ShapePlace {
  const LocatedJson& document;
  std::string pointer;  ///< JSON pointer of the shape
  std::string name;
};

/// An array of three numbers.
Vec3d read_vector(const nlohmann::json& value);

/// An array of three numbers, or one for all three.
Rgb read_rgb(const nlohmann::json& value);

/// @param faults    indices out of range; a mesh of which nothing is left
/// @param warnings  how many triangles without area were left out
TriangleMeshShape read_triangles(const nlohmann::json& value, const ShapePlace& place,
                                 DiagnosticList& faults, std::vector<std::string>& warnings);

/// As `read_triangles`. A quad of which two corners coincide is a fault, unless it has no area: it
/// is a triangle, and leaving it out would leave a hole.
QuadMeshShape read_quads(const nlohmann::json& value, const ShapePlace& place,
                         DiagnosticList& faults, std::vector<std::string>& warnings);

/// The squares of one material of a checkerboard.
struct CheckerboardPart {
  std::uint32_t material{0};
  QuadMeshShape mesh;
};

/// One part per material, in the order in which the rows show them.
/// @param band_materials  the two materials of each element of "rows"
/// @param faults          edges that span no area; rows that no band or two bands cover
std::vector<CheckerboardPart> expand_checkerboard(
    const nlohmann::json& value, const ShapePlace& place,
    const std::vector<std::array<std::uint32_t, 2>>& band_materials, DiagnosticList& faults);

}  // namespace penumbra
