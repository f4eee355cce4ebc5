#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstdio>
#include <type_traits>

#include "scenes/core/normalise.h"

namespace penumbra {
namespace {

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
  void add(const Vec2& v) { add(v.x), add(v.y); }
  void add(const std::string& text) {
    add(static_cast<std::uint64_t>(text.size()));
    XXH3_128bits_update(state_, text.data(), text.size());
  }
  // Elements are numbers side by side, so the bytes are those of adding one after the other.
  template <typename T>
  void add(const std::vector<T>& values) {
    static_assert(sizeof(T) % sizeof(float) == 0 && std::is_trivially_destructible_v<T>);
    add(static_cast<std::uint64_t>(values.size()));
    XXH3_128bits_update(state_, values.data(), values.size() * sizeof(T));
  }
  template <typename T, std::size_t N>
  void add(const std::array<T, N>& values) {
    for (const T& value : values) add(value);
  }

  void add(const LambertMaterial& m) { add(m.reflectance); }
  void add(const ConductorMaterial& m) { add(m.eta), add(m.k), add(m.alpha), add(m.tint); }
  void add(const PhongMaterial& m) { add(m.diffuse), add(m.specular), add(m.exponent); }
  void add(const MixtureMaterial& m) { add(m.diffuse), add(m.glossy), add(m.glossy_weight); }
  void add(const MetallicRoughnessMaterial& m) {
    add(m.base_color), add(m.metallic), add(m.roughness);
  }
  void add(const MirrorMaterial& m) { add(m.reflectance); }
  void add(const TextureDescription& t) {
    add(t.content_hash), add(t.srgb), add(t.channel);
    add(static_cast<int>(t.wrap_u)), add(static_cast<int>(t.wrap_v));
  }
  void add(const MaskDescription& m) { add(m.texture), add(m.cutoff); }
  // A part that is absent adds nothing, so that new kinds of parts do not change old scenes'
  // hashes; a present one begins with its name.
  template <typename T>
  void add_part(const char* name, const std::optional<T>& part) {
    if (part) add(std::string(name)), add(*part);
  }
  void add(const RectangleShape& s) { add(s.origin), add(s.edge_u), add(s.edge_v); }
  void add(const SphereShape& s) { add(s.center), add(s.radius); }
  void add(const TriangleMeshShape& s) {
    add(s.vertices), add(s.triangles);
    if (!s.normals.empty()) add(std::string("normals")), add(s.normals);
    if (!s.uvs.empty()) add(std::string("uvs")), add(s.uvs);
  }
  void add(const QuadMeshShape& s) { add(s.vertices), add(s.quads); }
  void add(const SubdivisionShape& s) {
    add(s.vertices), add(s.face_sizes), add(s.indices), add(s.level);
  }
  void add(const SpotLightDescription& l) {
    add(l.position), add(l.direction), add(l.intensity);
    add(l.inner_angle_deg), add(l.outer_angle_deg);
  }
  void add(const DirectionalLightDescription& l) { add(l.direction), add(l.irradiance); }

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
    hasher.add_part("reflectance_texture", material.reflectance_texture);
    hasher.add_part("roughness_texture", material.roughness_texture);
    hasher.add_part("metallic_texture", material.metallic_texture);
    hasher.add_part("mask", material.mask);
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
  for (const SpotLightDescription& light : scene.spot_lights) {
    hasher.add(std::string("spot")), hasher.add(light);
  }
  for (const DirectionalLightDescription& light : scene.directional_lights) {
    hasher.add(std::string("directional")), hasher.add(light);
  }
  if (scene.environment) {
    hasher.add(scene.environment->columns);
    hasher.add(scene.environment->rows);
    hasher.add(scene.environment->texels);
    if (scene.environment->rotation_deg != 0.0) {
      hasher.add(std::string("rotation")), hasher.add(scene.environment->rotation_deg);
    }
  }
  return hasher.digest();
}

}  // namespace penumbra
