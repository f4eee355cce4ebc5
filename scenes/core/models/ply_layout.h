#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// The structure of a PLY file, walked through before assimp reads it: assimp takes a truncated
/// file for a smaller mesh and writes where an index points.
namespace penumbra {

enum class PlyFormat : std::uint8_t { Ascii, LittleEndian, BigEndian };

/// Numbers of a property.
struct PlyType {
  std::uint32_t bytes{4};
  bool is_float{false}, is_signed{false};
};

struct PlyProperty {
  std::string name;
  PlyType type;
  bool is_list{false};
  PlyType count_type{};  ///< of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count{0};
  std::vector<PlyProperty> properties;

  const PlyProperty* find(std::string_view property) const;
};

struct PlyLayout {
  PlyFormat format{PlyFormat::Ascii};
  std::vector<PlyElement> elements;
  std::uint64_t corners{0};  ///< of all faces together

  const PlyElement* find(std::string_view element) const;
};

/// Reads the header and checks that the body holds what it promises and that corners of faces are
/// vertices.
/// @throws InputError naming the line, or element and place in the body
PlyLayout check_ply(const std::filesystem::path& file, std::string_view bytes);

/// Name of the list of corners in a face: "vertex_indices" or "vertex_index".
bool is_corner_list(const PlyProperty& property);

}  // namespace penumbra
