#include "scenes/core/scene_file.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "scenes/core/error.h"
#include "scenes/core/json_schema.h"
#include "scenes/core/models/model_scene.h"
#include "scenes/core/scene_file_images.h"
#include "scenes/core/scene_file_lights.h"
#include "scenes/core/scene_file_materials.h"
#include "scenes/core/scene_file_model.h"
#include "scenes/core/scene_file_shapes.h"
#include "scenes/core/scene_schema.h"
#include "scenes/core/scene_textures.h"
#include "scenes/core/suggest.h"

namespace penumbra {

using nlohmann::json;

namespace {

/// Largest |cosine| of edges that count as perpendicular, and smallest sine of directions that
/// count as different.
constexpr double kAngleTolerance = 1e-6;

void check_schema(const LocatedJson& document, DiagnosticList& faults) {
  static const JsonSchema schema(kSceneSchemaJson);
  schema.validate(document, faults);
}

/// One pass over a document. A part with a fault of the schema is passed over, the others are still
/// checked, so that one run reports all it can.
class SceneReader {
 public:
  explicit SceneReader(const LocatedJson& document) : document_(document), root_(document.root()) {}

  SceneDescription read() {
    check_schema(document_, faults_);
    if (root_.is_object()) {
      if (sound("/name")) scene_.name = root_["name"].get<std::string>();
      if (sound("/summary")) scene_.summary = root_["summary"].get<std::string>();
      if (sound("/camera")) read_camera(root_["camera"]);
      read_materials();
      read_shapes();
      read_delta_lights();
      if (sound("/environment")) read_environment(root_["environment"]);
      read_includes();
    }
    faults_.throw_if_any();
    return std::move(scene_);
  }

 private:
  /// Whether a top-level part exists and obeys the schema.
  bool sound(const std::string& pointer) const {
    return root_.contains(json::json_pointer(pointer)) && !faults_.covers(pointer);
  }

  void fault(const std::string& pointer, std::string message) {
    faults_.add(document_.value_at(pointer), pointer, std::move(message));
  }

  void read_camera(const json& value) {
    CameraDescription& camera = scene_.camera;
    camera.position = read_vector(value["position"]);
    camera.look_at = read_vector(value["look_at"]);
    if (value.contains("up")) camera.up = read_vector(value["up"]);
    camera.vertical_fov_deg = value.value("vertical_fov_deg", camera.vertical_fov_deg);
    camera.resolution = value.value("resolution", camera.resolution);
    const Vec3d view = camera.look_at - camera.position;
    if (view.length() == 0.0) {
      fault("/camera/look_at", "must differ from position");
    } else if (camera.up.length() == 0.0) {
      fault("/camera/up", "must not be the zero vector");
    } else if (view.normalized().cross(camera.up.normalized()).length() < kAngleTolerance) {
      fault("/camera/up", "must not be parallel to the view direction, look_at - position");
    }
  }

  void read_materials() {
    const auto materials = root_.find("materials");
    if (materials == root_.end() || !materials->is_object()) return;
    for (const auto& [name, value] : materials->items()) {
      // The name is known even where its definition is at fault: shapes may refer to it.
      material_names_.push_back(name);
      MaterialDescription material;
      material.name = name;
      const std::string pointer = child_pointer("/materials", name);
      if (!faults_.covers(pointer)) read_material(value, document_, pointer, material, faults_);
      scene_.materials.push_back(std::move(material));
    }
  }

  std::optional<std::uint32_t> find_material(const json& value, const std::string& pointer) {
    const auto& name = value.get_ref<const std::string&>();
    const auto found = std::find(material_names_.begin(), material_names_.end(), name);
    if (found != material_names_.end()) {
      return static_cast<std::uint32_t>(found - material_names_.begin());
    }
    fault(pointer, unknown_name("material", name, material_names_));
    return std::nullopt;
  }

  void read_shapes() {
    const auto shapes = root_.find("shapes");
    if (shapes == root_.end() || !shapes->is_array()) return;
    for (std::size_t i = 0; i < shapes->size(); ++i) {
      const std::string pointer = child_pointer("/shapes", i);
      if (faults_.covers(pointer)) continue;
      const json& value = (*shapes)[i];
      if (value["type"] == "checkerboard") {
        read_checkerboard(value, pointer);
      } else {
        read_shape(value, pointer);
      }
    }
  }

  void read_shape(const json& value, const std::string& pointer) {
    ShapeDescription shape;
    shape.name = value["name"].get<std::string>();
    shape.material =
        find_material(value["material"], child_pointer(pointer, "material")).value_or(0);
    const std::string type = value["type"].get<std::string>();
    if (type == "rectangle") {
      shape.shape = read_rectangle(value, pointer);
    } else if (type == "sphere") {
      shape.shape = SphereShape{read_vector(value["center"]), value["radius"].get<double>()};
    } else if (type == "triangles") {
      TriangleMeshShape mesh =
          read_triangles(value, {document_, pointer, shape.name}, faults_, scene_.warnings);
      read_uvs(value, document_, pointer, mesh, faults_);
      shape.shape = std::move(mesh);
    } else if (type == "model") {
      if (!read_model(value, pointer, shape)) return;
    } else {
      shape.shape = read_quads(value, {document_, pointer, shape.name}, faults_, scene_.warnings);
    }
    if (value.contains("emission")) read_emission(value["emission"], shape);
    add_shape(std::move(shape), pointer);
  }

  bool read_model(const json& value, const std::string& pointer, ShapeDescription& shape) {
    std::optional<ModelShape> model =
        read_model_shape(value, {document_, pointer, shape.name}, faults_, scene_.warnings);
    if (!model) return false;
    shape.shape = std::move(model->shape);
    if (model->source == ModelSource::RealModel) scene_.geometry = "models";
    if (model->source == ModelSource::Generated && scene_.geometry == "own") {
      scene_.geometry = "generated";
    }
    return true;
  }

  RectangleShape read_rectangle(const json& value, const std::string& pointer) {
    const RectangleShape shape{read_vector(value["origin"]), read_vector(value["edge_u"]),
                               read_vector(value["edge_v"])};
    const double cosine = shape.edge_u.normalized().dot(shape.edge_v.normalized());
    if (shape.edge_u.length() == 0.0) {
      fault(child_pointer(pointer, "edge_u"), "must not be the zero vector");
    } else if (shape.edge_v.length() == 0.0) {
      fault(child_pointer(pointer, "edge_v"), "must not be the zero vector");
    } else if (std::abs(cosine) >= kAngleTolerance) {
      fault(child_pointer(pointer, "edge_v"),
            "must be perpendicular to edge_u; the cosine between them is " + json(cosine).dump());
    }
    return shape;
  }

  void read_emission(const json& value, ShapeDescription& shape) {
    const EmissionDescription emission{read_rgb(value["radiance"]),
                                       value.value("two_sided", false)};
    if (is_black(emission.radiance)) {
      scene_.warnings.push_back("shape \"" + shape.name +
                                "\" has an emission of zero and is not a light");
    } else {
      shape.emission = emission;
    }
  }

  void read_checkerboard(const json& value, const std::string& pointer) {
    std::vector<std::array<std::uint32_t, 2>> band_materials;
    bool materials_known = true;
    for (std::size_t b = 0; b < value["rows"].size(); ++b) {
      const std::string place =
          child_pointer(child_pointer(child_pointer(pointer, "rows"), b), "materials");
      const json& names = value["rows"][b]["materials"];
      const auto first = find_material(names[0], child_pointer(place, std::size_t{0}));
      const auto second = find_material(names[1], child_pointer(place, std::size_t{1}));
      materials_known = materials_known && first && second;
      band_materials.push_back({first.value_or(0), second.value_or(0)});
    }
    const std::string name = value["name"].get<std::string>();
    std::vector<CheckerboardPart> parts =
        expand_checkerboard(value, {document_, pointer, name}, band_materials, faults_);
    if (!materials_known) return;  // the parts are named after their materials
    for (CheckerboardPart& part : parts) {
      add_shape(
          {name + "." + material_names_[part.material], part.material, std::move(part.mesh), {}},
          pointer);
    }
  }

  void add_shape(ShapeDescription shape, const std::string& pointer) {
    if (!names_.insert(shape.name).second) {
      fault(child_pointer(pointer, "name"), "shape name \"" + shape.name + "\" is used twice");
    }
    if (shape.material < scene_.materials.size() && !faults_.covers(pointer)) {
      if (const auto why = image_fault(shape, scene_.materials[shape.material])) {
        fault(child_pointer(pointer, "material"), *why);
      }
    }
    scene_.shapes.push_back(std::move(shape));
  }

  void read_delta_lights() {
    for_each_light("point_lights", [&](const json& value, const LightPlace& place) {
      PointLightDescription light = read_point_light(value);
      const bool lit = light.intensity != Vec3d(0.0);
      if (is_kept("point light", light.name, lit, "intensity", place)) {
        scene_.point_lights.push_back(std::move(light));
      }
    });
    for_each_light("spot_lights", [&](const json& value, const LightPlace& place) {
      SpotLightDescription light = read_spot_light(value, place, faults_);
      const bool lit = light.intensity != Vec3d(0.0);
      if (is_kept("spot light", light.name, lit, "intensity", place)) {
        scene_.spot_lights.push_back(std::move(light));
      }
    });
    for_each_light("directional_lights", [&](const json& value, const LightPlace& place) {
      DirectionalLightDescription light = read_directional_light(value, place, faults_);
      const bool lit = !is_black(light.irradiance);
      if (is_kept("directional light", light.name, lit, "irradiance", place)) {
        scene_.directional_lights.push_back(std::move(light));
      }
    });
  }

  template <typename Read>
  void for_each_light(const char* key, Read read) {
    const auto lights = root_.find(key);
    if (lights == root_.end() || !lights->is_array()) return;
    for (std::size_t i = 0; i < lights->size(); ++i) {
      const std::string pointer = child_pointer(std::string("/") + key, i);
      if (!faults_.covers(pointer)) read((*lights)[i], LightPlace{document_, pointer});
    }
  }

  /// Takes the light's name; warns of a light of zero, which is left out.
  bool is_kept(const std::string& kind, const std::string& name, bool lit, const char* quantity,
               const LightPlace& place) {
    add_light_name(name, child_pointer(place.pointer, "name"));
    if (lit) return true;
    scene_.warnings.push_back(kind + " \"" + name + "\" has an " + quantity +
                              " of zero and is not a light");
    return false;
  }

  void read_environment(const json& value) {
    EnvironmentDescription environment;
    environment.name = value.value("name", environment.name);
    add_light_name(environment.name, value.contains("name") ? "/environment/name" : "/environment");
    if (!has_one_source(value)) return;
    if (value.contains("grid")) {
      read_grid(value["grid"], environment);
    } else if (value.contains("image")) {
      read_environment_image(value, document_, environment, faults_, scene_.warnings);
      if (environment.texels.empty()) return;
    } else {
      environment.texels.push_back(read_rgb(value["radiance"]));
    }
    if (std::all_of(environment.texels.begin(), environment.texels.end(), is_black)) {
      scene_.warnings.push_back("environment \"" + environment.name +
                                "\" has a radiance of zero and is not a light");
    } else {
      scene_.environment = std::move(environment);
    }
  }

  bool has_one_source(const json& value) {
    std::string found;
    for (const char* key : {"radiance", "grid", "image"}) {
      if (value.contains(key)) found += std::string(found.empty() ? "\"" : " and \"") + key + "\"";
    }
    const bool one = !found.empty() && found.find(" and ") == std::string::npos;
    if (!one) {
      fault("/environment", "expected one of \"radiance\", \"grid\" and \"image\", found " +
                                (found.empty() ? "none" : found));
    }
    for (const char* key : {"scale", "rotation_deg"}) {
      if (!value.contains(key) || value.contains("image")) continue;
      fault(child_pointer("/environment", key), "belongs to \"image\", which is not there");
      return false;
    }
    return one;
  }

  void read_grid(const json& rows, EnvironmentDescription& environment) {
    const std::size_t columns = rows[0].size();
    environment.rows = static_cast<std::uint32_t>(rows.size());
    environment.columns = static_cast<std::uint32_t>(columns);
    environment.texels.reserve(rows.size() * columns);
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (rows[r].size() != columns) {
        fault(child_pointer("/environment/grid", r), "expected " + std::to_string(columns) +
                                                         " texels like row 0, found " +
                                                         std::to_string(rows[r].size()));
      }
      for (const json& texel : rows[r]) environment.texels.push_back(read_rgb(texel));
    }
  }

  /// Last, because names of model files give way to those of the scene file.
  void read_includes() {
    const auto includes = root_.find("include");
    if (includes == root_.end()) {
      if (!root_.contains("materials")) fault("", "missing key \"materials\"");
      if (!root_.contains("shapes")) fault("", "missing key \"shapes\"");
      return;
    }
    if (!sound("/include")) return;
    for (std::size_t i = 0; i < includes->size(); ++i) {
      const std::string name = (*includes)[i]["file"].get<std::string>();
      const std::filesystem::path file =
          std::filesystem::path(document_.source()).parent_path() / name;
      try {
        Model model = load_model(file);
        for (auto* warnings : {&model.warnings, &model.material_warnings}) {
          for (std::string& warning : *warnings) warning.insert(0, name + ": ");
        }
        add_model(file.stem().string(), std::move(model), scene_);
      } catch (const InputError& error) {
        fault(child_pointer(child_pointer("/include", i), "file"), error.what());
      }
    }
  }

  void add_light_name(const std::string& name, const std::string& pointer) {
    if (names_.insert(name).second) return;
    fault(pointer,
          "light name \"" + name + "\" is used twice; no shape or light may have another's name");
  }

  const LocatedJson& document_;
  const json& root_;
  DiagnosticList faults_;
  SceneDescription scene_;
  std::vector<std::string> material_names_;  ///< same indices as scene_.materials
  std::set<std::string> names_;              ///< of shapes and lights
};

}  // namespace

SceneDescription load_scene_description(const std::filesystem::path& file) {
  if (is_model_file(file)) return scene_of_model(file);
  return parse_scene_description(LocatedJson::parse_file(file));
}

SceneDescription parse_scene_description(const LocatedJson& document) {
  return SceneReader(document).read();
}

}  // namespace penumbra
