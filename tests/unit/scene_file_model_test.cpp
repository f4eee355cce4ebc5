#include "scenes/core/scene_file_model.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "scenes/core/error.h"
#include "scenes/core/mesh_placement.h"
#include "scenes/core/scene.h"
#include "scenes/core/scene_file.h"

namespace penumbra {
namespace {

using nlohmann::json;

/// Folder with a scene file's models; PENUMBRA_MODELS is unset before and after.
class SceneFileModel : public testing::Test {
 protected:
  SceneFileModel()
      : folder_(std::filesystem::path(testing::TempDir()) /
                ("penumbra-scene-model-" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
    unsetenv(kModelsVariable);
    // A prism of four times two times one, two parts that do not touch; y is up.
    write("wedge.obj",
          "v 1 1 1\nv 5 1 1\nv 1 3 1\nv 1 1 2\n"
          "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
          "o other\nv 4 1 2\nv 5 1 2\nv 4 2 2\nf 5 6 7\n");
    write("cube.obj",
          "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
          "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n");
  }
  ~SceneFileModel() override {
    unsetenv(kModelsVariable);
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }

  /// A scene of one model with these keys added.
  static json scene_of(const json& keys) {
    json scene = json::parse(R"({
      "format": "penumbra-scene", "version": 1, "name": "model",
      "camera": {"position": [0, 1, 5], "look_at": [0, 0, 0]},
      "materials": {"grey": {"type": "lambert", "reflectance": 0.5}},
      "shapes": [{"name": "thing", "type": "model", "material": "grey"}]})");
    scene["shapes"][0].update(keys);
    return scene;
  }
  SceneDescription load(const json& keys) const {
    write("scene.json", scene_of(keys).dump(1));
    return load_scene_description(folder_ / "scene.json");
  }
  TriangleMeshShape mesh(const json& keys) const {
    return std::get<TriangleMeshShape>(load(keys).shapes.at(0).shape);
  }
  /// The error's text; empty where there is none.
  std::string error(const json& keys) const {
    try {
      load(keys);
    } catch (const InputError& fault) {
      return fault.what();
    }
    return "";
  }

  std::filesystem::path folder_;
};

struct Box {
  Vec3d low{std::numeric_limits<double>::infinity()};
  Vec3d high{-std::numeric_limits<double>::infinity()};
};

Box bounds(const std::vector<Vec3d>& vertices) {
  Box box;
  for (const Vec3d& v : vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], v[axis]);
      box.high[axis] = std::max(box.high[axis], v[axis]);
    }
  }
  return box;
}

TEST_F(SceneFileModel, JoinsTheMeshesOfAFileAndKeepsItsCoordinates) {
  const SceneDescription scene = load({{"file", "wedge.obj"}});
  const auto& mesh = std::get<TriangleMeshShape>(scene.shapes.at(0).shape);
  EXPECT_EQ(mesh.vertices.size(), 7u);
  EXPECT_EQ(mesh.triangles.size(), 5u);
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_EQ(bounds(mesh.vertices).low, Vec3d(1, 1, 1));
  EXPECT_EQ(bounds(mesh.vertices).high, Vec3d(5, 3, 2));
  EXPECT_EQ(scene.materials.at(scene.shapes[0].material).name, "grey");
  EXPECT_EQ(scene.geometry, "own");
}

// The shape has a material of its own: what is wrong with the file's is of no interest.
TEST_F(SceneFileModel, WarnsOfTheMeshesOfAFileOnly) {
  write("odd.obj",
        "mtllib missing.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nusemtl none\nf 1 2 3\nf 1 4 2\n");
  const SceneDescription scene = load({{"file", "odd.obj"}});
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("1 of 2"), std::string::npos) << scene.warnings[0];
}

TEST_F(SceneFileModel, PlacesTheBaseOfTheBoundingBox) {
  const Box box =
      bounds(mesh({{"file", "wedge.obj"}, {"place", {{"height", 4}, {"position", {10, 1, -2}}}}})
                 .vertices);
  EXPECT_LT((box.low - Vec3d(6, 1, -3)).length(), 1e-12);
  EXPECT_LT((box.high - Vec3d(14, 5, -1)).length(), 1e-12);
}

TEST_F(SceneFileModel, RotatesAboutXThenYThenZ) {
  // About x, y becomes z and z becomes -y: 4 x 1 x 2. About y, z becomes x: 2 x 1 x 4.
  const TriangleMeshShape placed =
      mesh({{"file", "wedge.obj"}, {"place", {{"scale", 2}, {"rotate_deg", {90, 90, 0}}}}});
  const Box box = bounds(placed.vertices);
  EXPECT_LT((box.high - box.low - Vec3d(4, 2, 8)).length(), 1e-12);
}

TEST_F(SceneFileModel, SmoothGivesAreaWeightedUnitNormals) {
  const TriangleMeshShape cube = mesh({{"file", "cube.obj"}, {"smooth", true}});
  ASSERT_EQ(cube.normals.size(), 8u);
  for (std::size_t v = 0; v < 8; ++v) {
    EXPECT_NEAR(cube.normals[v].length(), 1.0f, 1e-6f);
    const Vec3d outward = cube.vertices[v] - Vec3d(0.5);
    EXPECT_GT(Vec3d(cube.normals[v]).dot(outward.normalized()), 0.8) << v;
  }
}

TEST_F(SceneFileModel, SubdivideTakesTheFileAsACage) {
  const SceneDescription scene =
      load({{"file", "cube.obj"}, {"subdivide", 8}, {"place", {{"height", 2}}}});
  const auto& cage = std::get<SubdivisionShape>(scene.shapes.at(0).shape);
  EXPECT_EQ(cage.level, 8);
  EXPECT_EQ(cage.face_sizes, std::vector<std::uint32_t>(6, 4));
  EXPECT_EQ(bounds(cage.vertices).low, Vec3d(-1, 0, -1));
  EXPECT_EQ(bounds(cage.vertices).high, Vec3d(1, 2, 1));
  EXPECT_EQ(Scene(scene).traits().triangles, 6u * 64u * 2u);
}

TEST_F(SceneFileModel, GeneratesUnlessTheVariableNamesAFolder) {
  const json keys = {{"generate", "lantern"},
                     {"detail", 0.2},
                     {"instead", {{"file", "cube.obj"}, {"rotate_deg", {0, 0, 90}}}},
                     {"place", {{"height", 3}}}};
  const SceneDescription generated = load(keys);
  EXPECT_EQ(generated.geometry, "generated");
  const auto& made = std::get<TriangleMeshShape>(generated.shapes.at(0).shape);
  EXPECT_GT(made.triangles.size(), 5000u);
  EXPECT_EQ(made.normals.size(), made.vertices.size());
  EXPECT_NEAR(bounds(made.vertices).high.y, 3.0, 1e-12);

  setenv(kModelsVariable, "", 1);
  EXPECT_EQ(load(keys).geometry, "generated") << "empty is not set";

  setenv(kModelsVariable, folder_.c_str(), 1);
  const SceneDescription real = load(keys);
  EXPECT_EQ(real.geometry, "models");
  const auto& cube = std::get<TriangleMeshShape>(real.shapes.at(0).shape);
  EXPECT_EQ(cube.triangles.size(), 12u);
  EXPECT_LT((bounds(cube.vertices).high - Vec3d(1.5, 3, 1.5)).length(), 1e-12);
}

TEST_F(SceneFileModel, AMissingRealModelIsAnErrorThatNamesVariableAndFile) {
  setenv(kModelsVariable, folder_.c_str(), 1);
  const std::string text = error({{"generate", "statue"}, {"instead", "missing.obj"}});
  EXPECT_NE(text.find("/shapes/0/instead: PENUMBRA_MODELS is set to \"" + folder_.string() + "\""),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("\"missing.obj\""), std::string::npos) << text;
  unsetenv(kModelsVariable);
  EXPECT_EQ(error({{"generate", "high_genus"}, {"detail", 0.1}, {"instead", "missing.obj"}}), "");
}

TEST_F(SceneFileModel, AFileThatCannotBeReadIsAnErrorAtItsPlace) {
  EXPECT_NE(error({{"file", "missing.obj"}}).find("scene.json:"), std::string::npos);
  EXPECT_NE(error({{"file", "missing.obj"}}).find("/shapes/0/file: "), std::string::npos);
  EXPECT_NE(error({{"file", "missing.obj"}}).find("missing.obj"), std::string::npos);
}

TEST_F(SceneFileModel, KeysThatExcludeEachOtherAreErrors) {
  const auto expect = [&](const json& keys, const std::string& message) {
    EXPECT_NE(error(keys).find(message), std::string::npos) << keys << "\n" << error(keys);
  };
  expect(json::object(), "/shapes/0: expected either \"generate\" or \"file\", found neither");
  expect({{"file", "cube.obj"}, {"generate", "statue"}}, "found both");
  expect({{"file", "cube.obj"}, {"detail", 0.5}}, "/shapes/0/detail: ");
  expect({{"file", "cube.obj"}, {"instead", "cube.obj"}}, "/shapes/0/instead: ");
  expect({{"generate", "statue"}, {"subdivide", 2}}, "/shapes/0/subdivide: ");
  expect({{"generate", "statue"}, {"smooth", true}}, "/shapes/0/smooth: ");
  expect({{"file", "cube.obj"}, {"subdivide", 2}, {"smooth", true}}, "/shapes/0/smooth: ");
  expect({{"file", "cube.obj"}, {"subdivide", 2}, {"emission", {{"radiance", 1}}}},
         "/shapes/0/emission: ");
  expect({{"file", "cube.obj"}, {"place", {{"height", 1}, {"scale", 1}}}},
         "/shapes/0/place: expected \"height\" or \"scale\", found both");
  expect({{"generate", "dragon"}}, "/shapes/0/generate: ");
  expect({{"file", "cube.obj"}, {"subdivide", 65}}, "/shapes/0/subdivide: ");
  expect({{"generate", "statue"}, {"detail", 5}}, "/shapes/0/detail: ");
}

TEST_F(SceneFileModel, AHeightOfAFlatModelIsAnError) {
  write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n");
  EXPECT_NE(error({{"file", "flat.obj"}, {"place", {{"height", 1}}}}).find("/shapes/0/place: "),
            std::string::npos);
  EXPECT_EQ(error({{"file", "flat.obj"}, {"place", {{"scale", 2}}}}), "");
}

TEST_F(SceneFileModel, SummariesAreReadWithoutTheModel) {
  const json scene = scene_of({{"file", "missing.obj"}});
  write("scene.json", scene.dump(1));
  const SceneSummary summary = read_scene_summary(folder_ / "scene.json");
  EXPECT_EQ(summary.name, "model");
  EXPECT_EQ(summary.shapes, 1u);
  EXPECT_EQ(summary.resolution, (std::array<int, 2>{480, 270}));
  for (const char* const key : {"name", "camera"}) {
    json broken = scene;
    broken[key] = 3;
    write("scene.json", broken.dump(1));
    EXPECT_THROW(read_scene_summary(folder_ / "scene.json"), InputError) << key;
  }
}

TEST_F(SceneFileModel, AMeshCanBeALight) {
  const Scene scene(load({{"file", "cube.obj"}, {"emission", {{"radiance", 2}}}}));
  EXPECT_EQ(scene.traits().mesh_lights, 1u);
}

TEST(MeshPlacement, RotationsAreRightHandedAboutXThenYThenZ) {
  TriangleMeshShape mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.normals = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  ModelPlacement placement;
  placement.rotations_deg = {{90, 90, 0}, {0, 0, 90}};
  ASSERT_TRUE(place_mesh(mesh, placement));
  // About x: x, z, -y. About y: -z, x, -y. About z: -z, y, x.
  const Vec3d expected[] = {{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, {1, 0, 0}};
  for (std::size_t v = 1; v < 4; ++v) {
    EXPECT_LT((mesh.vertices[v] - expected[v]).length(), 1e-12) << v;
    EXPECT_LT((mesh.normals[v] - Vec3(expected[v])).length(), 1e-6f) << v;
  }
}

TEST(MeshPlacement, UnusableNormalsAreCountedAndDropped) {
  TriangleMeshShape mesh;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  mesh.normals = {{0, 0, 1}, {nan, 0, 1}, {0, 0, 0}, {0, 2, 0}};
  EXPECT_EQ(drop_unusable_normals(mesh), 2u);
  EXPECT_EQ(mesh.normals[1], Vec3(0.0f));
  EXPECT_EQ(mesh.normals[3], Vec3(0, 2, 0));
}

TEST(MeshPlacement, JoinedMeshesHaveNormalsOnlyWhereTheyCame) {
  TriangleMeshShape with;
  with.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  with.triangles = {{0, 1, 2}};
  TriangleMeshShape without = with;
  with.normals.assign(3, Vec3(0, 0, 1));
  append_mesh(without, with);
  ASSERT_EQ(without.normals.size(), 6u);
  EXPECT_EQ(without.normals[2], Vec3(0.0f));
  EXPECT_EQ(without.normals[3], Vec3(0, 0, 1));
  EXPECT_EQ(without.triangles[1], (std::array<std::uint32_t, 3>{3, 4, 5}));
  EXPECT_TRUE(without.uvs.empty());
  append_mesh(with, with);
  EXPECT_EQ(with.vertices.size(), 6u);
}

}  // namespace
}  // namespace penumbra
