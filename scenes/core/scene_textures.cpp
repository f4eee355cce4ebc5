#include "scenes/core/scene_textures.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

// Beyond it a coordinate in float has lost the place within the texel of a large image.
constexpr float kMaxUv = 1e4f;

bool has_roughness(const MaterialDescription& material) {
  return std::holds_alternative<ConductorMaterial>(material.model) ||
         std::holds_alternative<MixtureMaterial>(material.model) ||
         std::holds_alternative<MetallicRoughnessMaterial>(material.model);
}

bool is_usable(const Vec2& uv) { return std::abs(uv.x) <= kMaxUv && std::abs(uv.y) <= kMaxUv; }

}  // namespace

bool has_images(const MaterialDescription& material) {
  return material.reflectance_texture || material.roughness_texture || material.metallic_texture ||
         material.mask;
}

std::optional<std::string> image_fault(const MaterialDescription& material) {
  if (material.roughness_texture && !has_roughness(material)) {
    return "its model has no roughness that a texture could change";
  }
  if (material.metallic_texture &&
      !std::holds_alternative<MetallicRoughnessMaterial>(material.model)) {
    return "its model has no metallic share that a texture could change";
  }
  return std::nullopt;
}

std::optional<std::string> image_fault(const ShapeDescription& shape,
                                       const MaterialDescription& material) {
  if (!has_images(material)) return std::nullopt;
  const std::string name = "material \"" + material.name + "\"";
  if (material.mask && shape.emission) {
    return name + " has a mask, but shape \"" + shape.name +
           "\" emits light: a light can not have holes";
  }
  if (std::holds_alternative<RectangleShape>(shape.shape)) return std::nullopt;
  const auto* const mesh = std::get_if<TriangleMeshShape>(&shape.shape);
  if (mesh == nullptr || mesh->uvs.empty()) {
    return name + " has images, but shape \"" + shape.name +
           "\" has no texture coordinates; rectangles and triangles with \"uvs\" have them";
  }
  if (!std::all_of(mesh->uvs.begin(), mesh->uvs.end(), is_usable)) {
    return name + " has images, but a texture coordinate of shape \"" + shape.name +
           "\" is not between -1e4 and 1e4";
  }
  return std::nullopt;
}

std::unique_ptr<SceneTextures> SceneTextures::make(const SceneDescription& scene,
                                                   const std::vector<SurfaceGeometry>& geometries,
                                                   bool keep_all) {
  std::vector<bool> used(scene.materials.size(), false);
  bool any = false;
  for (const ShapeDescription& shape : scene.shapes) {
    PN_CHECK(shape.material < scene.materials.size(), "a shape's material exists");
    const MaterialDescription& material = scene.materials[shape.material];
    if (!has_images(material)) continue;
    if (const auto fault = image_fault(shape, material)) {
      throw InputError("scene \"" + scene.name + "\": " + *fault);
    }
    used[shape.material] = any = true;
  }
  if (!any && !keep_all) return nullptr;
  std::unique_ptr<SceneTextures> result(
      new SceneTextures(image_module().make_textures(), geometries));
  result->keep_all_ = keep_all;
  result->maps_.resize(scene.materials.size());
  for (std::size_t m = 0; m < used.size(); ++m) {
    if (!used[m]) continue;
    if (const auto fault = image_fault(scene.materials[m])) {
      throw InputError("material \"" + scene.materials[m].name + "\": " + *fault);
    }
    result->add(scene.materials[m], result->maps_[m]);
  }
  return result;
}

void SceneTextures::add(const MaterialDescription& material, Maps& maps) {
  const auto enter = [&](const std::optional<TextureDescription>& texture) -> Texture {
    if (!texture) return std::nullopt;
    ++count_;
    return textures_->add(*texture);
  };
  maps.reflectance = enter(material.reflectance_texture);
  maps.roughness = enter(material.roughness_texture);
  maps.metallic = enter(material.metallic_texture);
  has_values_ = has_values_ || maps.has_values();
  if (material.mask) {
    maps.mask = enter(material.mask->texture);
    maps.cutoff = material.mask->cutoff;
  }
}

SurfaceValues SceneTextures::values(std::uint32_t material, const Vec2& uv) const noexcept {
  const Maps& maps = maps_[material];
  SurfaceValues values;
  if (maps.reflectance) values.reflectance = textures_->color(*maps.reflectance, uv);
  if (maps.roughness) values.roughness = textures_->scalar(*maps.roughness, uv);
  if (maps.metallic) values.metallic = textures_->scalar(*maps.metallic, uv);
  return values;
}

bool SceneTextures::exists(std::uint32_t geometry, std::uint32_t primitive, float u,
                           float v) const noexcept {
  const SurfaceGeometry& surface = (*geometries_)[geometry];
  if (!has_mask(surface.material)) return true;
  RayHit hit;
  hit.primitive = primitive;
  hit.u = u;
  hit.v = v;
  const Maps& maps = maps_[surface.material];
  return textures_->scalar(*maps.mask, uv_at(surface, hit)) >= maps.cutoff;
}

}  // namespace penumbra
