#pragma once

#include <map>
#include <optional>
#include <vector>

#include "scenes/core/models/gltf_document.h"

namespace penumbra {

/// The materials of a glTF file. One enters the model when a mesh uses it.
class GltfMaterials {
 public:
  GltfMaterials(const GltfDocument& document, ModelBuilder& builder)
      : document_(document), builder_(builder) {}

  /// @param material  of a primitive; -1: glTF's default
  /// @return index into the model's materials
  std::uint32_t use(int material);

  /// Of a shape with this material.
  const std::optional<EmissionDescription>& emission(std::uint32_t material) const {
    return emissions_[material];
  }

 private:
  MaterialDescription convert(int index, std::optional<EmissionDescription>& emission);
  void set_mask(const tinygltf::Material& material, const std::string& place,
                MaterialDescription& result);
  std::optional<EmissionDescription> read_emission(const tinygltf::Material& material,
                                                   const std::string& place);
  void warn_unsupported(const tinygltf::Material& material, const std::string& place);
  std::optional<TextureDescription> texture(const tinygltf::TextureInfo& info,
                                            const std::string& place, const char* use);
  float factor(double value, const std::string& place, const char* name) const;

  const GltfDocument& document_;
  ModelBuilder& builder_;
  std::map<int, std::uint32_t> used_;
  UniqueNames names_;
  std::vector<std::optional<EmissionDescription>> emissions_;  ///< [material of the model]
};

}  // namespace penumbra
