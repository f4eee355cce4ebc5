#include "tests/support/scenes_support.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace penumbra::test {
namespace {

using Vec3l = Imath::Vec3<long double>;

void grow(Light& light, const Vec3& p) {
  for (int axis = 0; axis < 3; ++axis) {
    light.bounds_min[axis] = std::min(light.bounds_min[axis], p[axis]);
    light.bounds_max[axis] = std::max(light.bounds_max[axis], p[axis]);
  }
}

std::vector<Vec3d> corners_of(const Light& r) {
  const Vec3d o(r.origin);
  const Vec3d u(r.edge_u);
  const Vec3d v(r.edge_v);
  return {o, o + u, o + u + v, o + v};
}

}  // namespace

Light rectangle_light(const Vec3& origin, const Vec3& edge_u, const Vec3& edge_v, bool two_sided) {
  Light light;
  light.type = LightType::Rectangle;
  light.two_sided = two_sided;
  light.radiance = Rgb(1.0f);
  light.origin = origin;
  light.edge_u = edge_u;
  light.edge_v = edge_v;
  const Vec3d n = Vec3d(edge_u).cross(Vec3d(edge_v));
  light.area = n.length();
  light.plane_normal = n.normalized();
  light.normal = Vec3(light.plane_normal);
  light.bounds_min = light.bounds_max = origin;
  for (const Vec3d& corner : corners_of(light)) grow(light, Vec3(corner));
  return light;
}

Light sphere_light(const Vec3& center, float radius, bool two_sided) {
  Light light;
  light.type = LightType::Sphere;
  light.two_sided = two_sided;
  light.radiance = Rgb(1.0f);
  light.center = center;
  light.radius = radius;
  light.area = 4.0 * std::numbers::pi * static_cast<double>(radius) * static_cast<double>(radius);
  light.bounds_min = center - Vec3(radius);
  light.bounds_max = center + Vec3(radius);
  return light;
}

Light mesh_light(const TriangleMeshShape& mesh, bool two_sided) {
  Light light;
  light.type = LightType::Mesh;
  light.two_sided = two_sided;
  light.radiance = Rgb(1.0f);
  std::vector<double> areas;
  for (const auto& triangle : mesh.triangles) {
    Vec3d corner[3];
    for (std::size_t k = 0; k < 3; ++k) {
      light.vertices.emplace_back(mesh.vertices[triangle[k]]);
      corner[k] = Vec3d(light.vertices.back());
    }
    areas.push_back(0.5 * (corner[1] - corner[0]).cross(corner[2] - corner[0]).length());
  }
  light.triangle_areas = DiscreteDistribution(areas);
  light.area = light.triangle_areas.total_weight();
  light.bounds_min = light.bounds_max = light.vertices.front();
  for (const Vec3& vertex : light.vertices) grow(light, vertex);
  return light;
}

TriangleMeshShape cube_mesh(const Vec3d& center, double side) {
  TriangleMeshShape mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.push_back(center +
                            Vec3d((i & 1) - 0.5, (i >> 1 & 1) - 0.5, (i >> 2) - 0.5) * side);
  }
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

TriangleMeshShape tetrahedron_mesh(const Vec3d& center, double circumradius) {
  const double s = circumradius / std::numbers::sqrt3;
  TriangleMeshShape mesh;
  mesh.vertices = {center + Vec3d(s, s, s), center + Vec3d(s, -s, -s), center + Vec3d(-s, s, -s),
                   center + Vec3d(-s, -s, s)};
  mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  return mesh;
}

TriangleMeshShape sphere_mesh(const Vec3d& center, double radius, std::uint32_t rings,
                              std::uint32_t sectors) {
  TriangleMeshShape mesh;
  mesh.vertices.push_back(center + Vec3d(0, 0, radius));
  for (std::uint32_t i = 1; i < rings; ++i) {
    const double theta = std::numbers::pi * i / rings;
    for (std::uint32_t j = 0; j < sectors; ++j) {
      const double phi = 2.0 * std::numbers::pi * j / sectors;
      mesh.vertices.push_back(center + Vec3d(std::sin(theta) * std::cos(phi),
                                             std::sin(theta) * std::sin(phi), std::cos(theta)) *
                                           radius);
    }
  }
  mesh.vertices.push_back(center - Vec3d(0, 0, radius));
  const auto last = static_cast<std::uint32_t>(mesh.vertices.size()) - 1;
  for (std::uint32_t j = 0; j < sectors; ++j) {
    const std::uint32_t next = (j + 1) % sectors;
    mesh.triangles.push_back({0, 1 + j, 1 + next});
    for (std::uint32_t i = 0; i + 2 < rings; ++i) {
      const std::uint32_t a = 1 + i * sectors;
      const std::uint32_t b = a + sectors;
      mesh.triangles.push_back({a + j, b + j, b + next});
      mesh.triangles.push_back({a + j, b + next, a + next});
    }
    const std::uint32_t ring = 1 + (rings - 2) * sectors;
    mesh.triangles.push_back({ring + j, last, ring + next});
  }
  return mesh;
}

MaterialDescription lambert(float reflectance, std::string name) {
  return {std::move(name), LambertMaterial{Rgb(reflectance)}};
}

ShapeDescription shape(std::string name, Shape geometry, std::uint32_t material) {
  return {std::move(name), material, std::move(geometry), std::nullopt};
}

ShapeDescription light(std::string name, Shape geometry, const Rgb& radiance, bool two_sided) {
  return {std::move(name), 0, std::move(geometry), EmissionDescription{radiance, two_sided}};
}

SceneDescription small_scene() {
  SceneDescription scene;
  scene.name = "small";
  scene.materials = {lambert(0.5f), {"metal", ConductorMaterial{}}};
  scene.camera.position = {0, 3, 6};
  scene.camera.look_at = {0, 0.5, 0};
  scene.camera.resolution = {48, 27};
  QuadMeshShape wall;
  wall.vertices = {{-1, 0, 0}, {-0.5, 0, 0}, {-0.5, 1, 0.25}, {-1, 1, 0.25}};
  wall.quads = {{0, 1, 2, 3}};
  scene.shapes = {
      shape("floor", RectangleShape{{-4, 0, 4}, {8, 0, 0}, {0, 0, -8}}),
      light("panel", RectangleShape{{-0.5, 3, -0.5}, {1, 0, 0}, {0, 0, 1}}, Rgb(4, 3, 2)),
      light("cube", cube_mesh({2, 0.5, 0}, 0.5), Rgb(1, 2, 1)),
      light("ball", SphereShape{{0.5, 0.75, 1}, 0.25}, Rgb(2, 2, 2)), shape("wall", wall, 1)};
  return scene;
}

ShadingPoint shading_point_at(const Vec3& position, const Vec3& normal, const Vec3& wo) {
  ShadingPoint point;
  point.position = position;
  point.geometric_normal = normal;
  point.shading_normal = normal;
  point.wo = wo;
  point.material = 0;
  return point;
}

double polygon_irradiance(std::span<const Vec3d> corners, const Vec3d& from, const Vec3d& normal) {
  std::vector<Vec3d> above;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3d a = corners[i] - from;
    const Vec3d b = corners[(i + 1) % corners.size()] - from;
    const double height_a = a.dot(normal);
    const double height_b = b.dot(normal);
    if (height_a >= 0.0) above.push_back(a);
    if ((height_a < 0.0) != (height_b < 0.0)) {
      above.push_back(a + (b - a) * (height_a / (height_a - height_b)));
    }
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < above.size(); ++i) {
    const Vec3d& a = above[i];
    const Vec3d& b = above[(i + 1) % above.size()];
    const Vec3d c = a.cross(b);
    const double sine = c.length();
    if (sine > 0.0) sum += std::atan2(sine, a.dot(b)) * c.dot(normal) / sine;
  }
  return 0.5 * std::abs(sum);
}

double rectangle_irradiance(const Light& rectangle, const Vec3& from, const Vec3& normal) {
  return polygon_irradiance(corners_of(rectangle), Vec3d(from), Vec3d(normal));
}

long double triangle_solid_angle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3l p(a);
  const Vec3l q(b);
  const Vec3l r(c);
  // The triple product through edges: differences of nearby corners are exact, products of far ones
  // are not.
  const long double triple = p.dot((q - p).cross(r - p));
  const long double lp = std::sqrt(p.dot(p));
  const long double lq = std::sqrt(q.dot(q));
  const long double lr = std::sqrt(r.dot(r));
  const long double scalar = lp * lq * lr + p.dot(q) * lr + q.dot(r) * lp + r.dot(p) * lq;
  return 2.0L * std::atan2(std::abs(triple), scalar);
}

long double rectangle_solid_angle(const Light& rectangle, const Vec3& from) {
  std::vector<Vec3d> c = corners_of(rectangle);
  for (Vec3d& corner : c) corner -= Vec3d(from);
  return triangle_solid_angle(c[0], c[1], c[2]) + triangle_solid_angle(c[0], c[2], c[3]);
}

}  // namespace penumbra::test
