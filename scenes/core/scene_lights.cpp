#include "scenes/core/scene_lights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

// Largest distance of a point or spot light from the scene's centre [scene units].
constexpr double kMaxLightDistance = 1e18;

// A light at a position. A direction and a distance towards it must be left in float.
Light positioned(LightType type, const char* kind, const std::string& name, const Vec3d& position,
                 double diagonal) {
  const double distance = position.length();
  if (!(distance <= kMaxLightDistance)) {
    std::ostringstream text;
    text << kind << " light \"" << name << "\" is " << distance / diagonal
         << " times the scene's diagonal away from its centre; allowed: up to "
         << kMaxLightDistance / diagonal;
    throw InputError(text.str());
  }
  Light light;
  light.type = type;
  light.name = name;
  light.center = Vec3(position);
  light.bounds_min = light.bounds_max = light.center;
  return light;
}

// 1 - cos of an angle, with all its digits for small ones.
double depth_of(double angle_deg) {
  const double sine = std::sin(0.5 * angle_deg * M_PI / 180.0);
  return 2.0 * sine * sine;
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
    // Of the rounded edges, which samples lie on.
    light.plane_normal = Vec3d(light.edge_u).cross(Vec3d(light.edge_v)).normalized();
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
      // In double: the cross product of a sliver's edges cancels.
      const Vec3d corner(light.vertices[i]);
      const Vec3d edge_1 = Vec3d(light.vertices[i + 1]) - corner;
      const Vec3d edge_2 = Vec3d(light.vertices[i + 2]) - corner;
      areas.push_back(0.5 * edge_1.cross(edge_2).length());
    }
    light.triangle_areas = DiscreteDistribution(areas);
    light.area = light.triangle_areas.total_weight();
    light.normal_bounds = normal_bounds(light.vertices);
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

NormalBounds normal_bounds(const std::vector<Vec3>& vertices) {
  const auto normal_of = [&](std::size_t i) {
    return (Vec3d(vertices[i + 1]) - Vec3d(vertices[i]))
        .cross(Vec3d(vertices[i + 2]) - Vec3d(vertices[i]));
  };
  NormalBounds bounds;
  Vec3d sum(0.0);
  for (std::size_t i = 0; i < vertices.size(); i += 3) sum += normal_of(i);
  if (!(sum.length() > 0.0)) return bounds;
  bounds.axis = sum.normalized();
  // By the chord, which keeps its digits where the normals hardly differ.
  double chord2 = 0.0;
  bounds.lowest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    bounds.lowest = std::min(bounds.lowest, bounds.axis.dot(Vec3d(vertices[i])));
    if (i % 3 != 0) continue;
    const Vec3d normal = normal_of(i);
    const double length = normal.length();
    if (length > 0.0) chord2 = std::max(chord2, (normal / length - bounds.axis).length2());
  }
  bounds.cosine = 1.0 - 0.5 * chord2;
  bounds.sine = std::sqrt(chord2 * std::max(0.0, 1.0 - 0.25 * chord2));
  return bounds;
}

// A triangle faces the point when dot(n, v) > 0 for its normal n and the vector v from one of its
// points to the point. Split along the axis, n = cos(b) axis + sin(b) across with an angle b up to
// the bound: dot(n, v) <= cos(b) height + sin(b) |v|, which grows with b where the height of the
// point over the lowest vertex is negative.
bool NormalBounds::all_face_away_from(const Vec3& point, double farthest_vertex) const noexcept {
  if (!(cosine > 0.0)) return false;
  const double height = axis.dot(Vec3d(point)) - lowest;
  // What float normals and positions may be off by.
  const double rounding = 4e-7 * (farthest_vertex + std::abs(lowest));
  return cosine * height + sine * farthest_vertex < -rounding;
}

std::unique_ptr<RayScene> make_crossings(const Light& light, bool keep_all) {
  if (light.vertices.size() <= (keep_all ? 0 : 3 * kMaxTriedTriangles)) return nullptr;
  auto scene = std::make_unique<RayScene>(RayScene::Query::Crossings);
  std::vector<std::uint32_t> indices(light.vertices.size());
  std::iota(indices.begin(), indices.end(), 0u);
  scene->add_triangles(light.vertices, indices);
  scene->commit();
  return scene;
}

Light make_light(const PointLightDescription& description, double diagonal) {
  Light light =
      positioned(LightType::Point, "point", description.name, description.position, diagonal);
  light.intensity = description.intensity;
  return light;
}

Light make_light(const SpotLightDescription& description, double diagonal) {
  PN_CHECK(description.inner_angle_deg < description.outer_angle_deg, "a spot light has a falloff");
  Light light =
      positioned(LightType::Spot, "spot", description.name, description.position, diagonal);
  light.intensity = description.intensity;
  light.axis = description.direction.normalized();
  light.inner_depth = depth_of(description.inner_angle_deg);
  light.outer_depth = depth_of(description.outer_angle_deg);
  return light;
}

Light make_light(const DirectionalLightDescription& description) {
  Light light;
  light.type = LightType::Directional;
  light.name = description.name;
  light.irradiance = description.irradiance;
  light.axis = description.direction.normalized();
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
