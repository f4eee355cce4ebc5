#include "scenes/core/scene_file.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

using nlohmann::json;

/// A valid scene of one grey rectangle, to be spoilt by each test.
json small_scene() {
  return json::parse(R"({
    "format": "penumbra-scene", "version": 1, "name": "small", "summary": "A test.",
    "camera": {"position": [0, 1, 5], "look_at": [0, 0, 0]},
    "materials": {"grey": {"type": "lambert", "reflectance": 0.5},
                  "black": {"type": "lambert", "reflectance": [0, 0, 0]}},
    "shapes": [{"name": "floor", "type": "rectangle", "origin": [0, 0, 0], "edge_u": [1, 0, 0],
                "edge_v": [0, 0, -2], "material": "grey"}]
  })");
}

SceneDescription parse(const json& scene) {
  return parse_scene_description(LocatedJson::parse_text(scene.dump(2), "s.json"));
}

/// The errors of a scene without the places' lines: "/pointer: message" each.
std::string faults_of(const json& scene) {
  try {
    parse(scene);
  } catch (const InputError& error) {
    std::string text = error.what();
    std::string result;
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      const std::size_t message = text.find("error: ", begin) + 7;
      result += (result.empty() ? "" : "\n") + text.substr(message, end - message);
      begin = end + 1;
    }
    return result;
  }
  return "no error";
}

json quad(const std::string& name) {
  return json::parse(R"({"name": ")" + name + R"(", "type": "quads", "material": "grey",
    "vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]], "quads": [[0, 1, 2, 3]]})");
}

json board() {
  return json::parse(
      R"({"name": "board", "type": "checkerboard", "origin": [0, 0, 0], "edge_u": [3, 0, 0],
    "edge_v": [0, 2, 0], "squares": [3, 2], "rows": [{"rows": [0, 1], "materials": ["grey", "black"]}]})");
}

TEST(SceneFile, ReadsCameraMaterialsAndShapes) {
  const SceneDescription scene = parse(small_scene());
  EXPECT_EQ(scene.name, "small");
  EXPECT_EQ(scene.camera.position, Vec3d(0, 1, 5));
  EXPECT_EQ(scene.camera.vertical_fov_deg, 45.0);
  ASSERT_EQ(scene.shapes.size(), 1u);
  EXPECT_EQ(scene.materials[scene.shapes[0].material].name, "grey");
  EXPECT_EQ(std::get<RectangleShape>(scene.shapes[0].shape).edge_v, Vec3d(0, 0, -2));
  EXPECT_FALSE(scene.shapes[0].emission.has_value());
}

TEST(SceneFile, ReadsEveryMaterialModel) {
  json scene = small_scene();
  scene["materials"] = json::parse(R"({
    "grey": {"type": "lambert", "reflectance": [0.1, 0.2, 0.3]},
    "gold": {"type": "conductor", "eta": [0.1, 0.4, 1.4], "k": [4, 2.4, 1.6], "alpha": 0.0001},
    "gloss": {"type": "phong", "diffuse": 0.3, "specular": 0.7, "exponent": 40},
    "mix": {"type": "mixture", "diffuse": {"reflectance": 0.5}, "glossy_weight": 0.25,
            "glossy": {"eta": 0.2, "k": 3.9, "alpha": 0.1, "tint": 0.9}}})");
  const SceneDescription read = parse(scene);  // sorted by name: gloss, gold, grey, mix
  EXPECT_EQ(std::get<PhongMaterial>(read.materials[0].model).exponent, 40.0f);
  EXPECT_EQ(std::get<ConductorMaterial>(read.materials[1].model).alpha, 1e-4f);
  EXPECT_EQ(std::get<LambertMaterial>(read.materials[2].model).reflectance, Rgb(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(std::get<MixtureMaterial>(read.materials[3].model).glossy.tint, Rgb(0.9f));
}

TEST(SceneFile, ReadsMetallicRoughnessAndMirror) {
  json scene = small_scene();
  scene["materials"] = json::parse(R"({
    "grey": {"type": "metallic_roughness", "base_color": [0.1, 0.2, 0.3], "metallic": 0.25,
             "roughness": 0},
    "silver": {"type": "mirror", "reflectance": 0.9}})");
  const SceneDescription read = parse(scene);
  const auto& coated = std::get<MetallicRoughnessMaterial>(read.materials[0].model);
  EXPECT_EQ(coated.base_color, Rgb(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(coated.metallic, 0.25f);
  EXPECT_EQ(coated.roughness, 0.0f);
  EXPECT_EQ(std::get<MirrorMaterial>(read.materials[1].model).reflectance, Rgb(0.9f));
  scene["materials"]["grey"]["metallic"] = 1.5;
  EXPECT_EQ(faults_of(scene), "/materials/grey/metallic: expected a number in [0, 1], found 1.5");
}

TEST(SceneFile, ReadsAnEmission) {
  json scene = small_scene();
  scene["shapes"][0]["emission"] = {{"radiance", {1, 2, 3}}, {"two_sided", true}};
  const SceneDescription read = parse(scene);
  EXPECT_EQ(read.shapes[0].emission->radiance, Rgb(1, 2, 3));
  EXPECT_TRUE(read.shapes[0].emission->two_sided);
}

TEST(SceneFile, TakesAnEmissionOfZeroAsNone) {
  json scene = small_scene();
  scene["shapes"][0]["emission"] = {{"radiance", 0}};
  const SceneDescription read = parse(scene);
  EXPECT_FALSE(read.shapes[0].emission.has_value());
  ASSERT_EQ(read.warnings.size(), 1u);
}

TEST(SceneFile, RefusesAnUnknownMaterialWithASuggestion) {
  json scene = small_scene();
  scene["shapes"][0]["material"] = "gray";
  EXPECT_EQ(faults_of(scene),
            "/shapes/0/material: unknown material \"gray\"; did you mean \"grey\"? (allowed: "
            "black, grey)");
}

TEST(SceneFile, RefusesTheSameShapeNameTwice) {
  json scene = small_scene();
  scene["shapes"].push_back(scene["shapes"][0]);
  EXPECT_EQ(faults_of(scene), "/shapes/1/name: shape name \"floor\" is used twice");
}

TEST(SceneFile, RefusesEdgesThatAreNotPerpendicular) {
  json scene = small_scene();
  scene["shapes"][0]["edge_v"] = {1, 0, 1};
  EXPECT_TRUE(faults_of(scene).starts_with("/shapes/0/edge_v: must be perpendicular to edge_u"));
}

TEST(SceneFile, RefusesAnEdgeOfZero) {
  json scene = small_scene();
  scene["shapes"][0]["edge_u"] = {0, 0, 0};
  EXPECT_EQ(faults_of(scene), "/shapes/0/edge_u: must not be the zero vector");
}

TEST(SceneFile, RefusesASphereWithoutRadius) {
  json scene = small_scene();
  scene["shapes"][0] = {{"name", "s"},
                        {"type", "sphere"},
                        {"center", {0, 0, 0}},
                        {"radius", 0},
                        {"material", "grey"}};
  EXPECT_EQ(faults_of(scene), "/shapes/0/radius: expected a number in (0, 1e+30], found 0");
}

TEST(SceneFile, RefusesNegativeRadiance) {
  json scene = small_scene();
  scene["shapes"][0]["emission"] = {{"radiance", {1, -1, 1}}};
  EXPECT_EQ(faults_of(scene),
            "/shapes/0/emission/radiance/1: expected a number in [0, 1e+30], found -1");
}

TEST(SceneFile, RefusesNumbersBeyondSinglePrecision) {
  json scene = small_scene();
  scene["shapes"][0]["origin"][2] = 1e300;
  EXPECT_TRUE(
      faults_of(scene).starts_with("/shapes/0/origin/2: expected a number in [-1e+30, 1e+30]"));
}

TEST(SceneFile, RefusesASceneWithoutShapes) {
  json scene = small_scene();
  scene["shapes"] = json::array();
  EXPECT_EQ(faults_of(scene), "/shapes: expected at least 1 item, found 0");
}

TEST(SceneFile, RefusesACameraThatLooksAtItself) {
  json scene = small_scene();
  scene["camera"]["look_at"] = scene["camera"]["position"];
  EXPECT_EQ(faults_of(scene), "/camera/look_at: must differ from position");
}

TEST(SceneFile, RefusesAnUpVectorAlongTheView) {
  json scene = small_scene();
  scene["camera"]["up"] = {0, -2, -10};
  EXPECT_TRUE(faults_of(scene).starts_with("/camera/up: must not be parallel"));
}

TEST(SceneFile, RefusesReflectanceAboveOne) {
  json scene = small_scene();
  scene["materials"]["grey"]["reflectance"] = 1.1;
  EXPECT_EQ(faults_of(scene),
            "/materials/grey/reflectance: expected a number in [0, 1], found 1.1");
}

TEST(SceneFile, RefusesAPhongMaterialThatGainsEnergy) {
  json scene = small_scene();
  scene["materials"]["grey"] = {
      {"type", "phong"}, {"diffuse", {0.5, 0.75, 0.5}}, {"specular", 0.5}, {"exponent", 10}};
  EXPECT_EQ(faults_of(scene),
            "/materials/grey/specular: diffuse + specular must be at most 1, found 1.25 in the "
            "green channel");
}

TEST(SceneFile, RefusesARoughnessOutOfRange) {
  json scene = small_scene();
  scene["materials"]["grey"] = {{"type", "conductor"}, {"eta", 0.2}, {"k", 3.9}, {"alpha", 1e-5}};
  EXPECT_EQ(faults_of(scene),
            "/materials/grey/alpha: expected a number in [0.0001, 1], found 1e-05");
}

TEST(SceneFile, RefusesAVertexIndexOutOfRange) {
  json scene = small_scene();
  scene["shapes"].push_back(quad("q"));
  scene["shapes"][1]["quads"].push_back({0, 1, 2, 5});
  EXPECT_EQ(faults_of(scene),
            "/shapes/1/quads/1/3: vertex 5 does not exist; the shape has vertices 0 to 4");
}

TEST(SceneFile, LeavesOutTrianglesWithoutArea) {
  json scene = small_scene();
  scene["shapes"].push_back(json::parse(R"({"name": "t", "type": "triangles", "material": "grey",
    "vertices": [[0, 0, 0], [0.1, 0.1, 0], [0.3, 0.3, 0], [0, 1, 0]],
    "triangles": [[0, 1, 2], [0, 0, 3], [0, 1, 3]]})"));
  const SceneDescription read = parse(scene);
  EXPECT_EQ(std::get<TriangleMeshShape>(read.shapes[1].shape).triangles.size(), 1u);
  ASSERT_EQ(read.warnings.size(), 1u);
  EXPECT_EQ(read.warnings[0], "shape \"t\": 2 of 3 triangles have no area and are left out");
}

TEST(SceneFile, LeavesOutQuadsWithoutArea) {
  json scene = small_scene();
  scene["shapes"].push_back(quad("q"));
  scene["shapes"][1]["quads"].push_back({0, 4, 2, 4});
  EXPECT_EQ(std::get<QuadMeshShape>(parse(scene).shapes[1].shape).quads.size(), 1u);
}

TEST(SceneFile, RefusesAQuadThatIsATriangle) {
  json scene = small_scene();
  scene["shapes"].push_back(quad("q"));
  scene["shapes"][1]["quads"].push_back({0, 1, 2, 2});
  EXPECT_TRUE(faults_of(scene).starts_with("/shapes/1/quads/1: two corners coincide"));
}

TEST(SceneFile, RefusesAMeshWithoutAnyArea) {
  json scene = small_scene();
  scene["shapes"].push_back(quad("q"));
  scene["shapes"][1]["quads"] = json::array({{0, 0, 0, 0}});
  EXPECT_EQ(faults_of(scene), "/shapes/1/quads: no face has an area");
}

TEST(SceneFile, ExpandsACheckerboardToOneMeshPerMaterial) {
  json scene = small_scene();
  scene["shapes"] = json::array({board()});
  const SceneDescription read = parse(scene);
  ASSERT_EQ(read.shapes.size(), 2u);
  EXPECT_EQ(read.shapes[0].name, "board.grey");
  EXPECT_EQ(read.shapes[1].name, "board.black");
  // Square (0, 0) is grey; (1, 0) is black.
  const auto& grey = std::get<QuadMeshShape>(read.shapes[0].shape);
  const auto& black = std::get<QuadMeshShape>(read.shapes[1].shape);
  EXPECT_EQ(grey.quads.size(), 3u);
  EXPECT_EQ(black.quads.size(), 3u);
  EXPECT_EQ(grey.vertices[grey.quads[0][2]], Vec3d(1, 1, 0));
  EXPECT_EQ(black.vertices[black.quads[0][0]], Vec3d(1, 0, 0));
}

TEST(SceneFile, CheckerboardSquaresTileTheirAreaAndFaceAlongTheNormal) {
  json scene = small_scene();
  scene["shapes"] = json::array({board()});
  Vec3d area(0, 0, 0);
  for (const ShapeDescription& shape : parse(scene).shapes) {
    const auto& mesh = std::get<QuadMeshShape>(shape.shape);
    for (const auto& q : mesh.quads) {
      area += 0.5 * (mesh.vertices[q[2]] - mesh.vertices[q[0]])
                        .cross(mesh.vertices[q[3]] - mesh.vertices[q[1]]);
    }
  }
  EXPECT_NEAR((area - Vec3d(0, 0, 6)).length(), 0.0, 1e-12);  // edge_u x edge_v
}

TEST(SceneFile, CheckerboardBandsPickMaterialsByRow) {
  json scene = small_scene();
  json shape = board();
  shape["rows"] = json::parse(R"([{"rows": [1, 1], "materials": ["black", "black"]},
                                  {"rows": [0, 0], "materials": ["grey", "grey"]}])");
  scene["shapes"] = json::array({shape});
  const SceneDescription read = parse(scene);
  EXPECT_EQ(std::get<QuadMeshShape>(read.shapes[0].shape).quads.size(), 3u);
  EXPECT_EQ(read.shapes[0].name,
            "board.grey");  // row 0 comes first, whatever the order of the bands
}

TEST(SceneFile, RefusesARowThatNoBandCovers) {
  json scene = small_scene();
  json shape = board();
  shape["rows"][0]["rows"] = {0, 0};
  scene["shapes"] = json::array({shape});
  EXPECT_EQ(faults_of(scene), "/shapes/0/rows: no band covers row 1 of 2");
}

TEST(SceneFile, RefusesARowThatTwoBandsCover) {
  json scene = small_scene();
  json shape = board();
  shape["rows"].push_back({{"rows", {1, 1}}, {"materials", {"grey", "grey"}}});
  scene["shapes"] = json::array({shape});
  EXPECT_EQ(faults_of(scene), "/shapes/0/rows/1/rows: row 1 is also in band 0");
}

TEST(SceneFile, RefusesABandBeyondTheRows) {
  json scene = small_scene();
  json shape = board();
  shape["rows"][0]["rows"] = {0, 2};
  scene["shapes"] = json::array({shape});
  EXPECT_EQ(
      faults_of(scene),
      "/shapes/0/rows/0/rows: expected [first, last] with 0 <= first <= last <= 1, found [0,2]");
}

TEST(SceneFile, RefusesUnknownMaterialsOfACheckerboard) {
  json scene = small_scene();
  json shape = board();
  shape["rows"][0]["materials"] = {"white", "grey"};
  scene["shapes"] = json::array({shape});
  EXPECT_EQ(faults_of(scene),
            "/shapes/0/rows/0/materials/0: unknown material \"white\" (allowed: black, grey)");
}

TEST(SceneFile, SurvivesACheckerboardWithoutAnyMaterials) {
  json scene = small_scene();
  scene["materials"] = json::object();
  scene["shapes"] = json::array({board()});
  EXPECT_NE(faults_of(scene).find("/materials: expected at least 1 entry"), std::string::npos);
}

TEST(SceneFile, ReportsFaultsOfSchemaAndMeaningTogether) {
  json scene = small_scene();
  scene["camera"]["up"] = {0, 0, 0};
  scene["materials"]["grey"]["roughness"] = 1;
  scene["shapes"][0]["material"] = "gold";
  EXPECT_EQ(faults_of(scene),
            "/camera/up: must not be the zero vector\n"
            "/materials/grey/roughness: unknown key \"roughness\" (allowed: mask, reflectance, "
            "reflectance_texture, type)\n"
            "/shapes/0/material: unknown material \"gold\" (allowed: black, grey)");
}

TEST(SceneFile, NamesTheLineOfAFault) {
  try {
    parse_scene_description(
        LocatedJson::parse_text("{\"format\": \"penumbra-scene\",\n \"version\": 2}", "s.json"));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(
        std::string(error.what()).find("s.json:2:13: error: /version: expected 1, found number 2"),
        std::string::npos)
        << error.what();
  }
}

TEST(SceneFile, ReadsNoFileOfAnotherFormat) {
  EXPECT_NE(faults_of({{"format", "gltf"}})
                .find("/format: expected \"penumbra-scene\", found string \"gltf\""),
            std::string::npos);
}

}  // namespace
}  // namespace penumbra
