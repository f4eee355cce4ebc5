#include "tests/conformance/test_scenes.h"

#include "scenes/core/scene_description.h"
#include "tests/support/scenes_support.h"

namespace penumbra::conformance {
namespace {

constexpr std::uint64_t kPointSeed = 1;
constexpr int kTileSide = 16;

SceneDescription base(std::string name) {
  SceneDescription scene;
  scene.name = std::move(name);
  scene.camera = {{0.4, 3.2, 4.6}, {0.0, 0.3, 0.0}, {0.0, 1.0, 0.0}, 42.0, {kSide, kSide}};
  return scene;
}

// Normal +y.
RectangleShape floor_shape() { return {{-4, 0, 4}, {8, 0, 0}, {0, 0, -8}}; }

// Normal -y.
RectangleShape ceiling(const Vec3d& origin, double width, double depth) {
  return {origin, {width, 0, 0}, {0, 0, depth}};
}

SceneDescription diffuse() {
  SceneDescription scene = base("conformance diffuse");
  scene.materials = {{"clay", LambertMaterial{Rgb(0.7f, 0.5f, 0.4f)}}, test::lambert(0.6f)};
  scene.shapes = {
      test::shape("floor", floor_shape()),
      test::shape("ball", SphereShape{{-0.6, 0.6, 0.2}, 0.45}, 1),
      test::shape("board", ceiling({0.3, 1.0, -0.5}, 0.8, 0.8), 1),
      test::light("panel", ceiling({-1.8, 2.6, -1.6}, 2.0, 2.0), Rgb(3.0f, 3.0f, 2.5f)),
      test::light("window", ceiling({0.7, 1.9, -0.3}, 0.9, 0.7), Rgb(5.0f, 6.0f, 8.0f))};
  return scene;
}

SceneDescription glossy() {
  SceneDescription scene = base("conformance glossy");
  scene.materials = {{"varnish", PhongMaterial{Rgb(0.15f), Rgb(0.55f, 0.5f, 0.45f), 30.0f}},
                     {"metal", ConductorMaterial{}}};
  scene.shapes = {
      test::shape("floor", floor_shape()),
      test::shape("ball", SphereShape{{-0.9, 0.55, -0.3}, 0.55}, 1),
      test::shape("board", ceiling({-0.3, 0.7, 0.4}, 0.6, 0.5), 1),
      test::light("panel", ceiling({-1.5, 2.4, -2.2}, 1.6, 1.4), Rgb(2.0f, 2.5f, 3.0f)),
      test::light("lamp", SphereShape{{1.2, 1.2, -0.6}, 0.4}, Rgb(6.0f, 5.0f, 3.0f)),
      test::light("crystal", test::tetrahedron_mesh({0.2, 1.5, -1.5}, 0.6), Rgb(2.0f, 4.0f, 2.0f))};
  return scene;
}

SceneDescription sky() {
  SceneDescription scene = base("conformance sky");
  MixtureMaterial coated;
  coated.diffuse.reflectance = Rgb(0.3f, 0.4f, 0.6f);
  coated.glossy.alpha = 0.3f;
  scene.materials = {{"sand", LambertMaterial{Rgb(0.6f, 0.55f, 0.4f)}},
                     {"coated", coated},
                     {"plastic", MetallicRoughnessMaterial{Rgb(0.5f, 0.3f, 0.2f), 0.1f, 0.5f}}};
  EnvironmentDescription environment;
  environment.columns = 8;
  environment.rows = 4;
  environment.texels.assign(32, Rgb(0.3f, 0.4f, 0.6f));
  environment.texels[10] = Rgb(6.0f, 5.0f, 4.0f);  // a bright patch above the horizon
  for (std::size_t i = 24; i < 32; ++i) environment.texels[i] = Rgb(0.0f);
  scene.environment = environment;
  scene.point_lights = {{"bulb", {1.2, 1.5, 0.5}, Rgb(2.0f, 1.5f, 1.0f)}};
  scene.spot_lights = {{"spot", {-1.5, 2.0, 0.5}, {1.5, -2.0, 0.1}, Vec3d(4.0), 5, 25}};
  scene.directional_lights = {{"sun", {0.5, -1.0, -0.4}, Rgb(0.6f, 0.5f, 0.4f)}};
  scene.shapes = {test::shape("floor", floor_shape()),
                  test::shape("ball", SphereShape{{-0.5, 0.6, 0.0}, 0.6}, 1),
                  test::shape("board", ceiling({0.4, 0.9, -0.2}, 0.7, 0.6), 2),
                  test::light("lantern", test::sphere_mesh({1.5, 0.9, -1.2}, 0.3, 8, 10),
                              Rgb(1.5f, 1.0f, 0.5f)),
                  test::light("panel", ceiling({-1.4, 2.4, -1.8}, 1.2, 1.2), Rgb(4.0f))};
  return scene;
}

}  // namespace

std::unique_ptr<TestScene> load(std::string name, const SceneDescription& description, int spp,
                                const SceneOptions& options) {
  auto result = std::unique_ptr<TestScene>(
      new TestScene{std::move(name), Scene(description, options), {}, spp});
  result->points = make_shading_points(result->scene, 1, kPointSeed, kTileSide);
  return result;
}

std::vector<NamedDescription> test_descriptions() {
  return {{"diffuse", diffuse(), 2}, {"glossy", glossy(), 3}, {"sky", sky(), 2}};
}

const std::vector<std::unique_ptr<TestScene>>& test_scenes() {
  static const std::vector<std::unique_ptr<TestScene>> scenes = [] {
    std::vector<std::unique_ptr<TestScene>> result;
    for (const NamedDescription& scene : test_descriptions()) {
      result.push_back(load(scene.name, scene.description, scene.spp));
    }
    return result;
  }();
  return scenes;
}

}  // namespace penumbra::conformance
