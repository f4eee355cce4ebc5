// Bad data through the executable: an error that says where and what, with exit code 2, or the
// result that is defined. The table in tests/README.md, section "Bad data", lists these and what
// the readers' own tests show.

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "harness/exr.h"
#include "tests/e2e/command_line_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;

// The shadow memory of sanitizers does not fit into a limit.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr const char* kLimit = "";
#else
constexpr const char* kLimit = "ulimit -v 4000000; ";
#endif

class BadData : public CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    fs::create_directory(root_ / "dir.obj");
    write_pfm("good.pfm", {1, 1, 1, 1, 1, 1});
    write_pfm("white.pfm", {1, 1, 1});
    write_pfm("black.pfm", {0, 0, 0, 0, 0, 0});
  }

  /// One row of RGB floats, little-endian as this machine.
  void write_pfm(const std::string& name, const std::vector<float>& numbers) const {
    std::string bytes = "PF\n" + std::to_string(numbers.size() / 3) + " 1\n-1.0\n";
    bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float));
    write_file(name, bytes);
  }

  /// A grey floor under a rectangle light.
  static json lit_floor() {
    return json::parse(R"({
      "format": "penumbra-scene", "version": 1, "name": "floor",
      "camera": {"position": [0, 3, 4], "look_at": [0, 0, 0], "resolution": [8, 6]},
      "materials": {"grey": {"type": "lambert", "reflectance": 0.5}},
      "shapes": [
        {"name": "floor", "type": "rectangle", "origin": [-4, 0, 4], "edge_u": [8, 0, 0],
         "edge_v": [0, 0, -8], "material": "grey"},
        {"name": "lamp", "type": "rectangle", "origin": [-0.5, 2, -0.5], "edge_u": [1, 0, 0],
         "edge_v": [0, 0, 1], "material": "grey", "emission": {"radiance": 5}}]
    })");
  }

  Outcome render(const json& scene, const std::string& arguments = "") const {
    write_file("s.json", scene.dump(1));
    return run("render s.json --spp 1 --threads 1 -o out.exr " + arguments);
  }

  /// Expects a refusal that says all of `parts`.
  static void expect_refused(const Outcome& outcome, const std::vector<std::string>& parts,
                             int code = 2) {
    EXPECT_EQ(outcome.code, code) << outcome.output;
    for (const std::string& part : parts) {
      EXPECT_NE(outcome.output.find(part), std::string::npos) << "expected \"" << part << "\" in:\n"
                                                              << outcome.output;
    }
  }

  /// The picture without the light that is seen directly.
  std::vector<Rgb> reflected(const json& scene, const std::string& arguments = "") const {
    const Outcome outcome = render(scene, arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.output;
    if (outcome.code != 0) return {};
    return read_exr(root_ / "out.exr").image("reflected").pixels;
  }

  static void expect_same_bits(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
    ASSERT_EQ(a.size(), b.size());
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(Rgb)), 0);
  }
};

TEST_F(BadData, NumbersOfASceneThatAreNotAllowedNameTheirPlace) {
  struct Case {
    const char* pointer;
    json value;
    std::vector<std::string> parts;
  };
  const std::vector<Case> cases{
      {"/camera/resolution", {0, 4}, {"s.json:", "/camera/resolution/0", "found 0"}},
      {"/camera/resolution", {8, -3}, {"/camera/resolution/1", "found -3"}},
      {"/camera/resolution", {1000000000, 4}, {"/camera/resolution/0", "16384"}},
      {"/camera/look_at", {0, 3, 4}, {"/camera/look_at: must differ from position"}},
      {"/camera/up", {0, -3, -4}, {"/camera/up: must not be parallel to the view"}},
      {"/camera/vertical_fov_deg", 180, {"/camera/vertical_fov_deg", "found 180"}},
      {"/shapes/1/emission/radiance", -1, {"/shapes/1/emission/radiance", "found -1"}},
      {"/shapes/1/emission/radiance", 1e31, {"/shapes/1/emission/radiance", "1e+30"}},
      {"/shapes/1/origin/0", 1e300, {"/shapes/1/origin/0", "1e+30"}},
      {"/shapes/1/edge_u", {0, 0, 0}, {"/shapes/1/edge_u: must not be the zero vector"}},
      {"/shapes/1/name", "floor", {"/shapes/1/name", "\"floor\" is used twice"}},
      {"/shapes/1/material", "gray", {"did you mean \"grey\"?"}},
      {"/shapes", json::array(), {"/shapes"}},
      {"/environment", {{"image", "missing.exr"}}, {"/environment/image", "does not exist"}},
      {"/environment", {{"image", "dir.obj"}}, {"not a file but a directory"}},
      {"/include", {{{"file", "dir.obj"}}}, {"/include/0/file", "is a folder"}},
      {"/include", {{{"file", "missing.obj"}}}, {"/include/0/file", "No such file"}},
      {"/include", {{{"file", "s.json"}}}, {"unknown format \".json\""}},
      {"/camera/position", {1e30, 3, 4}, {"the camera is", "allowed: up to 1e+15"}},
      {"/shapes/1/edge_u", {1e-60, 0, 0}, {"light \"lamp\" is too small beside the scene"}}};
  for (const Case& c : cases) {
    json scene = lit_floor();
    scene[json::json_pointer(c.pointer)] = c.value;
    expect_refused(render(scene), c.parts);
  }
}

TEST_F(BadData, NumbersThatJsonDoesNotHaveNameTheirLine) {
  for (const char* number : {"1e999", "-1e999", "NaN", "Infinity", "nan"}) {
    std::string text = lit_floor().dump(1);
    const std::size_t at = text.find("0.5");
    ASSERT_NE(at, std::string::npos);
    text.replace(at, 3, number);
    write_file("s.json", text);
    expect_refused(run("render s.json -o out.exr"), {"s.json:", "not valid JSON"});
  }
}

TEST_F(BadData, TexelsThatAreNotRadianceNameTheirCoordinates) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const std::vector<std::pair<float, std::string>> cases{
      {nan, "nan"}, {infinity, "inf"}, {-0.25f, "-0.25"}};
  for (const auto& [number, text] : cases) {
    write_pfm("bad.pfm", {1, 1, 1, 1, number, 1});
    json scene = lit_floor();
    scene["environment"] = {{"image", "bad.pfm"}};
    expect_refused(render(scene), {"/environment/image", "bad.pfm",
                                   "(column 1, row 0 from the upper left), channel 1 is " + text});
  }
}

TEST_F(BadData, FoldersAndDevicesAreNoFiles) {
  fs::create_directory(root_ / "folder.json");
  expect_refused(run("render folder.json -o out.exr"), {"unknown scene \"folder.json\""});
  expect_refused(run("validate folder.json"), {"folder.json: error: is a folder"});
  expect_refused(run("validate /dev/zero"), {"/dev/zero: error: is a device"});
  expect_refused(run("validate missing.json"), {"missing.json: error: cannot be read: No such"});
  fs::create_symlink("/dev/zero", root_ / "endless.obj");
  json scene = lit_floor();
  scene["include"] = {{{"file", "endless.obj"}}};
  expect_refused(render(scene), {"/include/0/file", "endless.obj: error: is a device"});
}

TEST_F(BadData, ArgumentsThatHaveNoMeaningAreRefused) {
  write_file("s.json", lit_floor().dump());
  const std::vector<std::pair<std::string, std::string>> cases{
      {"--spp 0", "--spp: expected 1 to 1000000, found 0"},
      {"--spp -4", "found -4"},
      {"--spp 2000000000", "found 2000000000"},
      {"--srl 0", "found \"0\""},
      {"--srl -1", "found \"-1\""},
      {"--srl 1000001", "each up to 1000000"},
      {"--estimator pmc_hi --srl 0-4", "found \"0-4\""},
      {"--estimator pmc_hi --srl 8-8 --set population=1", "needs a population of at least"},
      {"--resolution 0 4", "resolution: expected 1 to 16384 pixels a side, found 0 x 4"},
      {"--resolution 4 -4", "found 4 x -4"},
      {"--resolution 1000000000 1000000000", "found 1000000000 x 1000000000"},
      {"--exposure nan", "--exposure: expected -30 to 30 stops, found nan"},
      {"--exposure 1000", "found 1000"},
      {"--threads -1", "threads: expected 0, for all cores, to 4096, found -1"},
      {"--threads 1000000000", "found 1000000000"}};
  for (const auto& [arguments, part] : cases) {
    expect_refused(run("render s.json -o out.exr " + arguments), {part});
  }
}

TEST_F(BadData, WhatNoMemoryHoldsIsRefusedBeforeItIsAskedFor) {
  // With an address space of 4 GB an attempt would end in another message.
  write_file("s.json", lit_floor().dump());
  const auto limited = [&](const std::string& arguments) {
    return run_shell(std::string(kLimit) + "'" PENUMBRA_EXECUTABLE "' render s.json -o out.exr " +
                     arguments);
  };
  expect_refused(limited("--resolution 16384 16384 --spp 100"),
                 {"scene \"floor\": 16384 x 16384 pixels with 100 camera samples",
                  "allowed: up to 268435456"});
  // As many as are allowed, and more than this process may have.
  if (*kLimit != '\0') {
    expect_refused(limited("--resolution 16384 16384 --spp 1"), {"error: out of memory"}, 4);
  }
  json many = lit_floor();
  for (int i = 0; i < 30; ++i) {
    many["shapes"].push_back(many["shapes"][1]);
    many["shapes"].back()["name"] = "lamp " + std::to_string(i);
  }
  write_file("s.json", many.dump());
  expect_refused(limited("--srl 1000000 --spp 1"),
                 {"1000000 shadow rays per light and 31 lights are 31000000 samples"});
}

TEST_F(BadData, SceneWithoutLightIsBlackAndSaysSo) {
  json scene = lit_floor();
  scene["shapes"].erase(1);
  const Outcome outcome = render(scene);
  EXPECT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("there is no light"), std::string::npos) << outcome.output;
  for (const char* estimator :
       {"mis", "pmc_hi --srl 4-12", "alsd", "mdhi", "light", "bsdf", "uniform"}) {
    for (const Rgb& pixel : reflected(scene, std::string("--estimator ") + estimator)) {
      EXPECT_EQ(pixel, Rgb(0.0f)) << estimator;
    }
  }
}

TEST_F(BadData, LightsOfZeroPowerChangeNoBit) {
  for (const char* estimator : {"mis", "pmc_hi --srl 4-12", "alsd", "mdhi"}) {
    const std::string arguments = std::string("--estimator ") + estimator;
    const std::vector<Rgb> without = reflected(lit_floor(), arguments);
    EXPECT_GT(std::max_element(without.begin(), without.end(),
                               [](const Rgb& a, const Rgb& b) { return a.x < b.x; })
                  ->x,
              0.1f);
    json scene = lit_floor();
    scene["point_lights"] = {{{"name", "off"}, {"position", {0, 1, 0}}, {"intensity", 0}}};
    scene["directional_lights"] = {
        {{"name", "night"}, {"direction", {0, -1, 0}}, {"irradiance", {0, 0, 0}}}};
    scene["environment"] = {{"image", "black.pfm"}};
    scene["shapes"][0]["emission"] = {{"radiance", 0}};
    expect_same_bits(reflected(scene, arguments), without);
  }
}

TEST_F(BadData, EnvironmentOfOneTexelIsAConstantOne) {
  json scene = lit_floor();
  scene["environment"] = {{"image", "white.pfm"}};
  const std::vector<Rgb> image = reflected(scene);
  scene["environment"] = {{"radiance", 1}};
  expect_same_bits(image, reflected(scene));
}

TEST_F(BadData, CameraThatSeesNothingGivesBlackPixels) {
  json away = lit_floor();
  away["camera"]["look_at"] = {0, 6, 8};
  json inside = lit_floor();
  inside["shapes"].push_back({{"name", "shell"},
                              {"type", "sphere"},
                              {"center", {0, 3, 4}},
                              {"radius", 0.25},
                              {"material", "grey"}});
  for (const json& scene : {away, inside}) {
    for (const char* estimator : {"mis", "pmc_hi --srl 4-12", "alsd", "mdhi"}) {
      for (const Rgb& pixel : reflected(scene, std::string("--estimator ") + estimator)) {
        EXPECT_EQ(pixel, Rgb(0.0f)) << estimator;
      }
    }
  }
}

TEST_F(BadData, AStudyOfAnEmptyViewEndsWithATable) {
  json away = lit_floor();
  away["camera"]["look_at"] = {0, 6, 8};
  write_file("away.json", away.dump());
  write_file("study.json", R"({
    "version": 1, "name": "empty", "baseline": "MIS", "spp": 2, "blocks": 2,
    "scenes": [{"name": "away", "file": "away.json", "camera_samples": 1,
                "reference": {"srl": 2, "spp": 4}}],
    "methods": [{"label": "MIS", "estimator": "mis", "srl": 4},
                {"label": "PMC-HI", "estimator": "pmc_hi", "srl": "4-4"}]
  })");
  const Outcome outcome = run("run study.json --out out");
  EXPECT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_TRUE(fs::exists(root_ / "out/efficiency.csv"));
}

TEST_F(BadData, TrianglesWithoutAreaAreLeftOut) {
  json mesh = lit_floor();
  mesh["shapes"][0] = {{"name", "floor"},
                       {"type", "triangles"},
                       {"vertices", {{-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4}, {0, 0, 0}}},
                       {"triangles", {{0, 1, 2}, {0, 2, 3}}},
                       {"material", "grey"}};
  const std::vector<Rgb> without = reflected(mesh);
  for (const json& triangle : {json{0, 0, 1}, json{4, 4, 4}, json{0, 4, 2}}) {
    mesh["shapes"][0]["triangles"].push_back(triangle);
  }
  const Outcome outcome = render(mesh);
  EXPECT_NE(outcome.output.find("3 of 5 triangles have no area and are left out"),
            std::string::npos)
      << outcome.output;
  expect_same_bits(reflected(mesh), without);
  mesh["shapes"][0]["triangles"] = json::array({json::array({0, 0, 1})});
  expect_refused(render(mesh), {"/shapes/0/triangles: no face has an area"});
}

TEST_F(BadData, NormalsOfLengthZeroLeaveFlatFaces) {
  const std::string flat = "v -4 0 4\nv 4 0 4\nv 4 0 -4\nv -4 0 -4\n";
  write_file("flat.obj", flat + "f 1 2 3 4\n");
  write_file("zero.obj", flat + "vn 0 0 0\nf 1//1 2//1 3//1 4//1\n");
  json scene = lit_floor();
  scene["shapes"][0] = {
      {"name", "floor"}, {"type", "model"}, {"file", "flat.obj"}, {"material", "grey"}};
  const std::vector<Rgb> expected = reflected(scene);
  scene["shapes"][0]["file"] = "zero.obj";
  const Outcome outcome = render(scene);
  EXPECT_NE(outcome.output.find("normal of length 0"), std::string::npos) << outcome.output;
  expect_same_bits(reflected(scene), expected);
}

TEST_F(BadData, VerticesThatAreNotFiniteAreRefused) {
  write_file("nan.obj", "v nan 0 4\nv 4 0 4\nv 4 0 -4\nf 1 2 3\n");
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  const std::array<float, 9> numbers{0, 0, 0, 1, std::numeric_limits<float>::infinity(),
                                     0, 0, 0, 1};
  ply.append(reinterpret_cast<const char*>(numbers.data()), sizeof(numbers));
  const std::array<std::int32_t, 3> corners{0, 1, 2};
  ply += '\3';
  ply.append(reinterpret_cast<const char*>(corners.data()), sizeof(corners));
  write_file("inf.ply", ply);
  json scene = lit_floor();
  scene["include"] = {{{"file", "nan.obj"}}};
  expect_refused(render(scene), {"nan.obj:1: error: expected a finite number"});
  scene["include"] = {{{"file", "inf.ply"}}};
  expect_refused(render(scene), {"inf.ply", "vertex 1 is not finite"});
}

TEST_F(BadData, ConfigsThatAreBadNameTheirPlace) {
  const json good = json::parse(read_text(fs::path(PENUMBRA_SOURCE_DIR) / "configs/smoke.json"));
  const auto validate = [&](const std::string& pointer, const json& value) {
    json config = good;
    config[json::json_pointer(pointer)] = value;
    write_file("c.json", config.dump(1));
    return run("validate c.json");
  };
  expect_refused(validate("/spp", 0), {"c.json:", "/spp", "found 0"});
  expect_refused(validate("/methods/0/srl", 0), {"/methods/0/srl", "found 0"});
  expect_refused(validate("/scenes/0/resolution", {0, 4}), {"/scenes/0/resolution/0", "found 0"});
  write_file("c.json", good.dump());
  expect_refused(run("validate c.json --set \"name=$(printf '\\377')\""), {"is not UTF-8"});
}

}  // namespace
}  // namespace penumbra
