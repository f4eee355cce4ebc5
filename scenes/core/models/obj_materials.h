#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "scenes/core/models/mesh_tools.h"
#include "scenes/core/models/statement_lines.h"
#include "scenes/core/models/tiny_obj.h"

namespace penumbra {

/// The material libraries of an OBJ file. A material enters the model when a shape uses it.
class ObjMaterials {
 public:
  explicit ObjMaterials(ModelBuilder& builder) : builder_(builder) {}

  /// Reads the files of a statement "mtllib"; one that is missing is a warning.
  void add_libraries(std::string_view names, int line);

  /// @param name  as in "usemtl"; empty before the first one
  /// @return index into the model's materials
  std::uint32_t use(const std::string& name);

  /// Of a shape with this material.
  const std::optional<EmissionDescription>& emission(std::uint32_t material) const {
    return emissions_[material];
  }

 private:
  struct Entry {
    tinyobj::material_t values;
    std::map<std::string, std::string> statements;  ///< keyword -> the rest, where it was given
    std::filesystem::path library;
    int line{0};  ///< of "newmtl"
  };

  void read_library(const std::filesystem::path& library);
  void check_statement(const StatementLines& lines, std::string_view rest, Entry*& entry);
  void warn_unsupported(const Entry& entry);
  MaterialDescription convert(const Entry& entry, std::optional<EmissionDescription>& emission);
  void set_reflection(const Entry& entry, MaterialDescription& material);
  PhongMaterial phong(const Entry& entry, Rgb diffuse, Rgb specular);
  void set_textures(const Entry& entry, MaterialDescription& material);
  TextureDescription texture(const Entry& entry, const std::string& name,
                             const tinyobj::texture_option_t& options, const char* keyword);
  /// Three numbers of a statement. @throws InputError when one is negative
  Rgb color(const Entry& entry, const tinyobj::real_t (&values)[3], const char* keyword) const;
  /// A number in [0, 1] of a statement, or `missing` where it was not given.
  float share(const Entry& entry, double value, const char* keyword, float missing) const;

  ModelBuilder& builder_;
  std::set<std::filesystem::path> libraries_;  ///< read so far
  std::map<std::string, Entry> entries_;
  std::map<std::string, std::uint32_t> used_;
  std::vector<std::optional<EmissionDescription>> emissions_;  ///< [material of the model]
};

}  // namespace penumbra
