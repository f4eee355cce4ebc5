#include "tests/conformance/idle_scenes.h"

#include "tests/support/scenes_support.h"

namespace penumbra::conformance {
namespace {

SceneDescription base(std::string name) {
  SceneDescription scene;
  scene.name = std::move(name);
  // Low enough to see the underside of the roof.
  scene.camera = {{0.2, 0.9, 5.0}, {0.0, 0.9, 0.0}, {0.0, 1.0, 0.0}, 45.0, {kSide, kSide}};
  scene.materials = {test::lambert(0.6f), {"mirror", MirrorMaterial{Rgb(0.8f, 0.7f, 0.6f)}}};
  scene.shapes = {test::shape("floor", RectangleShape{{-4, 0, 4}, {8, 0, 0}, {0, 0, -8}})};
  return scene;
}

// Normal -y, or +y where `up`.
RectangleShape level(const Vec3d& origin, double width, double depth, bool up = false) {
  const Vec3d u(width, 0, 0);
  const Vec3d v(0, 0, depth);
  return up ? RectangleShape{origin, v, u} : RectangleShape{origin, u, v};
}

SceneDescription idle() {
  SceneDescription scene = base("conformance idle");
  EnvironmentDescription sky;
  sky.columns = 4;
  sky.rows = 2;
  sky.texels.assign(8, Rgb(0.4f, 0.5f, 0.7f));
  sky.texels[2] = Rgb(1.5f, 1.2f, 1.0f);
  for (std::size_t i = 4; i < 8; ++i) sky.texels[i] = Rgb(0.0f);
  scene.environment = sky;
  scene.point_lights = {{"bulb", {1.5, 1.0, 1.0}, Rgb(0.8f)}};
  const RectangleShape astride{{-4.3, -0.4, -1.0}, {0, 1.0, 0}, {0, 0, 1.4}};  // normal +x
  scene.shapes.insert(
      scene.shapes.end(),
      {test::shape("roof", level({-1.6, 1.6, -1.6}, 3.2, 1.8)),
       test::shape("ball", SphereShape{{-1.1, 0.5, 0.4}, 0.5}, 1),
       test::shape("stone", test::sphere_mesh({1.0, 0.45, 0.3}, 0.45, 5, 8)),
       test::light("panel", level({-1.2, 2.6, 0.6}, 1.4, 1.0), Rgb(3.0f, 2.5f, 2.0f)),
       test::light("turned", level({0.6, 2.2, 0.9}, 1.0, 0.8, true), Rgb(5.0f)),
       test::light("cellar", level({-1.0, -0.6, -1.0}, 1.0, 1.0, true), Rgb(4.0f)),
       test::light("astride", astride, Rgb(4.0f, 3.0f, 2.0f))});
  return scene;
}

SceneDescription deltas() {
  SceneDescription scene = base("conformance deltas");
  scene.shapes.push_back(test::shape("ball", SphereShape{{-0.6, 0.6, 0.2}, 0.6}));
  scene.shapes.push_back(test::shape("mirror", SphereShape{{1.0, 0.5, 0.5}, 0.5}, 1));
  scene.point_lights = {{"bulb", {1.2, 2.5, 1.5}, Rgb(2.0f, 1.5f, 1.0f)}};
  scene.spot_lights = {{"spot", {-1.5, 2.0, 0.5}, {1.5, -2.0, 0.1}, Vec3d(4.0), 5, 25}};
  scene.directional_lights = {{"sun", {0.5, -1.0, -0.4}, Rgb(0.6f, 0.5f, 0.4f)}};
  return scene;
}

SceneDescription open() {
  SceneDescription scene = base("conformance open");
  scene.materials[0].model = PhongMaterial{Rgb(0.3f), Rgb(0.4f), 20.0f};
  scene.camera.position = {0.2, 2.5, 5.0};
  scene.camera.look_at = {0.0, 0.0, 0.0};
  scene.shapes.push_back(test::light("panel", level({-1.8, 2.0, -1.6}, 1.5, 1.5), Rgb(3.0f)));
  scene.shapes.push_back(test::light("lamp", SphereShape{{1.2, 1.0, -0.8}, 0.35}, Rgb(6.0f, 5, 3)));
  return scene;
}

}  // namespace

std::vector<NamedDescription> idle_descriptions() {
  return {{"idle", idle(), 2}, {"deltas", deltas(), 1}, {"open", open(), 1}};
}

}  // namespace penumbra::conformance
