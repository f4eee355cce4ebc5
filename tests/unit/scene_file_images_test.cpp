// The images that scene files name: textures, masks and environments.

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "scenes/core/error.h"
#include "scenes/core/normalise.h"
#include "scenes/core/scene_file.h"
#include "tests/support/image_files.h"

namespace penumbra {
namespace {

using nlohmann::json;
using test::ImageFolder;

class SceneFileImages : public testing::Test {
 protected:
  void SetUp() override {
    test::write_png(folder_ / "a.png", 2, 2, 4, std::vector<std::uint16_t>(16, 255));
    scene_ = json::parse(R"({
      "format": "penumbra-scene", "version": 1, "name": "textured",
      "camera": {"position": [0, 1, 5], "look_at": [0, 0, 0]},
      "materials": {"grey": {"type": "lambert", "reflectance": 0.5,
                             "reflectance_texture": {"file": "a.png", "srgb": true}}},
      "shapes": [{"name": "floor", "type": "rectangle", "origin": [0, 0, 0], "edge_u": [1, 0, 0],
                  "edge_v": [0, 0, -2], "material": "grey"}]
    })");
  }

  SceneDescription load() const {
    test::write_bytes(folder_ / "scene.json", scene_.dump(2));
    return load_scene_description(folder_ / "scene.json");
  }

  /// What is wrong, without the place in the file; all faults, one per line.
  std::string faults() const {
    try {
      load();
    } catch (const InputError& error) {
      const std::string text = error.what();
      const std::string mark = ": error: ";
      EXPECT_TRUE(text.starts_with((folder_ / "scene.json").string() + ":")) << text;
      const std::size_t at = text.find(mark);
      return at == std::string::npos ? text : text.substr(at + mark.size());
    }
    return {};
  }

  json& material() { return scene_["materials"]["grey"]; }

  ImageFolder folder_;
  json scene_;
};

TEST_F(SceneFileImages, ReadsEveryKeyOfTexturesAndMasks) {
  material() = {
      {"type", "mixture"},
      {"diffuse", {{"reflectance", 0.5}}},
      {"glossy", {{"eta", 0.2}, {"k", 3.9}, {"alpha", 0.1}}},
      {"glossy_weight", 0.5},
      {"reflectance_texture", {{"file", "a.png"}, {"srgb", true}, {"wrap", "mirror"}}},
      {"roughness_texture", {{"file", "./a.png"}, {"channel", 2}, {"wrap", {"clamp", "repeat"}}}},
      {"mask", {{"file", "a.png"}, {"channel", 3}, {"cutoff", 0.25}}}};
  const MaterialDescription read = load().materials[0];
  const std::string file = (folder_ / "a.png").string();
  ASSERT_TRUE(read.reflectance_texture && read.roughness_texture && read.mask);
  EXPECT_FALSE(read.metallic_texture);
  EXPECT_EQ(read.reflectance_texture->file, file);
  EXPECT_TRUE(read.reflectance_texture->srgb);
  EXPECT_EQ(read.reflectance_texture->wrap_u, TextureWrap::Mirror);
  EXPECT_EQ(read.reflectance_texture->wrap_v, TextureWrap::Mirror);
  EXPECT_EQ(read.roughness_texture->file, file);
  EXPECT_FALSE(read.roughness_texture->srgb);
  EXPECT_EQ(read.roughness_texture->channel, 2);
  EXPECT_EQ(read.roughness_texture->wrap_u, TextureWrap::Clamp);
  EXPECT_EQ(read.roughness_texture->wrap_v, TextureWrap::Repeat);
  EXPECT_EQ(read.mask->texture.channel, 3);
  EXPECT_EQ(read.mask->cutoff, 0.25f);
}

TEST_F(SceneFileImages, TheBytesOfAnImageDecideTheScenesHash) {
  const std::string before = content_hash(load());
  EXPECT_EQ(content_hash(load()), before);
  test::write_png(folder_ / "a.png", 2, 2, 4, std::vector<std::uint16_t>(16, 254));
  const std::string after = content_hash(load());
  EXPECT_NE(after, before);
  std::filesystem::rename(folder_ / "a.png", folder_ / "b.png");
  material()["reflectance_texture"]["file"] = "b.png";
  EXPECT_EQ(content_hash(load()), after) << "the name does not";
}

TEST_F(SceneFileImages, NamesTheKeyOfAMissingImage) {
  material()["reflectance_texture"]["file"] = "b.png";
  EXPECT_TRUE(faults().starts_with("/materials/grey/reflectance_texture/file: " +
                                   (folder_ / "b.png").string()))
      << faults();
  material()["reflectance_texture"]["file"] = ".";
  EXPECT_TRUE(faults().starts_with("/materials/grey/reflectance_texture/file: ")) << faults();
}

TEST_F(SceneFileImages, ColoursSayHowTheyAreEncoded) {
  material()["reflectance_texture"].erase("srgb");
  EXPECT_NE(faults().find("/materials/grey"), std::string::npos);
  EXPECT_NE(faults().find("srgb"), std::string::npos) << faults();
}

TEST_F(SceneFileImages, RefusesTexturesThatAMaterialHasNoUseFor) {
  material()["roughness_texture"] = {{"file", "a.png"}};
  EXPECT_NE(faults().find("unknown key \"roughness_texture\""), std::string::npos) << faults();
}

TEST_F(SceneFileImages, RefusesShapesWithoutCoordinatesAndLightsWithHoles) {
  scene_["shapes"].push_back({{"name", "ball"},
                              {"type", "sphere"},
                              {"center", {0, 0, 0}},
                              {"radius", 1},
                              {"material", "grey"}});
  EXPECT_TRUE(
      faults().starts_with("/shapes/1/material: material \"grey\" has images, but shape "
                           "\"ball\" has no texture coordinates"))
      << faults();
  scene_["shapes"].erase(1);
  material()["mask"] = {{"file", "a.png"}, {"channel", 3}};
  scene_["shapes"][0]["emission"] = {{"radiance", 1}};
  EXPECT_TRUE(
      faults().starts_with("/shapes/0/material: material \"grey\" has a mask, but shape "
                           "\"floor\" emits light"))
      << faults();
}

TEST_F(SceneFileImages, ReadsOneCoordinatePairPerVertex) {
  json& shape = scene_["shapes"][0];
  shape = {{"name", "floor"},
           {"type", "triangles"},
           {"vertices", {{0, 0, 0}, {1, 0, 0}, {0, 0, -1}}},
           {"triangles", {{0, 1, 2}}},
           {"uvs", {{0, 1}, {2.5, 1}, {0, -0.5}}},
           {"material", "grey"}};
  const SceneDescription scene = load();
  EXPECT_EQ(std::get<TriangleMeshShape>(scene.shapes[0].shape).uvs,
            (std::vector<Vec2>{{0, 1}, {2.5f, 1}, {0, -0.5f}}));
  shape["uvs"].erase(2);
  EXPECT_NE(faults().find("/shapes/0/uvs: expected one per vertex, 3, found 2"), std::string::npos)
      << faults();
}

TEST_F(SceneFileImages, ReadsAnEnvironmentWithScaleAndRotation) {
  test::write_rgb_exr(folder_ / "sky.exr", 2, 1, {Rgb(1, 2, 3), Rgb(0.5f)});
  scene_["environment"] = {{"image", "sky.exr"}, {"scale", 4}, {"rotation_deg", -30}};
  const SceneDescription scene = load();
  ASSERT_TRUE(scene.environment);
  EXPECT_EQ(scene.environment->columns, 2u);
  EXPECT_EQ(scene.environment->rows, 1u);
  EXPECT_EQ(scene.environment->texels, (std::vector<Rgb>{Rgb(4, 8, 12), Rgb(2.0f)}));
  EXPECT_EQ(scene.environment->rotation_deg, -30.0);
  const std::string hash = content_hash(scene);
  scene_["environment"]["rotation_deg"] = 0;
  EXPECT_NE(content_hash(load()), hash);
}

TEST_F(SceneFileImages, AnImageAndAGridOfItsNumbersAreTheSameScene) {
  test::write_rgb_exr(folder_ / "sky.exr", 2, 1, {Rgb(1, 2, 3), Rgb(0.5f)});
  scene_["environment"] = {{"image", "sky.exr"}};
  const std::string hash = content_hash(load());
  scene_["environment"] = {{"grid", {{{1, 2, 3}, 0.5}}}};
  EXPECT_EQ(content_hash(load()), hash);
}

TEST_F(SceneFileImages, RefusesBadEnvironments) {
  const auto fault_of = [&](json environment) {
    scene_["environment"] = std::move(environment);
    return faults();
  };
  EXPECT_TRUE(fault_of({{"image", "b.exr"}})
                  .starts_with("/environment/image: " + (folder_ / "b.exr").string() +
                               ": the image does not exist"));
  test::write_rgb_exr(folder_ / "nan.exr", 2, 1,
                      {Rgb(1.0f), Rgb(std::numeric_limits<float>::quiet_NaN())});
  EXPECT_NE(fault_of({{"image", "nan.exr"}}).find("(column 1, row 0 from the upper left)"),
            std::string::npos);
  test::write_rgb_exr(folder_ / "sky.exr", 1, 1, {Rgb(1e20f)});
  EXPECT_NE(fault_of({{"image", "sky.exr"}, {"scale", 1e20}}).find("allowed: up to 1e+30"),
            std::string::npos);
  EXPECT_TRUE(fault_of({{"image", "sky.exr"}, {"radiance", 1}})
                  .starts_with("/environment: expected one of"));
  EXPECT_TRUE(fault_of({{"radiance", 1}, {"scale", 2}}).starts_with("/environment/scale: belongs"));
}

TEST_F(SceneFileImages, WarnsOfAnAlphaChannelInAnEnvironment) {
  scene_["environment"] = {{"image", "a.png"}};
  const SceneDescription scene = load();
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("alpha channel"), std::string::npos);
}

}  // namespace
}  // namespace penumbra
