#include "scenes/core/models/gltf_materials.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "scenes/core/file_bytes.h"

namespace penumbra {
namespace {

/// Undoes %XX of a URI.
std::string decoded(const std::string& uri) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
  };
  std::string result;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0) {
      result += static_cast<char>(digit(uri[i + 1]) * 16 + digit(uri[i + 2]));
      i += 2;
    } else {
      result += uri[i];
    }
  }
  return result;
}

TextureWrap wrap_of(int mode) {
  switch (mode) {
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
      return TextureWrap::Clamp;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
      return TextureWrap::Mirror;
    default:
      return TextureWrap::Repeat;
  }
}

/// Whether an image can have an alpha channel; in glTF one without is opaque everywhere. glTF knows
/// JPEG and PNG.
bool may_have_alpha(const std::string& file) {
  const std::string bytes = read_bytes(file);
  if (bytes.starts_with("\xff\xd8")) return false;
  constexpr std::size_t kColorTypeOffset = 25;
  if (bytes.starts_with("\x89PNG") && bytes.size() > kColorTypeOffset) {
    constexpr int kAlphaBit = 4;
    const bool has_transparent_color =
        bytes.substr(0, bytes.find("IDAT")).find("tRNS") != std::string::npos;
    return (bytes[kColorTypeOffset] & kAlphaBit) != 0 || has_transparent_color;
  }
  return true;
}

}  // namespace

std::uint32_t GltfMaterials::use(int material) {
  const auto index = static_cast<std::uint32_t>(emissions_.size());
  const auto [found, added] = used_.try_emplace(material, index);
  if (!added) return found->second;
  std::optional<EmissionDescription> emission;
  MaterialDescription description{"default", MetallicRoughnessMaterial{}};
  if (material >= 0) description = convert(material, emission);
  // Names are told apart here, because a file may use one twice.
  description.name = names_.settle(description.name);
  builder_.model().materials.push_back(std::move(description));
  emissions_.push_back(emission);
  return index;
}

MaterialDescription GltfMaterials::convert(int index,
                                           std::optional<EmissionDescription>& emission) {
  const tinygltf::Material& material = document_.at(document_.model().materials, index, "material");
  const tinygltf::PbrMetallicRoughness& pbr = material.pbrMetallicRoughness;
  MaterialDescription result;
  result.name = material.name.empty() ? "material" + std::to_string(index) : material.name;
  const std::string place = "material \"" + result.name + "\"";
  if (pbr.baseColorFactor.size() != 4) {
    document_.fault(place + ": baseColorFactor needs 4 numbers, found " +
                    std::to_string(pbr.baseColorFactor.size()));
  }
  Rgb color;
  for (int c = 0; c < 3; ++c) {
    color[c] = factor(pbr.baseColorFactor[static_cast<std::size_t>(c)], place, "baseColorFactor");
  }
  const float metallic = factor(pbr.metallicFactor, place, "metallicFactor");
  const float roughness = factor(pbr.roughnessFactor, place, "roughnessFactor");
  result.reflectance_texture = texture(pbr.baseColorTexture, place, "baseColorTexture");
  if (result.reflectance_texture) result.reflectance_texture->srgb = true;
  result.roughness_texture =
      texture(pbr.metallicRoughnessTexture, place, "metallicRoughnessTexture");
  result.metallic_texture = result.roughness_texture;
  if (result.roughness_texture) {
    result.roughness_texture->channel = 1;
    result.metallic_texture->channel = 2;
  }
  if (metallic == 1.0f && roughness == 0.0f && !result.reflectance_texture &&
      !result.roughness_texture) {
    result.model = MirrorMaterial{color};
  } else {
    result.model = MetallicRoughnessMaterial{color, metallic, roughness};
  }
  set_mask(material, place, result);
  emission = read_emission(material, place);
  warn_unsupported(material, place);
  return result;
}

void GltfMaterials::set_mask(const tinygltf::Material& material, const std::string& place,
                             MaterialDescription& result) {
  if (material.alphaMode == "OPAQUE") return;
  if (material.alphaMode != "MASK") {
    document_.fault(place + ": alphaMode \"" + material.alphaMode +
                    "\" is not supported, expected OPAQUE or MASK");
  }
  const float alpha =
      factor(material.pbrMetallicRoughness.baseColorFactor[3], place, "baseColorFactor");
  const double cutoff = material.alphaCutoff;
  if (!(cutoff >= 0.0) || cutoff > static_cast<double>(alpha)) {
    document_.fault(place + ": an alphaCutoff of " + std::to_string(cutoff) +
                    " with a factor of alpha of " + std::to_string(alpha) +
                    " leaves nothing; expected 0 <= alphaCutoff <= factor");
  }
  if (!result.reflectance_texture || !may_have_alpha(result.reflectance_texture->file)) return;
  MaskDescription mask{*result.reflectance_texture, 0.0f};
  mask.texture.srgb = false;  // alpha is linear
  mask.texture.channel = 3;
  mask.cutoff = alpha > 0.0f ? static_cast<float>(cutoff / static_cast<double>(alpha)) : 0.0f;
  result.mask = mask;
}

std::optional<EmissionDescription> GltfMaterials::read_emission(const tinygltf::Material& material,
                                                                const std::string& place) {
  Rgb radiance(0.0f);
  if (material.emissiveFactor.size() == 3) {
    for (int c = 0; c < 3; ++c) {
      radiance[c] = static_cast<float>(material.emissiveFactor[static_cast<std::size_t>(c)]);
    }
  }
  if (const auto found = material.extensions.find("KHR_materials_emissive_strength");
      found != material.extensions.end() && found->second.Has("emissiveStrength")) {
    const tinygltf::Value& strength = found->second.Get("emissiveStrength");
    if (!strength.IsNumber()) document_.fault(place + ": emissiveStrength must be a number");
    radiance *= static_cast<float>(strength.GetNumberAsDouble());
  }
  for (int c = 0; c < 3; ++c) {
    if (!(radiance[c] >= 0.0f && radiance[c] <= 1e30f)) {
      document_.fault(place + ": emissiveFactor and emissiveStrength must be >= 0");
    }
  }
  if (is_black(radiance)) return std::nullopt;
  if (material.emissiveTexture.index >= 0) {
    // Left out, the light would be another one.
    document_.fault(place + ": emissiveTexture is not supported; give emissiveFactor alone");
  }
  return EmissionDescription{radiance, material.doubleSided};
}

void GltfMaterials::warn_unsupported(const tinygltf::Material& material, const std::string& place) {
  if (material.normalTexture.index >= 0) {
    builder_.warn_of_material(place + ": normalTexture is not supported and left out");
  }
  if (material.occlusionTexture.index >= 0) {
    builder_.warn_of_material(place + ": occlusionTexture is not supported and left out");
  }
}

std::optional<TextureDescription> GltfMaterials::texture(const tinygltf::TextureInfo& info,
                                                         const std::string& place,
                                                         const char* use) {
  if (info.index < 0) return std::nullopt;
  const tinygltf::Model& model = document_.model();
  const std::string user = place + ": " + use;
  if (info.texCoord != 0) {
    document_.fault(user + " uses TEXCOORD_" + std::to_string(info.texCoord) +
                    ", only TEXCOORD_0 is supported");
  }
  const tinygltf::Texture& texture = document_.at(model.textures, info.index, "texture");
  const tinygltf::Image& image = document_.at(model.images, texture.source, "image");
  if (image.uri.empty() || image.uri.starts_with("data:")) {
    document_.fault(user + ": image " + std::to_string(texture.source) +
                    " is embedded, which is not supported; store it in a file of its own");
  }
  TextureDescription result = builder_.texture(document_.file().parent_path() / decoded(image.uri),
                                               document_.file().string(), user);
  if (texture.sampler >= 0) {
    const tinygltf::Sampler& sampler = document_.at(model.samplers, texture.sampler, "sampler");
    result.wrap_u = wrap_of(sampler.wrapS);
    result.wrap_v = wrap_of(sampler.wrapT);
  }
  return result;
}

float GltfMaterials::factor(double value, const std::string& place, const char* name) const {
  if (!(value >= 0.0 && value <= 1.0)) {
    document_.fault(place + ": " + name + " must be in [0, 1], found " + std::to_string(value));
  }
  return static_cast<float>(value);
}

}  // namespace penumbra
