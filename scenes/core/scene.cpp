#include "scenes/core/scene.h"

#include <algorithm>
#include <chrono>
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

}  // namespace

Scene::Scene(SceneDescription description)
    : name_(description.name), content_hash_(penumbra::content_hash(description)) {
  const SceneDescription scene = normalised(std::move(description), traits_);
  camera_ = Camera(scene.camera);
  bsdfs_.reserve(scene.materials.size() + 1);
  for (const MaterialDescription& material : scene.materials) bsdfs_.emplace_back(material);
  // Last, the material of irradiance: reflectance/pi = 1.
  bsdfs_.emplace_back(
      MaterialDescription{"irradiance", LambertMaterial{Rgb(static_cast<float>(M_PI))}});
  geometries_.reserve(scene.shapes.size());
  for (const ShapeDescription& shape : scene.shapes) add_shape(shape);
  for (const PointLightDescription& light : scene.point_lights) {
    lights_.push_back(make_light(light, traits_.diagonal));
  }
  if (scene.environment) {
    environment_light_ = static_cast<std::int32_t>(lights_.size());
    lights_.push_back(make_light(*scene.environment));
  }
  const auto build_start = std::chrono::steady_clock::now();
  rays_.commit();
  traits_.ray_scene_build_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - build_start).count();
  work_out_traits(scene);
}

void Scene::add_shape(const ShapeDescription& shape) {
  PN_CHECK(shape.material < irradiance_material(), "a shape's material exists");
  SurfaceGeometry geometry = make_geometry(shape);
  if (shape.emission) {
    geometry.light = static_cast<std::int32_t>(lights_.size());
    lights_.push_back(make_light(shape, geometry));
  }
  if (geometry.corners == 0) {
    rays_.add_sphere(geometry.center, geometry.radius);
  } else if (geometry.corners == 3) {
    rays_.add_triangles(geometry.vertices, geometry.indices);
  } else {
    rays_.add_quads(geometry.vertices, geometry.indices);
  }
  geometries_.push_back(std::move(geometry));
}

void Scene::work_out_traits(const SceneDescription& scene) {
  for (const SurfaceGeometry& geometry : geometries_) {
    if (geometry.corners == 0) {
      ++traits_.spheres;
    } else {
      traits_.triangles += geometry.indices.size() / geometry.corners * (geometry.corners - 2);
    }
  }
  for (const Light& light : lights_) {
    if (light.type == LightType::Rectangle) ++traits_.rectangle_lights;
    if (light.type == LightType::Sphere) ++traits_.sphere_lights;
    if (light.type == LightType::Mesh) ++traits_.mesh_lights;
    if (light.type == LightType::Point) ++traits_.point_lights;
  }
  traits_.has_environment = environment_light_ != kNoLight;
  traits_.materials = scene.materials.size();
  for (const Bsdf& bsdf : std::span(bsdfs_).first(scene.materials.size())) {
    traits_.all_diffuse = traits_.all_diffuse && bsdf.type() == BsdfType::Lambert;
    traits_.min_alpha = std::min(traits_.min_alpha, bsdf.min_alpha());
  }
  traits_.ray_scene_bytes = rays_.memory_bytes();
}

ShadingPoint Scene::shading_point(const RayHit& hit, const Vec3& direction) const noexcept {
  const SurfaceGeometry& geometry = geometries_[hit.geometry];
  Vec3 position;
  Vec3 normal;
  if (geometry.corners == 0) {
    normal = hit.normal.normalized();
    position = geometry.center + normal * geometry.radius;
  } else {
    const std::uint32_t* index = &geometry.indices[std::size_t{hit.primitive} * geometry.corners];
    const auto vertex = [&](std::uint32_t k) { return geometry.vertices[index[k]]; };
    Vec3 corner[3] = {vertex(0), vertex(1), vertex(geometry.corners - 1)};
    float u = hit.u;
    float v = hit.v;
    // The second half of a quadrilateral is the triangle 2-3-1 with both coordinates counted from
    // its far corner.
    if (geometry.corners == 4 && u + v > 1.0f) {
      corner[0] = vertex(2), corner[1] = vertex(3), corner[2] = vertex(1);
      u = 1.0f - u;
      v = 1.0f - v;
    }
    normal = triangle_normal(corner).normalized();
    position = corner[0] * (1.0f - u - v) + corner[1] * u + corner[2] * v;
  }
  ShadingPoint point;
  point.light = emitter(hit, direction);
  if (dot(normal, direction) > 0.0f) normal = -normal;
  point.position = offset_ray_origin(position, normal);
  point.geometric_normal = normal;
  point.shading_normal = normal;
  point.wo = -direction;
  // Grazing to rounding: no outgoing hemisphere is left.
  const bool visible = dot(normal, point.wo) > 0.0f;
  point.material =
      visible && !bsdfs_[geometry.material].is_black() ? geometry.material : ShadingPoint::kInvalid;
  return point;
}

}  // namespace penumbra
