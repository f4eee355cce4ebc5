#include "scenes/core/models/model_scene.h"

#include <algorithm>
#include <fstream>

#include "scenes/core/camera.h"
#include "scenes/core/module.h"
#include "scenes/core/scene.h"
#include "scenes/core/scene_file.h"
#include "tests/models/model_fixture.h"

namespace penumbra {
namespace {

constexpr const char* kTent =
    "v -1 0 0\nv 1 0 0\nv 1 0 -4\nv -1 0 -4\nv 0 2 -2\no tent\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 "
    "5\n";

bool warns(const SceneDescription& scene, const std::string& text) {
  return std::any_of(scene.warnings.begin(), scene.warnings.end(),
                     [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

TEST(ModelScene, CameraAndLightHaveStatedDefaults) {
  ModelFiles files;
  const SceneDescription scene = load_scene_description(files.write("tent.obj", kTent));
  EXPECT_EQ(scene.name, "tent");
  ASSERT_TRUE(scene.environment);
  EXPECT_EQ(scene.environment->texels, std::vector<Rgb>{Rgb(1.0f)});
  EXPECT_TRUE(warns(scene, "no light"));
  EXPECT_TRUE(warns(scene, "no camera"));
  EXPECT_GT(scene.camera.position.y, scene.camera.look_at.y);
  EXPECT_NO_THROW(Scene{scene});
}

TEST(ModelScene, DefaultCameraSeesEveryVertex) {
  ModelFiles files;
  const SceneDescription scene = load_scene_description(files.write("tent.obj", kTent));
  const CameraDescription& camera = scene.camera;
  const Vec3d view = (camera.look_at - camera.position).normalized();
  const Vec3d right = view.cross(camera.up).normalized();
  const Vec3d up = right.cross(view);
  const double half_height = std::tan(camera.vertical_fov_deg * M_PI / 360.0);
  const double aspect = static_cast<double>(camera.resolution[0]) / camera.resolution[1];
  double largest = 0.0;  // share of the picture's half width or height
  for (const Vec3d& vertex : std::get<TriangleMeshShape>(scene.shapes.at(0).shape).vertices) {
    const Vec3d d = vertex - camera.position;
    ASSERT_GT(d.dot(view), 0.0);
    EXPECT_LT(std::abs(d.dot(up)), half_height * d.dot(view));
    EXPECT_LT(std::abs(d.dot(right)), aspect * half_height * d.dot(view));
    largest = std::max({largest, std::abs(d.dot(up)) / (half_height * d.dot(view)),
                        std::abs(d.dot(right)) / (aspect * half_height * d.dot(view))});
  }
  EXPECT_GT(largest, 0.6) << "the model is a speck in the picture";
}

TEST(ModelScene, LightsOfTheFileSuffice) {
  ModelFiles files;
  files.write("m.mtl", "newmtl lamp\nKe 1 1 1\n");
  const SceneDescription scene = load_scene_description(
      files.write("tent.obj", std::string("mtllib m.mtl\nusemtl lamp\n") + kTent));
  EXPECT_FALSE(scene.environment);
  EXPECT_FALSE(warns(scene, "no light"));
}

std::filesystem::path write_scene(const ModelFiles& files, const std::string& more) {
  return files.write("scene.json",
                     R"({"format": "penumbra-scene", "version": 1, "name": "s",
                         "camera": {"position": [0, 1, 5], "look_at": [0, 0, 0]})" +
                         more + "}");
}

constexpr const char* kOwnShape =
    R"(, "materials": {"m": {"type": "lambert", "reflectance": 0.75}},
        "shapes": [{"type": "sphere", "name": "tent", "material": "m", "center": [0, 5, 0],
                    "radius": 1, "emission": {"radiance": 1}}])";

TEST(SceneInclude, ModelsJoinASceneUnderNamesOfTheirOwn) {
  ModelFiles files;
  files.write("m.mtl", "newmtl m\nKd 0.25 0.25 0.25\n");
  files.write("camp.obj", std::string("mtllib m.mtl\nusemtl m\n") + kTent);
  const SceneDescription scene = load_scene_description(write_scene(
      files,
      std::string(kOwnShape) + R"(, "include": [{"file": "camp.obj"}, {"file": "camp.obj"}])"));
  ASSERT_EQ(scene.shapes.size(), 3u);
  EXPECT_EQ(scene.shapes[0].name, "tent");
  EXPECT_EQ(scene.shapes[1].name, "camp.tent");
  EXPECT_EQ(scene.shapes[2].name, "camp.tent.2");
  ASSERT_EQ(scene.materials.size(), 3u);
  EXPECT_EQ(scene.materials[1].name, "camp.m");
  EXPECT_EQ(scene.shapes[1].material, 1u);
  EXPECT_EQ(std::get<LambertMaterial>(scene.materials[1].model).reflectance, Rgb(0.25f));
  EXPECT_EQ(scene.camera.position, Vec3d(0, 1, 5));
  EXPECT_NO_THROW(Scene{scene});
}

TEST(SceneInclude, ASceneMayConsistOfModelsAlone) {
  ModelFiles files;
  files.write("camp.obj", kTent);
  const SceneDescription scene =
      load_scene_description(write_scene(files, R"(, "include": [{"file": "camp.obj"}])"));
  EXPECT_EQ(scene.shapes.size(), 1u);
}

TEST(SceneInclude, FaultsNameTheSceneFileAndTheModelFile) {
  ModelFiles files;
  files.write("camp.obj", "v 0 0 0\nf 1 2 3\n");
  const auto file =
      write_scene(files, R"(, "include": [{"file": "camp.obj"}, {"file": "gone.ply"}])");
  try {
    load_scene_description(file);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("scene.json:"), std::string::npos) << text;
    EXPECT_NE(text.find("/include/0/file"), std::string::npos) << text;
    EXPECT_NE(text.find("camp.obj:2: error: vertex 2 does not exist"), std::string::npos) << text;
    EXPECT_NE(text.find("/include/1/file"), std::string::npos) << text;
    EXPECT_NE(text.find("gone.ply"), std::string::npos) << text;
  }
}

TEST(SceneInclude, WithoutItMaterialsAndShapesAreRequired) {
  ModelFiles files;
  try {
    load_scene_description(write_scene(files, ""));
    FAIL() << "accepted";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("missing key \"materials\""), std::string::npos) << text;
    EXPECT_NE(text.find("missing key \"shapes\""), std::string::npos) << text;
  }
}

bool maps(const std::string& library) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    if (line.find(library) != std::string::npos) return true;
  }
  return false;
}

// In a process of its own, because another test may have opened the module.
TEST(ModelModuleDeathTest, IsOpenedByTheFirstModelFileAndNotBefore) {
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  ModelFiles files;
  const auto scene = write_scene(files, kOwnShape);
  const auto model = files.write("tent.obj", kTent);
  EXPECT_EXIT(
      {
        load_scene_description(scene);
        const bool before = module_is_open("models") || maps("libassimp") || maps("libtinygltf");
        load_scene_description(model);
        const bool after = module_is_open("models") && maps("libassimp") && maps("libtinygltf");
        std::_Exit(!before && after ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace penumbra
