#include "scenes/core/models/model_scene.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>
#include <utility>
#include <vector>

namespace penumbra {
namespace {

/// Names of one kind that are taken.
class Names {
 public:
  template <typename T>
  void take(const std::vector<T>& named) {
    for (const T& one : named) names_.insert(one.name);
  }
  void take(const std::string& name) { names_.insert(name); }

  /// Makes a name unique by a prefix, then by a number.
  void settle(const std::string& stem, std::string& name) {
    if (names_.insert(name).second) return;
    const std::string prefixed = stem + "." + name;
    name = prefixed;
    for (int i = 2; !names_.insert(name).second; ++i) name = prefixed + "." + std::to_string(i);
  }
  template <typename T>
  void settle(const std::string& stem, std::vector<T>& named) {
    for (T& one : named) settle(stem, one.name);
  }

 private:
  std::set<std::string> names_;
};

template <typename T>
void append(std::vector<T>&& from, std::vector<T>& to) {
  if (to.empty()) {
    to = std::move(from);
  } else {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  }
}

/// Models consist of meshes and cages.
const std::vector<Vec3d>& vertices_of(const Shape& shape) {
  if (const auto* cage = std::get_if<SubdivisionShape>(&shape)) return cage->vertices;
  return std::get<TriangleMeshShape>(shape).vertices;
}

/// Three-quarter view: from the front, the right and above, with +y up.
CameraDescription framing_camera(const SceneDescription& scene) {
  Vec3d low(std::numeric_limits<double>::infinity());
  Vec3d high = -low;
  for (const ShapeDescription& shape : scene.shapes) {
    for (const Vec3d& vertex : vertices_of(shape.shape)) {
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], vertex[axis]);
        high[axis] = std::max(high[axis], vertex[axis]);
      }
    }
  }
  CameraDescription camera;
  camera.look_at = (low + high) * 0.5;
  // As near as the corners of the box allow in width and height, with a margin.
  constexpr double kMargin = 1.05;
  const Vec3d back = Vec3d(0.6, 0.5, 1.0).normalized();
  const Vec3d right = camera.up.cross(back).normalized();
  const Vec3d up = back.cross(right);
  const double slope_y = std::tan(0.5 * camera.vertical_fov_deg * M_PI / 180.0) / kMargin;
  const double slope_x = slope_y * camera.resolution[0] / camera.resolution[1];
  double distance = 0.0;
  for (int k = 0; k < 8; ++k) {
    const Vec3d corner((k & 1) != 0 ? high.x : low.x, (k & 2) != 0 ? high.y : low.y,
                       (k & 4) != 0 ? high.z : low.z);
    const Vec3d d = corner - camera.look_at;
    const double aside = std::max(std::abs(d.dot(right)) / slope_x, std::abs(d.dot(up)) / slope_y);
    distance = std::max(distance, d.dot(back) + aside);
  }
  camera.position = camera.look_at + back * distance;
  return camera;
}

}  // namespace

SceneDescription scene_of_model(const std::filesystem::path& file) {
  Model model = load_model(file);
  SceneDescription scene;
  scene.name = file.stem().string();
  scene.summary = "the model file " + file.filename().string();
  const std::optional<CameraDescription> camera = model.camera;
  model.camera.reset();
  add_model(scene.name, std::move(model), scene);
  if (camera) {
    scene.camera = *camera;
  } else {
    scene.camera = framing_camera(scene);
    scene.warnings.push_back("no camera: the whole model is seen from the upper right");
  }
  if (!has_light(scene)) {
    Names names;
    names.take(scene.shapes);
    EnvironmentDescription environment;
    environment.texels = {Rgb(1.0f)};
    names.settle(scene.name, environment.name);
    scene.environment = std::move(environment);
    scene.warnings.push_back("no light: an environment of radiance 1 lights the model");
  }
  return scene;
}

void add_model(const std::string& stem, Model model, SceneDescription& scene) {
  Names materials;
  materials.take(scene.materials);
  materials.settle(stem, model.materials);
  // Shapes and lights share one set of names.
  Names names;
  names.take(scene.shapes);
  names.take(scene.point_lights);
  names.take(scene.spot_lights);
  names.take(scene.directional_lights);
  if (scene.environment) names.take(scene.environment->name);
  names.settle(stem, model.shapes);
  names.settle(stem, model.point_lights);
  names.settle(stem, model.spot_lights);
  names.settle(stem, model.directional_lights);

  const auto first_material = static_cast<std::uint32_t>(scene.materials.size());
  for (ShapeDescription& shape : model.shapes) shape.material += first_material;
  if (model.camera) model.warnings.push_back("its camera is left out");
  append(std::move(model.materials), scene.materials);
  append(std::move(model.shapes), scene.shapes);
  append(std::move(model.point_lights), scene.point_lights);
  append(std::move(model.spot_lights), scene.spot_lights);
  append(std::move(model.directional_lights), scene.directional_lights);
  append(std::move(model.warnings), scene.warnings);
  append(std::move(model.material_warnings), scene.warnings);
}

}  // namespace penumbra
