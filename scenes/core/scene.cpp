#include "scenes/core/scene.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "scenes/core/error.h"
#include "scenes/core/normalise.h"

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

// Largest distance of a point light from the scene's centre [scene units].
constexpr double kMaxPointLightDistance = 1e18;

std::string too_far(const std::string& name, double distance, double diagonal) {
  std::ostringstream text;
  text << "point light \"" << name << "\" is " << distance / diagonal
       << " times the scene's diagonal away from its centre; allowed: up to "
       << kMaxPointLightDistance / diagonal;
  return text.str();
}

Vec3 mesh_normal(const Vec3* corner) { return cross(corner[1] - corner[0], corner[2] - corner[0]); }

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
  geometries_.reserve(scene.shapes.size());
  for (const ShapeDescription& shape : scene.shapes) add_shape(shape);
  for (const PointLightDescription& light : scene.point_lights) add_point_light(light);
  if (scene.environment) add_environment(*scene.environment);
  rays_.commit();
  work_out_traits(scene);
}

void Scene::add_shape(const ShapeDescription& shape) {
  PN_CHECK(shape.material < irradiance_material(), "a shape's material exists");
  Geometry geometry;
  geometry.material = shape.material;
  if (const auto* rectangle = std::get_if<RectangleShape>(&shape.shape)) {
    geometry.corners = 4;
    const Vec3d& o = rectangle->origin;
    const Vec3d& u = rectangle->edge_u;
    const Vec3d& v = rectangle->edge_v;
    geometry.vertices = {Vec3(o), Vec3(o + u), Vec3(o + u + v), Vec3(o + v)};
    geometry.indices = {0, 1, 2, 3};
  } else if (const auto* sphere = std::get_if<SphereShape>(&shape.shape)) {
    geometry.corners = 0;
    geometry.center = Vec3(sphere->center);
    geometry.radius = static_cast<float>(sphere->radius);
  } else if (const auto* mesh = std::get_if<TriangleMeshShape>(&shape.shape)) {
    geometry.corners = 3;
    for (const Vec3d& vertex : mesh->vertices) geometry.vertices.emplace_back(vertex);
    for (const auto& triangle : mesh->triangles) {
      geometry.indices.insert(geometry.indices.end(), triangle.begin(), triangle.end());
    }
  } else {
    const auto& quads = std::get<QuadMeshShape>(shape.shape);
    geometry.corners = 4;
    for (const Vec3d& vertex : quads.vertices) geometry.vertices.emplace_back(vertex);
    for (const auto& quad : quads.quads) {
      geometry.indices.insert(geometry.indices.end(), quad.begin(), quad.end());
    }
  }
  if (shape.emission) add_light(shape, geometry);

  if (geometry.corners == 0) {
    rays_.add_sphere(geometry.center, geometry.radius);
  } else if (geometry.corners == 3) {
    rays_.add_triangles(geometry.vertices, geometry.indices);
  } else {
    rays_.add_quads(geometry.vertices, geometry.indices);
  }
  geometries_.push_back(std::move(geometry));
}

void Scene::add_light(const ShapeDescription& shape, Geometry& geometry) {
  geometry.light = static_cast<std::int32_t>(lights_.size());
  Light light;
  light.name = shape.name;
  light.radiance = shape.emission->radiance;
  light.two_sided = shape.emission->two_sided;
  if (const auto* rectangle = std::get_if<RectangleShape>(&shape.shape)) {
    light.type = LightType::Rectangle;
    light.origin = Vec3(rectangle->origin);
    light.edge_u = Vec3(rectangle->edge_u);
    light.edge_v = Vec3(rectangle->edge_v);
    const Vec3d n = rectangle->edge_u.cross(rectangle->edge_v);
    light.normal = Vec3(n.normalized());
    light.area = n.length();
  } else if (const auto* sphere = std::get_if<SphereShape>(&shape.shape)) {
    light.type = LightType::Sphere;
    light.center = geometry.center;
    light.radius = geometry.radius;
    light.area = 4.0 * M_PI * sphere->radius * sphere->radius;
  } else {
    light.type = LightType::Mesh;
    std::vector<double> areas;
    const std::uint32_t corners = geometry.corners;
    for (std::size_t i = 0; i < geometry.indices.size(); i += corners) {
      const auto vertex = [&](std::size_t k) { return geometry.vertices[geometry.indices[i + k]]; };
      light.vertices.insert(light.vertices.end(), {vertex(0), vertex(1), vertex(corners - 1)});
      if (corners == 4) {
        light.vertices.insert(light.vertices.end(), {vertex(2), vertex(3), vertex(1)});
      }
    }
    for (std::size_t i = 0; i < light.vertices.size(); i += 3) {
      areas.push_back(0.5 * static_cast<double>(mesh_normal(&light.vertices[i]).length()));
    }
    light.triangle_areas = DiscreteDistribution(areas);
    light.area = light.triangle_areas.total_weight();
  }
  const Vec3 radius(light.radius);
  light.bounds_min = light.type == LightType::Sphere ? light.center - radius : geometry.vertices[0];
  light.bounds_max = light.type == LightType::Sphere ? light.center + radius : geometry.vertices[0];
  for (const Vec3& vertex : geometry.vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      light.bounds_min[axis] = std::min(light.bounds_min[axis], vertex[axis]);
      light.bounds_max[axis] = std::max(light.bounds_max[axis], vertex[axis]);
    }
  }
  lights_.push_back(std::move(light));
}

void Scene::add_point_light(const PointLightDescription& description) {
  // A direction and a distance must be left in float.
  const double distance = description.position.length();
  if (!(distance <= kMaxPointLightDistance)) {
    throw InputError(too_far(description.name, distance, traits_.diagonal));
  }
  Light light;
  light.type = LightType::Point;
  light.name = description.name;
  light.center = Vec3(description.position);
  light.intensity = description.intensity;
  light.bounds_min = light.bounds_max = light.center;
  lights_.push_back(std::move(light));
}

void Scene::add_environment(const EnvironmentDescription& description) {
  Light light;
  light.type = LightType::Environment;
  light.name = description.name;
  light.environment = Environment(description.texels, description.columns, description.rows);
  environment_light_ = static_cast<std::int32_t>(lights_.size());
  lights_.push_back(std::move(light));
}

void Scene::work_out_traits(const SceneDescription& scene) {
  for (const Geometry& geometry : geometries_) {
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
  const Geometry& geometry = geometries_[hit.geometry];
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
    normal = mesh_normal(corner).normalized();
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
