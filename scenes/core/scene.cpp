#include "scenes/core/scene.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

#include "scenes/core/error.h"
#include "scenes/core/normalise.h"
#include "scenes/core/scene_lights.h"

namespace penumbra {
namespace {

/// Largest distance of the camera from the scene's centre, in diagonals: squares of distances must
/// be finite in single precision.
constexpr double kMaxCameraDistance = 1e15;

/// Allowed diagonals of the author's scene: those that coordinates up to 1e30 can span, and as far
/// below 1.
constexpr double kMinDiagonal = 1e-30;

std::string number(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

void check_extent(const SceneDescription& scene, const Normalisation& n) {
  const std::string name = "scene \"" + scene.name + "\": ";
  // The scale of a scene that is a point or close to it is not finite.
  if (!std::isfinite(n.scale) || !(n.diagonal / n.scale >= kMinDiagonal)) {
    throw InputError(name + "all shapes lie within a box of diagonal " +
                     number(n.diagonal / n.scale) + "; allowed: from " + number(kMinDiagonal));
  }
  const double distance = scene.camera.position.length() / n.diagonal;
  if (!(distance <= kMaxCameraDistance)) {
    throw InputError(name + "the camera is " + number(distance) +
                     " times the diagonal of the shapes away from their centre; allowed: up to " +
                     number(kMaxCameraDistance));
  }
}

/// A light that is so small beside the scene that its corners coincide in single precision.
void check_size(const ShapeDescription& shape, const SurfaceGeometry& geometry) {
  if (geometry.corners == 0) {
    if (geometry.radius > 0.0f) return;
  } else {
    for (std::size_t i = 0; i < geometry.indices.size(); i += geometry.corners) {
      const auto corner = [&](std::size_t k) {
        return Vec3d(geometry.vertices[geometry.indices[i + k]]);
      };
      const Vec3d a = corner(1) - corner(0), b = corner(geometry.corners - 1) - corner(0);
      if (a.cross(b).length() > 0.0) return;
    }
  }
  throw InputError("light \"" + shape.name +
                   "\" is too small beside the scene: in single precision it has no area");
}

SceneDescription normalised(SceneDescription scene, SceneTraits& traits) {
  if (scene.shapes.empty()) throw InputError("scene \"" + scene.name + "\" has no shapes");
  const Normalisation n = normalise(scene);
  check_extent(scene, n);
  traits.center = n.center;
  traits.scale = n.scale;
  traits.diagonal = n.diagonal;
  return scene;
}

struct SurfacePoint {
  Vec3 position;
  Vec3 normal;  // unit, right-handed
};

SurfacePoint sphere_point(const SurfaceGeometry& sphere, const Vec3& hit_normal) noexcept {
  const Vec3 normal = hit_normal.normalized();
  return {sphere.center + normal * sphere.radius, normal};
}

SurfacePoint face_point(const SurfaceGeometry& mesh, const RayHit& hit) noexcept {
  const std::uint32_t* index = &mesh.indices[std::size_t{hit.primitive} * mesh.corners];
  const auto vertex = [&](std::uint32_t k) { return mesh.vertices[index[k]]; };
  Vec3 corner[3] = {vertex(0), vertex(1), vertex(mesh.corners - 1)};
  float u = hit.u;
  float v = hit.v;
  // The second half of a quadrilateral is the triangle 2-3-1 with both coordinates counted from
  // its far corner.
  if (mesh.corners == 4 && u + v > 1.0f) {
    corner[0] = vertex(2), corner[1] = vertex(3), corner[2] = vertex(1);
    u = 1.0f - u;
    v = 1.0f - v;
  }
  return {corner[0] * (1.0f - u - v) + corner[1] * u + corner[2] * v,
          triangle_normal(corner).normalized()};
}

// Of a triangle mesh with normals; a corner without one has the face's own.
Vec3 interpolated_normal(const SurfaceGeometry& mesh, const RayHit& hit) noexcept {
  const std::uint32_t* index = &mesh.indices[std::size_t{hit.primitive} * 3];
  const float weights[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  Vec3 sum(0.0f);
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& n = mesh.normals[index[k]];
    sum += (n == Vec3(0.0f) ? hit.normal.normalized() : n) * weights[k];
  }
  return sum;
}

}  // namespace

Scene::Scene(SceneDescription description, const SceneOptions& options)
    : name_(description.name),
      rays_(RayScene::Query::Closest,
            options.fast_rays ? RayScene::Precision::Fast : RayScene::Precision::Robust),
      content_hash_(penumbra::content_hash(description)),
      keep_all_(options.keep_all) {
  const SceneDescription scene = normalised(std::move(description), traits_);
  camera_ = Camera(scene.camera);
  bsdfs_.reserve(scene.materials.size() + 1);
  for (const MaterialDescription& material : scene.materials) bsdfs_.emplace_back(material);
  // Last, the material of irradiance: reflectance/pi = 1.
  bsdfs_.emplace_back(
      MaterialDescription{"irradiance", LambertMaterial{Rgb(static_cast<float>(M_PI))}});
  {
    const PartTimer timer(parts_.textures);
    textures_ = SceneTextures::make(scene, geometries_, keep_all_);
  }
  geometries_.reserve(scene.shapes.size());
  for (const ShapeDescription& shape : scene.shapes) add_shape(shape);
  add_lights(scene);
  {
    const PartTimer timer(traits_.ray_scene_build_s);
    rays_.commit();
  }
  work_out_traits(scene);
}

void Scene::add_lights(const SceneDescription& scene) {
  for (const PointLightDescription& light : scene.point_lights) {
    lights_.push_back(make_light(light, traits_.diagonal));
  }
  for (const SpotLightDescription& light : scene.spot_lights) {
    lights_.push_back(make_light(light, traits_.diagonal));
  }
  for (const DirectionalLightDescription& light : scene.directional_lights) {
    lights_.push_back(make_light(light));
  }
  if (scene.environment || keep_all_) {
    const PartTimer timer(parts_.environment);
    environment_light_ = static_cast<std::int32_t>(lights_.size());
    // Where all is kept, night is sampled like any sky.
    const EnvironmentDescription night{"night", 1, 1, {Rgb(0.0f)}, 0.0};
    lights_.push_back(make_light(scene.environment ? *scene.environment : night));
    const Environment& table = lights_.back().environment;
    parts_.environment.count = std::size_t{table.columns()} * table.rows();
    parts_.environment.bytes = table.memory_bytes();
  }
  for (std::uint32_t i = 0; i < lights_.size(); ++i) {
    (lights_[i].is_delta() ? delta_lights_ : sampled_lights_).push_back(i);
  }
  parts_.delta_lights.count = delta_lights_.size();
  parts_.delta_lights.bytes = delta_lights_.size() * (sizeof(Light) + sizeof(std::uint32_t));
}

// Arrays along the vertices, where something reads them. Where all is kept they exist everywhere:
// normals of 0, which stand for the face's own, and coordinates of 0.
void Scene::keep_or_drop_arrays(SurfaceGeometry& geometry) {
  const bool is_mesh = geometry.corners == 3;
  {
    const PartTimer timer(parts_.normals);
    if (keep_all_ && is_mesh) geometry.normals.resize(geometry.vertices.size(), Vec3(0.0f));
  }
  {
    const PartTimer timer(parts_.uvs);
    const bool used = textures_ != nullptr && textures_->uses_uvs(geometry.material);
    if (!used && !keep_all_) geometry.uvs = {};
    if (keep_all_) geometry.uvs.resize(geometry.vertices.size(), Vec2(0.0f));
  }
  parts_.normals.count += geometry.normals.empty() ? 0u : 1u;
  parts_.normals.bytes += geometry.normals.size() * sizeof(Vec3);
  parts_.uvs.count += geometry.uvs.empty() ? 0u : 1u;
  parts_.uvs.bytes += geometry.uvs.size() * sizeof(Vec2);
}

void Scene::add_shape(const ShapeDescription& shape) {
  PN_CHECK(shape.material < irradiance_material(), "a shape's material exists");
  SurfaceGeometry geometry = make_geometry(shape);
  keep_or_drop_arrays(geometry);
  const HitFilter* const filter =
      textures_ != nullptr && textures_->filters(shape.material) ? textures_.get() : nullptr;
  if (filter != nullptr && geometry.corners != 0) ++parts_.masks.count;
  if (shape.emission) {
    check_size(shape, geometry);
    geometry.light = static_cast<std::int32_t>(lights_.size());
    Light& light = lights_.emplace_back(make_light(shape, geometry));
    const PartTimer timer(parts_.light_crossings);
    if (auto crossings = make_crossings(light, keep_all_)) {
      ++parts_.light_crossings.count;
      parts_.light_crossings.bytes += crossings->memory_bytes();
      light.crossings = crossings.get();
      light_crossings_.push_back(std::move(crossings));
    }
  }
  if (geometry.subdivision_level > 0) {
    rays_.add_subdivision(geometry.vertices, geometry.face_sizes, geometry.indices,
                          geometry.subdivision_level);
  } else if (geometry.corners == 0) {
    rays_.add_sphere(geometry.center, geometry.radius);
  } else if (geometry.corners == 3) {
    rays_.add_triangles(geometry.vertices, geometry.indices, filter);
  } else {
    rays_.add_quads(geometry.vertices, geometry.indices, filter);
  }
  occluders_.add(geometry);
  geometries_.push_back(std::move(geometry));
}

void Scene::work_out_traits(const SceneDescription& scene) {
  for (const SurfaceGeometry& geometry : geometries_) {
    traits_.triangles += traced_triangles(geometry);
    if (geometry.corners == 0 && geometry.subdivision_level == 0) ++traits_.spheres;
  }
  for (const Light& light : lights_) {
    if (light.type == LightType::Rectangle) ++traits_.rectangle_lights;
    if (light.type == LightType::Sphere) ++traits_.sphere_lights;
    if (light.type == LightType::Mesh) ++traits_.mesh_lights;
    if (light.type == LightType::Point) ++traits_.point_lights;
    if (light.type == LightType::Spot) ++traits_.spot_lights;
    if (light.type == LightType::Directional) ++traits_.directional_lights;
  }
  traits_.has_environment = scene.environment.has_value();
  traits_.geometry = scene.geometry;
  traits_.materials = scene.materials.size();
  for (const Bsdf& bsdf : std::span(bsdfs_).first(scene.materials.size())) {
    traits_.all_diffuse = traits_.all_diffuse && bsdf.type() == BsdfType::Lambert;
    traits_.has_mirrors = traits_.has_mirrors || bsdf.is_delta();
    traits_.min_alpha = std::min(traits_.min_alpha, bsdf.min_alpha());
  }
  traits_.ray_scene_bytes = rays_.memory_bytes();
  if (textures_ != nullptr) {
    parts_.textures.count = textures_->count();
    parts_.textures.bytes = textures_->memory_bytes();
  }
}

ShadingPoint Scene::shading_point(const RayHit& hit, const Vec3& origin,
                                  const Vec3& direction) const noexcept {
  const SurfaceGeometry& geometry = geometries_[hit.geometry];
  SurfacePoint surface;
  std::optional<Vec3> smooth_normal;
  if (geometry.subdivision_level > 0) {
    surface = {origin + direction * hit.distance, hit.normal.normalized()};
    smooth_normal = rays_.subdivision_normal(hit);
  } else if (geometry.corners == 0) {
    surface = sphere_point(geometry, hit.normal);
  } else {
    surface = face_point(geometry, hit);
    if (!geometry.normals.empty()) smooth_normal = interpolated_normal(geometry, hit);
  }
  ShadingPoint point;
  point.light = emitter(hit, direction);
  if (dot(surface.normal, direction) > 0.0f) surface.normal = -surface.normal;
  point.position = offset_ray_origin(surface.position, surface.normal);
  point.geometric_normal = surface.normal;
  point.wo = -direction;
  point.shading_normal = smooth_normal
                             ? make_shading_normal(*smooth_normal, surface.normal, point.wo)
                             : surface.normal;
  // Grazing to rounding: no outgoing hemisphere is left.
  const bool visible = dot(surface.normal, point.wo) > 0.0f;
  point.material =
      visible && !bsdfs_[geometry.material].is_black() ? geometry.material : ShadingPoint::kInvalid;
  return point;
}

}  // namespace penumbra
