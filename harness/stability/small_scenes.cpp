#include "harness/stability/small_scenes.h"

#include <array>
#include <cmath>

#include "harness/stability/closed_form.h"
#include "scenes/core/error.h"

namespace penumbra::stability {
namespace {

Rgb grey(double value) { return Rgb(static_cast<float>(value)); }

Vec3d scene_position(const Scene& scene, const Vec3d& world) {
  return (world - scene.traits().center) * scene.traits().scale;
}

std::vector<Vec3d> corners_of(const Light& light) {
  const Vec3d o(light.origin);
  const Vec3d u(light.edge_u);
  const Vec3d v(light.edge_v);
  return {o, o + u, o + u + v, o + v};
}

}  // namespace

SceneDescription small_scene(std::string name) {
  SceneDescription scene;
  scene.name = std::move(name);
  scene.materials = {{"black", LambertMaterial{Rgb(0.0f)}},
                     {"grey", LambertMaterial{grey(kAlbedo)}}};
  return scene;
}

std::uint32_t add_material(SceneDescription& scene, MaterialDescription material) {
  scene.materials.push_back(std::move(material));
  return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

void add_shape(SceneDescription& scene, Shape shape, double radiance, bool two_sided,
               std::uint32_t material) {
  ShapeDescription description;
  description.name = "shape" + std::to_string(scene.shapes.size());
  description.material = material;
  description.shape = std::move(shape);
  if (radiance > 0) description.emission = EmissionDescription{grey(radiance), two_sided};
  scene.shapes.push_back(std::move(description));
}

void add_rectangle(SceneDescription& scene, const RectangleShape& shape, double radiance,
                   bool two_sided, std::uint32_t material) {
  add_shape(scene, shape, radiance, two_sided, material);
}

void add_floor(SceneDescription& scene, double half, std::uint32_t material) {
  add_rectangle(scene, {{-half, -half, 0}, {2 * half, 0, 0}, {0, 2 * half, 0}}, 0, false, material);
}

RectangleShape facing_down(double x0, double x1, double y0, double y1, double z) {
  return {{x0, y0, z}, {0, y1 - y0, 0}, {x1 - x0, 0, 0}};
}

TriangleMeshShape box(const Vec3d& low, const Vec3d& high) {
  TriangleMeshShape mesh;
  for (unsigned i = 0; i < 8; ++i) {
    mesh.vertices.emplace_back((i & 1u) != 0 ? high.x : low.x, (i & 2u) != 0 ? high.y : low.y,
                               (i & 4u) != 0 ? high.z : low.z);
  }
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kFaces{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& f : kFaces) {
    mesh.triangles.push_back({f[0], f[1], f[2]});
    mesh.triangles.push_back({f[0], f[2], f[3]});
  }
  return mesh;
}

EnvironmentDescription white_sky() {
  EnvironmentDescription sky;
  sky.texels = {Rgb(1.0f)};
  return sky;
}

void add_extent(SceneDescription& scene, double half) {
  const double size = 1e-6 * half;
  add_rectangle(scene, {Vec3d(half), {size, 0, 0}, {0, size, 0}}, 0);
  add_rectangle(scene, {Vec3d(-half), {size, 0, 0}, {0, size, 0}}, 0);
}

StabilityStep in_air(const SceneDescription& scene, const Vec3d& position, const Vec3d& normal,
                     const Vec3d& wo, std::uint32_t material) {
  StabilityStep step;
  step.scene = std::make_unique<Scene>(scene);
  ShadingPoint point;
  point.position = Vec3(scene_position(*step.scene, position));
  point.geometric_normal = Vec3(normal.normalized());
  point.shading_normal = point.geometric_normal;
  point.wo = Vec3(wo.normalized());
  point.material = material;
  step.points.assign(kTilePoints, point);
  return step;
}

StabilityStep in_air(const SceneDescription& scene, const Vec3d& position, const Vec3d& normal) {
  return in_air(scene, position, normal, normal);
}

StabilityStep on_surface(const SceneDescription& scene, const std::vector<View>& views,
                         double distance) {
  PN_CHECK(!views.empty() && kTilePoints % views.size() == 0, "views fill the tile evenly");
  StabilityStep step;
  step.scene = std::make_unique<Scene>(scene);
  RayBatch rays(views.size());
  for (const View& view : views) {
    const Vec3d origin = scene_position(*step.scene, view.position + view.wo * distance);
    rays.add(Vec3(origin), Vec3(-view.wo));
  }
  step.scene->intersect(rays);
  for (std::size_t i = 0; i < views.size(); ++i) {
    PN_CHECK(rays.hits[i].hit(), "a view meets its surface");
    const ShadingPoint point =
        step.scene->shading_point(rays.hits[i], rays.origin(i), rays.direction(i));
    PN_CHECK(point.valid() && point.light == kNoLight, "a view meets a surface that reflects");
    step.points.insert(step.points.end(), kTilePoints / views.size(), point);
  }
  return step;
}

double irradiance_of(const Light& light, const ShadingPoint& point) {
  const Vec3d from(point.position);
  const Vec3d normal(point.shading_normal);
  const auto radiance = static_cast<double>(light.radiance.x);
  if (light.type == LightType::Sphere) {
    return radiance *
           sphere_irradiance(Vec3d(light.center), static_cast<double>(light.radius), from, normal);
  }
  PN_CHECK(light.type == LightType::Rectangle, "a rectangle or a sphere");
  return radiance * polygon_irradiance(corners_of(light), from, normal);
}

double irradiance_of_all(const StabilityStep& step, const ShadingPoint& point) {
  double sum = 0;
  for (const Light& light : step.scene->lights()) sum += irradiance_of(light, point);
  return sum;
}

double irradiance_of_polygon(const Scene& scene, const std::vector<Vec3d>& corners,
                             const ShadingPoint& point) {
  std::vector<Vec3d> placed;
  for (const Vec3d& corner : corners) placed.push_back(scene_position(scene, corner));
  return polygon_irradiance(placed, Vec3d(point.position), Vec3d(point.shading_normal));
}

}  // namespace penumbra::stability
