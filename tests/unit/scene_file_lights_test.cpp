// The keys "point_lights", "spot_lights", "directional_lights" and "environment" of scene files.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "scenes/core/error.h"
#include "scenes/core/scene_file.h"

namespace penumbra {
namespace {

using nlohmann::json;

/// A valid scene with both keys, one key per line, to be spoilt by each test.
json lit_scene() {
  return json::parse(R"({
    "format": "penumbra-scene", "version": 1, "name": "lit",
    "camera": {"position": [0, 1, 5], "look_at": [0, 0, 0]},
    "materials": {"grey": {"type": "lambert", "reflectance": 0.5}},
    "shapes": [{"name": "floor", "type": "rectangle", "origin": [0, 0, 0], "edge_u": [1, 0, 0],
                "edge_v": [0, 0, -2], "material": "grey"}],
    "point_lights": [{"name": "lamp", "position": [1, 2, 3], "intensity": [4, 5, 6]},
                     {"name": "bulb", "position": [0, 1, 0], "intensity": 0.25}],
    "environment": {"name": "sky", "grid": [[1, [2, 3, 4]], [0, 0.5], [6, 7]]}
  })");
}

SceneDescription parse(const json& scene) {
  return parse_scene_description(LocatedJson::parse_text(scene.dump(2), "s.json"));
}

/// The errors of a scene: "s.json:line:column: error: /pointer: message", one per line.
std::string faults_of(const json& scene) {
  try {
    parse(scene);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

/// Whether the one error names a line and column, and then says `expected`.
::testing::AssertionResult is_only_fault(const json& scene, const std::string& expected) {
  const std::string text = faults_of(scene);
  const std::size_t mark = text.find(": error: ");
  if (text.starts_with("s.json:") && mark != std::string::npos && mark > 9 &&
      text.substr(mark + 9) == expected) {
    return ::testing::AssertionSuccess();
  }
  return ::testing::AssertionFailure() << text;
}

TEST(SceneFileLights, ReadsPointLights) {
  const SceneDescription scene = parse(lit_scene());
  ASSERT_EQ(scene.point_lights.size(), 2u);
  EXPECT_EQ(scene.point_lights[0].name, "lamp");
  EXPECT_EQ(scene.point_lights[0].position, Vec3d(1, 2, 3));
  EXPECT_EQ(scene.point_lights[0].intensity, Vec3d(4, 5, 6));
  EXPECT_EQ(scene.point_lights[1].intensity, Vec3d(0.25));
  EXPECT_TRUE(scene.warnings.empty());
}

TEST(SceneFileLights, ReadsAGridRowByRow) {
  const SceneDescription scene = parse(lit_scene());
  ASSERT_TRUE(scene.environment.has_value());
  EXPECT_EQ(scene.environment->name, "sky");
  EXPECT_EQ(scene.environment->columns, 2u);
  EXPECT_EQ(scene.environment->rows, 3u);
  const std::vector<Rgb> expected = {Rgb(1.0f), Rgb(2, 3, 4), Rgb(0.0f),
                                     Rgb(0.5f), Rgb(6.0f),    Rgb(7.0f)};
  EXPECT_EQ(scene.environment->texels, expected);
}

TEST(SceneFileLights, ReadsAConstantEnvironmentWithoutName) {
  json scene = lit_scene();
  scene["environment"] = {{"radiance", {1, 2, 3}}};
  const SceneDescription read = parse(scene);
  ASSERT_TRUE(read.environment.has_value());
  EXPECT_EQ(read.environment->name, "environment");
  EXPECT_EQ(read.environment->columns, 1u);
  EXPECT_EQ(read.environment->rows, 1u);
  EXPECT_EQ(read.environment->texels, std::vector<Rgb>{Rgb(1, 2, 3)});
}

TEST(SceneFileLights, BothKeysAreOptional) {
  json scene = lit_scene();
  scene.erase("point_lights");
  scene.erase("environment");
  const SceneDescription read = parse(scene);
  EXPECT_TRUE(read.point_lights.empty());
  EXPECT_FALSE(read.environment.has_value());
}

json with_spot_and_sun() {
  json scene = lit_scene();
  scene["spot_lights"] = json::parse(R"([
    {"name": "spot", "position": [1, 2, 3], "direction": [0, -5, 0], "intensity": [4, 5, 6],
     "inner_angle_deg": 10, "outer_angle_deg": 20.5},
    {"name": "wide", "position": [0, 1, 0], "direction": [1, 0, 0], "intensity": 2}])");
  scene["directional_lights"] =
      json::parse(R"([{"name": "sun", "direction": [0, -1, 2], "irradiance": [3, 2, 1]}])");
  return scene;
}

TEST(SceneFileLights, ReadsSpotAndDirectionalLights) {
  const SceneDescription scene = parse(with_spot_and_sun());
  ASSERT_EQ(scene.spot_lights.size(), 2u);
  EXPECT_EQ(scene.spot_lights[0].name, "spot");
  EXPECT_EQ(scene.spot_lights[0].position, Vec3d(1, 2, 3));
  EXPECT_EQ(scene.spot_lights[0].direction, Vec3d(0, -5, 0));
  EXPECT_EQ(scene.spot_lights[0].intensity, Vec3d(4, 5, 6));
  EXPECT_EQ(scene.spot_lights[0].inner_angle_deg, 10.0);
  EXPECT_EQ(scene.spot_lights[0].outer_angle_deg, 20.5);
  EXPECT_EQ(scene.spot_lights[1].inner_angle_deg, 0.0);
  EXPECT_EQ(scene.spot_lights[1].outer_angle_deg, 45.0);
  ASSERT_EQ(scene.directional_lights.size(), 1u);
  EXPECT_EQ(scene.directional_lights[0].name, "sun");
  EXPECT_EQ(scene.directional_lights[0].direction, Vec3d(0, -1, 2));
  EXPECT_EQ(scene.directional_lights[0].irradiance, Rgb(3, 2, 1));
  EXPECT_TRUE(scene.warnings.empty());
}

TEST(SceneFileLights, WarnsOfSpotAndDirectionalLightsOfZero) {
  json scene = with_spot_and_sun();
  scene["spot_lights"][1]["intensity"] = {0, 0, 0};
  scene["directional_lights"][0]["irradiance"] = 0;
  const SceneDescription read = parse(scene);
  EXPECT_EQ(read.spot_lights.size(), 1u);
  EXPECT_TRUE(read.directional_lights.empty());
  const std::vector<std::string> expected = {
      "spot light \"wide\" has an intensity of zero and is not a light",
      "directional light \"sun\" has an irradiance of zero and is not a light"};
  EXPECT_EQ(read.warnings, expected);
}

TEST(SceneFileLights, RefusesDirectionsOfZero) {
  json scene = with_spot_and_sun();
  scene["spot_lights"][0]["direction"] = {0, 0, 0};
  EXPECT_TRUE(is_only_fault(scene, "/spot_lights/0/direction: must not be the zero vector"));
  scene = with_spot_and_sun();
  scene["directional_lights"][0]["direction"] = {0, 0, 0};
  EXPECT_TRUE(is_only_fault(scene, "/directional_lights/0/direction: must not be the zero vector"));
}

TEST(SceneFileLights, RefusesAnglesWithoutAFalloff) {
  json scene = with_spot_and_sun();
  scene["spot_lights"][0]["inner_angle_deg"] = 20.5;
  EXPECT_TRUE(is_only_fault(scene,
                            "/spot_lights/0/inner_angle_deg: must be less than outer_angle_deg, "
                            "20.5; found 20.5"));
  scene = with_spot_and_sun();
  scene["spot_lights"][1]["inner_angle_deg"] = 50;
  EXPECT_TRUE(is_only_fault(scene,
                            "/spot_lights/1/inner_angle_deg: must be less than outer_angle_deg, "
                            "45.0; found 50.0"));
  scene = with_spot_and_sun();
  scene["spot_lights"][0]["outer_angle_deg"] = 90.5;
  EXPECT_TRUE(is_only_fault(
      scene, "/spot_lights/0/outer_angle_deg: expected a number in (0, 90], found 90.5"));
  scene["spot_lights"][0]["outer_angle_deg"] = 0;
  EXPECT_NE(faults_of(scene).find("/spot_lights/0/outer_angle_deg"), std::string::npos);
}

TEST(SceneFileLights, WarnsOfLightsOfZero) {
  json scene = lit_scene();
  scene["point_lights"][0]["intensity"] = 0;
  scene["environment"]["grid"] = {{0, 0}, {0, {0, 0, 0}}};
  const SceneDescription read = parse(scene);
  ASSERT_EQ(read.point_lights.size(), 1u);
  EXPECT_EQ(read.point_lights[0].name, "bulb");
  EXPECT_FALSE(read.environment.has_value());
  const std::vector<std::string> expected = {
      "point light \"lamp\" has an intensity of zero and is not a light",
      "environment \"sky\" has a radiance of zero and is not a light"};
  EXPECT_EQ(read.warnings, expected);
}

TEST(SceneFileLights, RefusesNegativeAndHugeRadiance) {
  json scene = lit_scene();
  scene["environment"]["grid"][1][0] = -1;
  EXPECT_TRUE(
      is_only_fault(scene, "/environment/grid/1/0: expected a number in [0, 1e+30], found -1"));
  scene = lit_scene();
  scene["environment"]["grid"][0][1][2] = 1e31;
  EXPECT_TRUE(is_only_fault(
      scene, "/environment/grid/0/1/2: expected a number in [0, 1e+30], found 1e+31"));
  scene = lit_scene();
  scene["environment"] = {{"radiance", {1, -2, 3}}};
  EXPECT_TRUE(
      is_only_fault(scene, "/environment/radiance/1: expected a number in [0, 1e+30], found -2"));
}

TEST(SceneFileLights, RefusesNegativeAndHugeIntensity) {
  json scene = lit_scene();
  scene["point_lights"][1]["intensity"] = -0.5;
  EXPECT_TRUE(is_only_fault(
      scene, "/point_lights/1/intensity: expected a number in [0, 1e+30], found -0.5"));
  scene = lit_scene();
  scene["point_lights"][0]["position"][1] = 1e300;
  EXPECT_TRUE(is_only_fault(
      scene, "/point_lights/0/position/1: expected a number in [-1e+30, 1e+30], found 1e+300"));
}

TEST(SceneFileLights, RefusesNumbersThatAreNotFinite) {
  for (const char* number : {"1e400", "NaN", "Infinity"}) {
    std::string text = lit_scene().dump(2);
    const std::size_t at = text.find("0.25");
    ASSERT_NE(at, std::string::npos);
    text.replace(at, 4, number);
    EXPECT_THROW(parse_scene_description(LocatedJson::parse_text(text, "s.json")), InputError)
        << number;
  }
}

TEST(SceneFileLights, RefusesRowsOfDifferentLength) {
  json scene = lit_scene();
  scene["environment"]["grid"][2] = {1, 2, 3};
  EXPECT_TRUE(is_only_fault(scene, "/environment/grid/2: expected 2 texels like row 0, found 3"));
}

TEST(SceneFileLights, RefusesEmptyGrids) {
  json scene = lit_scene();
  scene["environment"]["grid"] = json::array();
  EXPECT_TRUE(is_only_fault(scene, "/environment/grid: expected at least 1 item, found 0"));
  scene["environment"]["grid"] = {json::array()};
  EXPECT_TRUE(is_only_fault(scene, "/environment/grid/0: expected at least 1 item, found 0"));
}

TEST(SceneFileLights, RefusesBothOrNeitherOfRadianceAndGrid) {
  json scene = lit_scene();
  scene["environment"]["radiance"] = 1;
  EXPECT_TRUE(is_only_fault(scene,
                            "/environment: expected one of \"radiance\", \"grid\" and \"image\", "
                            "found \"radiance\" and \"grid\""));
  scene["environment"] = json::object();
  EXPECT_TRUE(is_only_fault(
      scene, "/environment: expected one of \"radiance\", \"grid\" and \"image\", found none"));
}

TEST(SceneFileLights, RefusesUnknownAndMissingKeys) {
  json scene = lit_scene();
  scene["environment"]["rotation"] = 3;
  EXPECT_TRUE(
      is_only_fault(scene,
                    "/environment/rotation: unknown key \"rotation\" (allowed: grid, image, name, "
                    "radiance, rotation_deg, scale)"));
  scene = lit_scene();
  scene["point_lights"][0].erase("position");
  EXPECT_NE(faults_of(scene).find("/point_lights/0"), std::string::npos);
  EXPECT_NE(faults_of(scene).find("position"), std::string::npos);
}

TEST(SceneFileLights, RefusesNamesThatShapesOrLightsHaveAlready) {
  const std::string twice = " is used twice; no shape or light may have another's name";
  json scene = lit_scene();
  scene["point_lights"][1]["name"] = "lamp";
  EXPECT_TRUE(is_only_fault(scene, "/point_lights/1/name: light name \"lamp\"" + twice));
  scene = lit_scene();
  scene["point_lights"][1]["name"] = "floor";
  EXPECT_TRUE(is_only_fault(scene, "/point_lights/1/name: light name \"floor\"" + twice));
  scene = with_spot_and_sun();
  scene["spot_lights"][1]["name"] = "bulb";
  EXPECT_TRUE(is_only_fault(scene, "/spot_lights/1/name: light name \"bulb\"" + twice));
  scene = with_spot_and_sun();
  scene["directional_lights"][0]["name"] = "spot";
  EXPECT_TRUE(is_only_fault(scene, "/directional_lights/0/name: light name \"spot\"" + twice));
  scene = lit_scene();
  scene["environment"]["name"] = "bulb";
  EXPECT_TRUE(is_only_fault(scene, "/environment/name: light name \"bulb\"" + twice));
  scene = lit_scene();
  scene["environment"].erase("name");
  scene["shapes"][0]["name"] = "environment";
  EXPECT_TRUE(is_only_fault(scene, "/environment: light name \"environment\"" + twice));
}

TEST(SceneFileLights, NamesLineAndColumnOfAFault) {
  const std::string text =
      "{\"format\": \"penumbra-scene\", \"version\": 1, \"name\": \"x\",\n"
      " \"camera\": {\"position\": [0, 1, 5], \"look_at\": [0, 0, 0]},\n"
      " \"materials\": {\"grey\": {\"type\": \"lambert\", \"reflectance\": 0.5}},\n"
      " \"shapes\": [{\"name\": \"s\", \"type\": \"sphere\", \"center\": [0, 0, 0],\n"
      "  \"radius\": 1, \"material\": \"grey\"}],\n"
      " \"environment\": {\"grid\": [[1, 2],\n"
      "    [3]]}}";
  try {
    parse_scene_description(LocatedJson::parse_text(text, "s.json"));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "s.json:7:5: error: /environment/grid/1: expected 2 texels like row 0, found 1");
  }
}

}  // namespace
}  // namespace penumbra
