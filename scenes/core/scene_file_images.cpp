#include "scenes/core/scene_file_images.h"

#include <nlohmann/json.hpp>
#include <sstream>

#include "scenes/core/error.h"
#include "scenes/core/file_bytes.h"
#include "scenes/core/images/image_module.h"

namespace penumbra {

using nlohmann::json;

namespace {

constexpr float kMaxRadiance = 1e30f;  // as the schema has it for radiances

std::filesystem::path resolve(const LocatedJson& document, const json& file) {
  const std::filesystem::path folder = std::filesystem::path(document.source()).parent_path();
  return std::filesystem::absolute(folder / file.get<std::string>()).lexically_normal();
}

TextureWrap wrap_of(const std::string& name) {
  if (name == "clamp") return TextureWrap::Clamp;
  return name == "mirror" ? TextureWrap::Mirror : TextureWrap::Repeat;
}

TextureDescription read_texture(const json& value, const LocatedJson& document,
                                const std::string& pointer, DiagnosticList& faults) {
  TextureDescription texture;
  const std::filesystem::path file = resolve(document, value["file"]);
  texture.file = file.string();
  texture.srgb = value.value("srgb", false);
  texture.channel = value.value("channel", 0);
  if (const auto wrap = value.find("wrap"); wrap != value.end()) {
    texture.wrap_u = wrap_of((wrap->is_array() ? (*wrap)[0] : *wrap).get<std::string>());
    texture.wrap_v = wrap_of((wrap->is_array() ? (*wrap)[1] : *wrap).get<std::string>());
  }
  const std::string place = child_pointer(pointer, "file");
  try {
    texture.content_hash = hash_file(file);
  } catch (const InputError& error) {
    faults.add(document.value_at(place), place, error.what());
  }
  return texture;
}

}  // namespace

void read_material_images(const json& value, const LocatedJson& document,
                          const std::string& pointer, MaterialDescription& material,
                          DiagnosticList& faults) {
  const auto read = [&](const char* key) -> std::optional<TextureDescription> {
    const auto found = value.find(key);
    if (found == value.end()) return std::nullopt;
    return read_texture(*found, document, child_pointer(pointer, key), faults);
  };
  material.reflectance_texture = read("reflectance_texture");
  material.roughness_texture = read("roughness_texture");
  material.metallic_texture = read("metallic_texture");
  if (auto mask = read("mask")) {
    material.mask = MaskDescription{std::move(*mask), value["mask"].value("cutoff", 0.5f)};
  }
}

void read_uvs(const json& value, const LocatedJson& document, const std::string& pointer,
              TriangleMeshShape& mesh, DiagnosticList& faults) {
  const auto uvs = value.find("uvs");
  if (uvs == value.end()) return;
  if (uvs->size() != mesh.vertices.size()) {
    const std::string place = child_pointer(pointer, "uvs");
    faults.add(document.value_at(place), place,
               "expected one per vertex, " + std::to_string(mesh.vertices.size()) + ", found " +
                   std::to_string(uvs->size()));
    return;
  }
  mesh.uvs.reserve(uvs->size());
  for (const json& uv : *uvs) mesh.uvs.emplace_back(uv[0].get<float>(), uv[1].get<float>());
}

void read_environment_image(const json& value, const LocatedJson& document,
                            EnvironmentDescription& environment, DiagnosticList& faults,
                            std::vector<std::string>& warnings) {
  const auto fault = [&](const std::string& pointer, const std::string& message) {
    faults.add(document.value_at(pointer), pointer, message);
  };
  const std::filesystem::path file = resolve(document, value["image"]);
  ImageData image;
  try {
    image = image_module().read(file);
  } catch (const InputError& error) {
    return fault("/environment/image", error.what());
  }
  const auto channels = static_cast<std::size_t>(image.channels);
  if (channels % 2 == 0) {
    warnings.push_back("environment \"" + environment.name + "\": the alpha channel of " +
                       file.string() + " is not used");
  }
  const auto scale = value.value("scale", 1.0f);
  environment.rotation_deg = value.value("rotation_deg", 0.0);
  environment.columns = static_cast<std::uint32_t>(image.width);
  environment.rows = static_cast<std::uint32_t>(image.height);
  environment.texels.reserve(image.values.size() / channels);
  for (std::size_t i = 0; i < image.values.size(); i += channels) {
    const float* const texel = &image.values[i];
    const Rgb radiance = (channels < 3 ? Rgb(texel[0]) : Rgb(texel[0], texel[1], texel[2])) * scale;
    if (!(std::max({radiance.x, radiance.y, radiance.z}) <= kMaxRadiance)) {
      const std::size_t place = environment.texels.size();
      std::ostringstream text;
      text << file.string() << ": texel (column " << place % environment.columns << ", row "
           << place / environment.columns << " from the upper left) times " << scale << " is "
           << radiance << "; allowed: up to " << kMaxRadiance;
      return fault("/environment/image", text.str());
    }
    environment.texels.push_back(radiance);
  }
}

}  // namespace penumbra
