#include "scenes/core/scene_lights.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

// Largest distance of a point light from the scene's centre [scene units].
constexpr double kMaxPointLightDistance = 1e18;

std::string too_far(const std::string& name, double distance, double diagonal) {
  std::ostringstream text;
  text << "point light \"" << name << "\" is " << distance / diagonal
       << " times the scene's diagonal away from its centre; allowed: up to "
       << kMaxPointLightDistance / diagonal;
  return text.str();
}

}  // namespace

Light make_light(const ShapeDescription& shape, const SurfaceGeometry& geometry) {
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
      areas.push_back(0.5 * static_cast<double>(triangle_normal(&light.vertices[i]).length()));
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
  return light;
}

Light make_light(const PointLightDescription& description, double diagonal) {
  // A direction and a distance must be left in float.
  const double distance = description.position.length();
  if (!(distance <= kMaxPointLightDistance)) {
    throw InputError(too_far(description.name, distance, diagonal));
  }
  Light light;
  light.type = LightType::Point;
  light.name = description.name;
  light.center = Vec3(description.position);
  light.intensity = description.intensity;
  light.bounds_min = light.bounds_max = light.center;
  return light;
}

Light make_light(const EnvironmentDescription& description) {
  Light light;
  light.type = LightType::Environment;
  light.name = description.name;
  light.environment = Environment(description.texels, description.columns, description.rows,
                                  description.rotation_deg);
  return light;
}

}  // namespace penumbra
