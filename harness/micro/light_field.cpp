#include "harness/micro/light_field.h"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace penumbra::micro {
namespace {

constexpr double kHeight = 2.0;
constexpr double kHalfSide = 2.0;

void add_light(SceneDescription& scene, std::string name, const Shape& shape) {
  ShapeDescription light;
  light.name = std::move(name);
  light.shape = shape;
  light.emission = EmissionDescription{};
  scene.shapes.push_back(light);
}

}  // namespace

SceneDescription floor_scene() {
  SceneDescription scene;
  scene.name = "micro";
  scene.camera.position = Vec3d(0.0, -4.0, 1.0);
  scene.camera.look_at = Vec3d(0.0);
  scene.camera.up = Vec3d(0.0, 0.0, 1.0);
  scene.camera.resolution = {16, 16};
  scene.materials.push_back({"floor", LambertMaterial{Rgb(0.5f)}});
  ShapeDescription floor;
  floor.name = "floor";
  floor.shape = RectangleShape{Vec3d(-4.0, -4.0, 0.0), Vec3d(8.0, 0.0, 0.0), Vec3d(0.0, 8.0, 0.0)};
  scene.shapes.push_back(floor);
  return scene;
}

LightField finish_scene(SceneDescription description) {
  LightField field;
  field.scene = std::make_unique<Scene>(std::move(description));
  const SceneTraits& traits = field.scene->traits();
  const Vec3 up(0.0f, 0.0f, 1.0f);
  field.point.position = offset_ray_origin(Vec3((Vec3d(0.0) - traits.center) * traits.scale), up);
  field.point.geometric_normal = up;
  field.point.shading_normal = up;
  field.point.wo = Vec3(0.6f, 0.0f, 0.8f);
  field.point.material = 0;
  return field;
}

LightField make_light_field(int lights) {
  SceneDescription scene = floor_scene();
  const int columns = static_cast<int>(std::ceil(std::sqrt(lights)));
  const double cell = 2.0 * kHalfSide / columns;
  for (int i = 0; i < lights; ++i) {
    const Vec3d corner(-kHalfSide + (i % columns + 0.25) * cell,
                       -kHalfSide + (i / columns + 0.25) * cell, kHeight);
    add_light(scene, "light_" + std::to_string(i),
              RectangleShape{corner, Vec3d(0.0, 0.5 * cell, 0.0), Vec3d(0.5 * cell, 0.0, 0.0)});
  }
  return finish_scene(std::move(scene));
}

LightField make_single_light(const Shape& shape) {
  SceneDescription scene = floor_scene();
  add_light(scene, "light", shape);
  return finish_scene(std::move(scene));
}

LightField make_sky() {
  SceneDescription scene = floor_scene();
  EnvironmentDescription sky;
  sky.columns = 64;
  sky.rows = 32;
  for (std::uint32_t i = 0; i < sky.columns * sky.rows; ++i) {
    sky.texels.emplace_back(1.0f + 0.5f * std::sin(static_cast<float>(i)));
  }
  scene.environment = std::move(sky);
  return finish_scene(std::move(scene));
}

TriangleMeshShape sphere_mesh(int rings) {
  TriangleMeshShape mesh;
  const Vec3d center(0.3, 0.2, 2.0);
  const double radius = 0.5;
  const int segments = 2 * rings;
  mesh.vertices.push_back(center + Vec3d(0.0, 0.0, radius));
  for (int ring = 1; ring < rings; ++ring) {
    const double theta = std::numbers::pi * ring / rings;
    for (int s = 0; s < segments; ++s) {
      const double phi = 2.0 * std::numbers::pi * s / segments;
      mesh.vertices.push_back(center + Vec3d(std::sin(theta) * std::cos(phi),
                                             std::sin(theta) * std::sin(phi), std::cos(theta)) *
                                           radius);
    }
  }
  mesh.vertices.push_back(center - Vec3d(0.0, 0.0, radius));
  const auto last = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  // Vertex s of a ring, counted from 1.
  const auto at = [&](int ring, int s) {
    return static_cast<std::uint32_t>(1 + (ring - 1) * segments + s % segments);
  };
  for (int s = 0; s < segments; ++s) {
    mesh.triangles.push_back({0, at(1, s), at(1, s + 1)});
    mesh.triangles.push_back({last, at(rings - 1, s + 1), at(rings - 1, s)});
    for (int ring = 1; ring + 1 < rings; ++ring) {
      mesh.triangles.push_back({at(ring, s), at(ring + 1, s), at(ring + 1, s + 1)});
      mesh.triangles.push_back({at(ring, s), at(ring + 1, s + 1), at(ring, s + 1)});
    }
  }
  return mesh;
}

}  // namespace penumbra::micro
