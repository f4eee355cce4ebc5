#include "scenes/core/normalise.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <type_traits>

namespace penumbra {
namespace {

struct Box {
  Vec3d low{std::numeric_limits<double>::infinity()};
  Vec3d high{-std::numeric_limits<double>::infinity()};

  void add(const Vec3d& p) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
};

// Calls point(Vec3d&) for each position and length(Vec3d&) / radius(double&) for each difference of
// a shape.
template <typename Point, typename Edge, typename Radius>
void for_each_coordinate(Shape& shape, Point point, Edge edge, Radius radius) {
  if (auto* rectangle = std::get_if<RectangleShape>(&shape)) {
    point(rectangle->origin);
    edge(rectangle->edge_u);
    edge(rectangle->edge_v);
  } else if (auto* sphere = std::get_if<SphereShape>(&shape)) {
    point(sphere->center);
    radius(sphere->radius);
  } else if (auto* mesh = std::get_if<TriangleMeshShape>(&shape)) {
    for (Vec3d& vertex : mesh->vertices) point(vertex);
  } else {
    for (Vec3d& vertex : std::get<QuadMeshShape>(shape).vertices) point(vertex);
  }
}

Box bounds(const SceneDescription& scene) {
  Box box;
  for (const ShapeDescription& description : scene.shapes) {
    if (const auto* r = std::get_if<RectangleShape>(&description.shape)) {
      box.add(r->origin);
      box.add(r->origin + r->edge_u);
      box.add(r->origin + r->edge_v);
      box.add(r->origin + r->edge_u + r->edge_v);
    } else if (const auto* s = std::get_if<SphereShape>(&description.shape)) {
      box.add(s->center - Vec3d(s->radius));
      box.add(s->center + Vec3d(s->radius));
    } else if (const auto* m = std::get_if<TriangleMeshShape>(&description.shape)) {
      for (const Vec3d& vertex : m->vertices) box.add(vertex);
    } else {
      for (const Vec3d& vertex : std::get<QuadMeshShape>(description.shape).vertices) {
        box.add(vertex);
      }
    }
  }
  return box;
}

// Feeds values to the hash one by one, so that no padding byte of a struct takes part.
class Hasher {
 public:
  Hasher() : state_(XXH3_createState()) { XXH3_128bits_reset(state_); }
  ~Hasher() { XXH3_freeState(state_); }
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  template <typename T>
  void add(const T& value) requires std::is_arithmetic_v<T> {
    XXH3_128bits_update(state_, &value, sizeof(value));
  }
  template <typename T>
  void add(const Imath::Vec3<T>& v) {
    for (int axis = 0; axis < 3; ++axis) add(v[axis]);
  }
  template <typename T>
  void add(const std::vector<T>& values) {
    add(static_cast<std::uint64_t>(values.size()));
    for (const T& value : values) add(value);
  }
  template <typename T, std::size_t N>
  void add(const std::array<T, N>& values) {
    for (const T& value : values) add(value);
  }

  void add(const LambertMaterial& m) { add(m.reflectance); }
  void add(const ConductorMaterial& m) { add(m.eta), add(m.k), add(m.alpha), add(m.tint); }
  void add(const PhongMaterial& m) { add(m.diffuse), add(m.specular), add(m.exponent); }
  void add(const MixtureMaterial& m) { add(m.diffuse), add(m.glossy), add(m.glossy_weight); }
  void add(const RectangleShape& s) { add(s.origin), add(s.edge_u), add(s.edge_v); }
  void add(const SphereShape& s) { add(s.center), add(s.radius); }
  void add(const TriangleMeshShape& s) { add(s.vertices), add(s.triangles); }
  void add(const QuadMeshShape& s) { add(s.vertices), add(s.quads); }

  std::string digest() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(state_);
    char text[33];
    std::snprintf(text, sizeof(text), "%016llx%016llx",
                  static_cast<unsigned long long>(hash.high64),
                  static_cast<unsigned long long>(hash.low64));
    return text;
  }

 private:
  XXH3_state_t* state_;
};

}  // namespace

Normalisation normalise(SceneDescription& scene) {
  const Box box = bounds(scene);
  Normalisation result;
  result.center = (box.low + box.high) * 0.5;
  const double diagonal = (box.high - box.low).length();
  result.scale = diagonal > 0.0 ? std::exp2(std::round(std::log2(4.0 / diagonal))) : 1.0;
  result.diagonal = diagonal * result.scale;

  const auto point = [&](Vec3d& p) { p = (p - result.center) * result.scale; };
  const auto edge = [&](Vec3d& e) { e *= result.scale; };
  const auto radius = [&](double& r) { r *= result.scale; };
  for (ShapeDescription& shape : scene.shapes) {
    for_each_coordinate(shape.shape, point, edge, radius);
  }
  for (PointLightDescription& light : scene.point_lights) {
    point(light.position);
    // Irradiance is intensity / distance^2 in any unit.
    light.intensity *= result.scale * result.scale;
  }
  point(scene.camera.position);
  point(scene.camera.look_at);
  return result;
}

std::string content_hash(const SceneDescription& scene) {
  Hasher hasher;
  hasher.add(scene.camera.position);
  hasher.add(scene.camera.look_at);
  hasher.add(scene.camera.up);
  hasher.add(scene.camera.vertical_fov_deg);
  hasher.add(scene.camera.resolution);
  for (const MaterialDescription& material : scene.materials) {
    hasher.add(static_cast<std::uint64_t>(material.model.index()));
    std::visit([&](const auto& model) { hasher.add(model); }, material.model);
  }
  for (const ShapeDescription& shape : scene.shapes) {
    hasher.add(shape.material);
    hasher.add(static_cast<std::uint64_t>(shape.shape.index()));
    std::visit([&](const auto& s) { hasher.add(s); }, shape.shape);
    hasher.add(shape.emission.has_value());
    if (shape.emission) {
      hasher.add(shape.emission->radiance);
      hasher.add(shape.emission->two_sided);
    }
  }
  // Counted, so that lights and texels are not taken for one another; a scene without any adds
  // nothing.
  if (!scene.point_lights.empty()) {
    hasher.add(static_cast<std::uint64_t>(scene.point_lights.size()));
  }
  for (const PointLightDescription& light : scene.point_lights) {
    hasher.add(light.position);
    hasher.add(light.intensity);
  }
  if (scene.environment) {
    hasher.add(scene.environment->columns);
    hasher.add(scene.environment->rows);
    hasher.add(scene.environment->texels);
  }
  return hasher.digest();
}

}  // namespace penumbra
