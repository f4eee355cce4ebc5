#include "scenes/core/scene_file_materials.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "scenes/core/scene_file_images.h"
#include "scenes/core/scene_file_shapes.h"

namespace penumbra {

using nlohmann::json;

namespace {

LambertMaterial read_lambert(const json& value) { return {read_rgb(value["reflectance"])}; }

ConductorMaterial read_conductor(const json& value) {
  ConductorMaterial material;
  material.eta = read_rgb(value["eta"]);
  material.k = read_rgb(value["k"]);
  // The file's 1e-4 is the range's end in double and may round below it.
  material.alpha = std::max(value["alpha"].get<float>(), 1e-4f);
  if (value.contains("tint")) material.tint = read_rgb(value["tint"]);
  return material;
}

PhongMaterial read_phong(const json& value, const LocatedJson& document, const std::string& pointer,
                         DiagnosticList& faults) {
  const PhongMaterial phong{read_rgb(value["diffuse"]), read_rgb(value["specular"]),
                            value["exponent"].get<float>()};
  for (int c = 0; c < 3; ++c) {
    // Shares such as 0.3 + 0.7 may exceed 1 by the rounding of the sum.
    const float sum = phong.diffuse[c] + phong.specular[c];
    if (sum <= 1.0f + 1e-6f) continue;
    const std::string specular = child_pointer(pointer, "specular");
    faults.add(document.value_at(specular), specular,
               std::string("diffuse + specular must be at most 1, found ") + json(sum).dump() +
                   " in the " +
                   (c == 0   ? "red"
                    : c == 1 ? "green"
                             : "blue") +
                   " channel");
    break;
  }
  return phong;
}

}  // namespace

void read_material(const json& value, const LocatedJson& document, const std::string& pointer,
                   MaterialDescription& material, DiagnosticList& faults) {
  const std::string type = value["type"].get<std::string>();
  if (type == "lambert") {
    material.model = read_lambert(value);
  } else if (type == "conductor") {
    material.model = read_conductor(value);
  } else if (type == "mixture") {
    material.model =
        MixtureMaterial{read_lambert(value["diffuse"]), read_conductor(value["glossy"]),
                        value["glossy_weight"].get<float>()};
  } else if (type == "metallic_roughness") {
    material.model =
        MetallicRoughnessMaterial{read_rgb(value["base_color"]), value["metallic"].get<float>(),
                                  value["roughness"].get<float>()};
  } else if (type == "mirror") {
    material.model = MirrorMaterial{read_rgb(value["reflectance"])};
  } else {
    material.model = read_phong(value, document, pointer, faults);
  }
  read_material_images(value, document, pointer, material, faults);
}

}  // namespace penumbra
