#include "scenes/core/scene.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "scenes/core/error.h"
#include "scenes/core/normalise.h"
#include "scenes/core/scene_lights.h"

namespace penumbra {
namespace {

SceneDescription normalised(SceneDescription scene, SceneTraits& traits) {
  if (scene.shapes.empty()) throw InputError("scene \"" + scene.name + "\" has no shapes");
  const Normalisation n = normalise(scene);
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

Scene::Scene(const SceneDescription& description)
    : name_(description.name), content_hash_(penumbra::content_hash(description)) {
  const SceneDescription scene = normalised(description, traits_);
  camera_ = Camera(scene.camera);
  bsdfs_.reserve(scene.materials.size() + 1);
  for (const MaterialDescription& material : scene.materials) bsdfs_.emplace_back(material);
  // Last, the material of irradiance: reflectance/pi = 1.
  bsdfs_.emplace_back(
      MaterialDescription{"irradiance", LambertMaterial{Rgb(static_cast<float>(M_PI))}});
  textures_ = SceneTextures::make(scene, geometries_);
  geometries_.reserve(scene.shapes.size());
  for (const ShapeDescription& shape : scene.shapes) add_shape(shape);
  for (const PointLightDescription& light : scene.point_lights) {
    lights_.push_back(make_light(light, traits_.diagonal));
  }
  for (const SpotLightDescription& light : scene.spot_lights) {
    lights_.push_back(make_light(light, traits_.diagonal));
  }
  for (const DirectionalLightDescription& light : scene.directional_lights) {
    lights_.push_back(make_light(light));
  }
  if (scene.environment) {
    environment_light_ = static_cast<std::int32_t>(lights_.size());
    lights_.push_back(make_light(*scene.environment));
  }
  rays_.commit();
  work_out_traits(scene);
}

void Scene::add_shape(const ShapeDescription& shape) {
  PN_CHECK(shape.material < irradiance_material(), "a shape's material exists");
  SurfaceGeometry geometry = make_geometry(shape);
  if (textures_ == nullptr || !textures_->uses_uvs(shape.material)) geometry.uvs = {};
  const HitFilter* const filter =
      textures_ != nullptr && textures_->has_mask(shape.material) ? textures_.get() : nullptr;
  if (filter != nullptr) ++traits_.masked_shapes;
  if (shape.emission) {
    geometry.light = static_cast<std::int32_t>(lights_.size());
    Light& light = lights_.emplace_back(make_light(shape, geometry));
    if (auto crossings = make_crossings(light)) {
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
  traits_.has_environment = environment_light_ != kNoLight;
  traits_.materials = scene.materials.size();
  for (const Bsdf& bsdf : std::span(bsdfs_).first(scene.materials.size())) {
    traits_.all_diffuse = traits_.all_diffuse && bsdf.type() == BsdfType::Lambert;
    traits_.min_alpha = std::min(traits_.min_alpha, bsdf.min_alpha());
  }
  traits_.ray_scene_bytes = rays_.memory_bytes();
  if (textures_ != nullptr) {
    traits_.textures = textures_->count();
    traits_.texture_bytes = textures_->memory_bytes();
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
