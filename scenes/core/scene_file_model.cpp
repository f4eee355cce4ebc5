#include "scenes/core/scene_file_model.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "scenes/core/error.h"
#include "scenes/core/generated/generated.h"
#include "scenes/core/mesh_placement.h"
#include "scenes/core/models/model_file.h"

namespace penumbra {

using nlohmann::json;

namespace {

/// As the schema has it for the coordinates of a scene file.
constexpr double kMaxCoordinate = 1e30;

/// Quadrilaterals that a subdivision surface is cut into; more would fill the memory.
constexpr std::size_t kMaxPieces = std::size_t{1} << 26;

/// Shapes of type "model" consist of meshes and cages.
bool lies_within_bounds(const Shape& shape) {
  const auto* mesh = std::get_if<TriangleMeshShape>(&shape);
  const std::vector<Vec3d>& vertices =
      mesh != nullptr ? mesh->vertices : std::get<SubdivisionShape>(shape).vertices;
  return std::all_of(vertices.begin(), vertices.end(), [](const Vec3d& v) {
    return std::abs(v.x) <= kMaxCoordinate && std::abs(v.y) <= kMaxCoordinate &&
           std::abs(v.z) <= kMaxCoordinate;
  });
}

std::filesystem::path models_folder() {
  const char* folder = std::getenv(kModelsVariable);
  return folder != nullptr ? folder : "";
}

/// Reads one shape of type "model".
class ModelReader {
 public:
  ModelReader(const json& value, const ShapePlace& place, DiagnosticList& faults,
              std::vector<std::string>& warnings)
      : value_(value), place_(place), faults_(faults), warnings_(warnings) {}

  std::optional<ModelShape> read() {
    if (!keys_fit()) return std::nullopt;
    ModelShape model;
    ModelPlacement placement;
    std::filesystem::path file;
    std::string file_key = "file";
    if (has("file")) {
      file = std::filesystem::path(place_.document.source()).parent_path() /
             value_["file"].get<std::string>();
    } else if (has("instead") && !models_folder().empty()) {
      file_key = "instead";
      model.source = ModelSource::RealModel;
      file = real_model(placement);
      if (!sound_) return std::nullopt;
    } else {
      model.source = ModelSource::Generated;
    }
    read_placement(placement);
    if (model.source == ModelSource::Generated) {
      model.shape = generate();
    } else if (has("subdivide")) {
      model.shape = load<SubdivisionShape>(file, file_key);
    } else {
      model.shape = load<TriangleMeshShape>(file, file_key);
    }
    if (sound_) finish(model.shape, placement);
    return sound_ ? std::optional(std::move(model)) : std::nullopt;
  }

 private:
  bool has(const char* key) const { return value_.contains(key); }

  void fault(const std::string& key, std::string message) {
    const std::string pointer = key.empty() ? place_.pointer : child_pointer(place_.pointer, key);
    faults_.add(place_.document.value_at(pointer), pointer, std::move(message));
    sound_ = false;
  }

  bool keys_fit() {
    if (has("generate") == has("file")) {
      fault("", std::string("expected either \"generate\" or \"file\", found ") +
                    (has("file") ? "both" : "neither"));
    }
    const auto needs = [&](const char* key, const char* other, const char* why) {
      if (has(key) && !has(other)) fault(key, why);
    };
    needs("detail", "generate", "is of generated geometry; there is no \"generate\"");
    needs("instead", "generate", "stands in for generated geometry; there is no \"generate\"");
    for (const char* key : {"subdivide", "smooth"}) {
      if (has(key) && !has("file") && !has("instead")) {
        fault(key, "is of geometry from a file; there is no \"file\" and no \"instead\"");
      }
    }
    if (has("subdivide") && has("emission")) {
      fault("emission", "a subdivision surface cannot be a light; allowed without \"subdivide\"");
    }
    if (has("subdivide") && has("smooth")) {
      fault("smooth", "a subdivision surface is smooth; allowed without \"subdivide\"");
    }
    if (has("place") && value_["place"].contains("height") && value_["place"].contains("scale")) {
      fault("place", "expected \"height\" or \"scale\", found both");
    }
    return sound_;
  }

  std::filesystem::path real_model(ModelPlacement& placement) {
    const json& instead = value_["instead"];
    const std::string name = (instead.is_object() ? instead["file"] : instead).get<std::string>();
    if (instead.is_object() && instead.contains("rotate_deg")) {
      placement.rotations_deg.push_back(read_vector(instead["rotate_deg"]));
    }
    std::filesystem::path file = models_folder() / name;
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) {
      fault("instead", std::string(kModelsVariable) + " is set to \"" + models_folder().string() +
                           "\", but there is no file \"" + name +
                           "\" in it; unset the variable to render generated geometry");
    }
    return file;
  }

  void read_placement(ModelPlacement& placement) const {
    if (!has("place")) return;
    const json& value = value_["place"];
    if (value.contains("rotate_deg")) {
      placement.rotations_deg.push_back(read_vector(value["rotate_deg"]));
    }
    if (value.contains("height")) placement.height = value["height"].get<double>();
    placement.scale = value.value("scale", 1.0);
    placement.position = value.contains("position") ? read_vector(value["position"]) : Vec3d(0.0);
  }

  TriangleMeshShape generate() const {
    const auto& name = value_["generate"].get_ref<const std::string&>();
    for (const Generator& generator : kGenerators) {
      if (generator.name == name) return generator.generate(value_.value("detail", 1.0));
    }
    PN_CHECK(false, "the schema lists the generators");
    return {};
  }

  template <typename Mesh>
  Mesh load(const std::filesystem::path& file, const std::string& key) {
    constexpr bool kIsCage = std::is_same_v<Mesh, SubdivisionShape>;
    Mesh mesh;
    try {
      Model model = load_model(file, kIsCage ? ModelFaces::Subdivision : ModelFaces::Triangles);
      for (const std::string& warning : model.warnings) {
        warnings_.push_back("shape \"" + place_.name + "\": " + file.filename().string() + ": " +
                            warning);
      }
      for (const ShapeDescription& part : model.shapes) {
        append_mesh(mesh, std::get<Mesh>(part.shape));
      }
    } catch (const InputError& error) {
      fault(key, error.what());
    }
    return mesh;
  }

  void finish(Shape& shape, const ModelPlacement& placement) {
    const bool placed = std::visit(
        [&](auto& mesh) {
          if constexpr (requires { place_mesh(mesh, placement); }) {
            return place_mesh(mesh, placement);
          } else {
            return false;
          }
        },
        shape);
    if (!placed) fault("place", "a height of the placed model is asked for, but the model is flat");
    if (placed && !lies_within_bounds(shape)) {
      fault("place", "the placed model reaches beyond 1e30");
    }
    if (auto* cage = std::get_if<SubdivisionShape>(&shape)) {
      cage->level = value_["subdivide"].get<int>();
      check_pieces(*cage);
    } else if (auto* mesh = std::get_if<TriangleMeshShape>(&shape)) {
      finish_normals(*mesh);
    }
  }

  void check_pieces(const SubdivisionShape& cage) {
    const auto level = static_cast<std::size_t>(cage.level);
    const std::size_t pieces = cage.face_sizes.size() * level * level;
    if (pieces <= kMaxPieces) return;
    fault("subdivide", std::to_string(cage.face_sizes.size()) + " faces of " +
                           std::to_string(level) + " x " + std::to_string(level) + " pieces are " +
                           std::to_string(pieces) + "; allowed: up to " +
                           std::to_string(kMaxPieces));
  }

  void finish_normals(TriangleMeshShape& mesh) {
    if (const std::size_t dropped = drop_unusable_normals(mesh); dropped > 0) {
      warnings_.push_back("shape \"" + place_.name + "\": " + std::to_string(dropped) +
                          " of its vertices have no usable normal; the faces' own are used there");
    }
    if (value_.value("smooth", false)) smooth_normals(mesh);
  }

  const json& value_;
  const ShapePlace& place_;
  DiagnosticList& faults_;
  std::vector<std::string>& warnings_;
  bool sound_{true};
};

}  // namespace

std::optional<ModelShape> read_model_shape(const json& value, const ShapePlace& place,
                                           DiagnosticList& faults,
                                           std::vector<std::string>& warnings) {
  return ModelReader(value, place, faults, warnings).read();
}

}  // namespace penumbra
