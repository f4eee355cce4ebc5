#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scenes/core/images/image_module.h"
#include "scenes/core/ray_batch.h"
#include "scenes/core/scene_description.h"
#include "scenes/core/surface_geometry.h"
#include "scenes/core/surface_values.h"

namespace penumbra {

/// The images on a scene's surfaces: values at shading points, and holes for the ray tracer.
class SceneTextures final : public HitFilter {
 public:
  /// Opens the images of the materials that shapes use.
  /// @param geometries  of the scene, which come later; must outlive the result
  /// @param keep_all    also where there are no images, with filters that keep every hit
  /// @return nullptr where there are no images: nothing is opened then
  /// @throws InputError naming an image that can not be read, or a shape and material that do not
  ///         fit together
  static std::unique_ptr<SceneTextures> make(const SceneDescription& scene,
                                             const std::vector<SurfaceGeometry>& geometries,
                                             bool keep_all);

  /// Whether hits on shapes of the material have to be asked for.
  bool filters(std::uint32_t material) const noexcept { return keep_all_ || has_mask(material); }
  bool has_mask(std::uint32_t material) const noexcept { return maps_[material].mask.has_value(); }
  /// Whether shapes of the material need texture coordinates.
  bool uses_uvs(std::uint32_t material) const noexcept {
    return maps_[material].has_values() || has_mask(material);
  }
  /// Whether any material has a texture beside a mask.
  bool has_values() const noexcept { return keep_all_ || has_values_; }
  /// Textures of all materials in use, masks among them.
  std::size_t count() const noexcept { return count_; }
  std::size_t memory_bytes() const noexcept { return textures_->memory_bytes(); }

  SurfaceValues values(std::uint32_t material, const Vec2& uv) const noexcept;

  /// Whether the mask of the geometry's material leaves the surface there.
  bool exists(std::uint32_t geometry, std::uint32_t primitive, float u,
              float v) const noexcept override;

 private:
  using Texture = std::optional<std::uint32_t>;  // index in the set
  struct Maps {
    Texture reflectance, roughness, metallic, mask;
    float cutoff{0.5f};

    bool has_values() const noexcept { return reflectance || roughness || metallic; }
  };

  SceneTextures(std::unique_ptr<TextureSet> textures,
                const std::vector<SurfaceGeometry>& geometries)
      : textures_(std::move(textures)), geometries_(&geometries) {}
  void add(const MaterialDescription& material, Maps& maps);

  std::unique_ptr<TextureSet> textures_;
  const std::vector<SurfaceGeometry>* geometries_;
  std::vector<Maps> maps_;  // [material]
  bool has_values_{false};
  bool keep_all_{false};
  std::size_t count_{0};
};

/// Whether a material has an image.
bool has_images(const MaterialDescription& material);

/// Why a material's images make no sense: a texture for a parameter that its model does not have.
/// @return nullopt where they are in order
std::optional<std::string> image_fault(const MaterialDescription& material);

/// Why a shape can not have a material's images: it has no texture coordinates, or it would be a
/// light with holes that its sampling does not know.
/// @return nullopt where they go together
std::optional<std::string> image_fault(const ShapeDescription& shape,
                                       const MaterialDescription& material);

}  // namespace penumbra
