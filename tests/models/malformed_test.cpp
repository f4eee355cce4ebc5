#include <cstring>
#include <limits>
#include <random>

#include "tests/models/gltf_writer.h"
#include "tests/models/ply_writer.h"

/// Files that no program should have written: each is refused with one InputError that names it.
namespace penumbra {
namespace {

constexpr const char* kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

TEST(MalformedObj, FaultsAreToldWithTheirLine) {
  struct Case {
    const char* text;
    const char* message;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"f 1 2 4\n", "a.obj:4: error: vertex 4 does not exist"},
           {"f 0 1 2\n", "a.obj:4: error: vertex 0 does not exist"},
           {"f 1 2 -4\n", "a.obj:4: error: vertex -4 does not exist"},
           {"f 1 2 4294967298\n", "a.obj:4: error: expected a corner"},
           {"f 1/1 2/1 3/1\n", "a.obj:4: error: texture coordinate 1 does not exist"},
           {"f 1//1 2//1 3//1\n", "a.obj:4: error: normal 1 does not exist"},
           {"vn 0 0 1\nf 1//1 2 3\n", "a.obj:5: error: the corners of a face must all have"},
           {"f 1 2\n", "a.obj:4: error: a face needs at least 3 corners"},
           {"f a b c\n", "a.obj:4: error: expected a corner like"},
           {"v nan 0 0\n", "a.obj:4: error: expected a finite number after \"v\", found \"nan\""},
           {"v 1 inf 0\n", "a.obj:4: error: expected a finite number"},
           {"v 1e999 0 0\n", "a.obj:4: error: a coordinate is beyond 1e30"},
           {"v 1 2\n", "a.obj:4: error: expected 3 to 8 numbers"},
           {"", "has no face with an area"},
           {"f 1 1 2\n", "has no face with an area"}}) {
    ModelFiles files;
    expect_model_error(files.write("a.obj", std::string(kTriangle) + c.text), c.message);
  }
}

TEST(MalformedObj, FilesThatAreNotTextsAreRefused) {
  ModelFiles files;
  expect_model_error(files.write("a.obj", std::string("v 0 0 0\0\n", 9)), "is not a text");
  expect_model_error(files.write("b.obj", ""), "no face");
  expect_model_error(files.folder() / "missing.obj", "No such file");
  std::filesystem::create_directory(files.folder() / "folder.obj");
  expect_model_error(files.folder() / "folder.obj", "is a folder");
}

TEST(MalformedMtl, FaultsAreToldWithTheirLine) {
  struct Case {
    const char* text;
    const char* message;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"Kd 1 nan 0\n", "m.mtl:2: error: expected a finite number after \"Kd\""},
           {"Kd 1 0\n", "m.mtl:2: error: expected 3 numbers after \"Kd\", found 2"},
           {"Kd -1 0 0\n", "m.mtl:1: error: material \"m\": expected numbers >= 0"},
           {"Pr 1.5\n", "m.mtl:1: error: material \"m\": expected a number in [0, 1] after \"Pr\""},
           {"map_Kd none.png\n", "none.png does not exist"},
           {"map_Ke glow.png\n", "\"map_Ke\") is not supported"},
           {"newmtl m\n", "m.mtl:2: error: material \"m\" is defined twice"}}) {
    ModelFiles files;
    files.write("m.mtl", std::string("newmtl m\n") + c.text);
    const auto file =
        files.write("a.obj", std::string("mtllib m.mtl\nusemtl m\n") + kTriangle + "f 1 2 3\n");
    try {
      load_model(file);
      ADD_FAILURE() << c.text << " was accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(c.message), std::string::npos) << error.what();
    }
  }
}

TEST(MalformedPly, EveryTruncationIsRefused) {
  for (const PlyBytes format : {PlyBytes::Ascii, PlyBytes::Little, PlyBytes::Big}) {
    const std::string whole = ply_pyramid(format);
    // The text's last line end may be missing.
    const std::size_t last = format == PlyBytes::Ascii ? whole.size() - 2 : whole.size() - 1;
    for (std::size_t size = 0; size <= last; size += std::max<std::size_t>(whole.size() / 10, 1)) {
      ModelFiles files;
      expect_model_error(files.write("cut.ply", whole.substr(0, size)), "error: ");
    }
    ModelFiles files;
    expect_model_error(files.write("cut.ply", whole.substr(0, last)), "error: ");
  }
}

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const std::size_t place = text.find(from);
  EXPECT_NE(place, std::string::npos) << from;
  return text.replace(place, from.size(), to);
}

TEST(MalformedPly, WrongHeadersAndValuesAreRefused) {
  const std::string text = ply_pyramid(PlyBytes::Ascii);
  const std::string binary = ply_pyramid(PlyBytes::Little);
  const std::string vertex = "0.5 0.5 2. 0. 0. 1. 0.5 0.5";
  struct Case {
    std::string bytes;
    const char* message;
  };
  for (const Case& c : std::initializer_list<Case>{
           {changed(text, "ply", "plx"), "a.ply:1: error: not a PLY file"},
           {changed(text, "ascii", "klingon"), "a.ply:2: error: unknown format"},
           {changed(text, "format ascii 1.0\n", "format ascii 1.0\nformat binary_big_endian 1.0\n"),
            "a.ply:3: error: a second \"format\""},
           {changed(text, "vertex 5", "vertex 6"), "expected"},
           {changed(text, "vertex 5", "vertex -5"), "a.ply:3: error: expected a number"},
           {changed(text, "vertex 5", "vertex 99999999999999999999"), "a.ply:3: error: expected"},
           {changed(text, "vertex 5", "vertex 4294967295"), "at most 2^31 - 1"},
           {changed(text, "face 5", "face 0"), "there are no faces"},
           {changed(text, "face 5", "face 2000000000"), "the file ends"},
           {changed(text, "property float y", "property float q"), "needs a number \"y\""},
           {changed(text, "float x", "quad x"), "unknown type"},
           {changed(text, "list uchar int", "list float int"), "must be an integer"},
           {changed(text, vertex, "nan 0.5 2. 0. 0. 1. 0.5 0.5"), "found \"nan\""},
           {changed(text, vertex, "0.5 0.5 2. 0. 0. 1. 0.5"), "found \"\""},
           {changed(text, "3 0 1 4", "3 0 1 5"), "vertex 5 does not exist"},
           {changed(text, "3 0 1 4", "3 0 1 -1"), "vertex -1 does not exist"},
           {changed(text, "3 0 1 4", "2 0 1"), "at least 3 corners"},
           {changed(text, "3 0 1 4", "999999999 0 1 4"), "a list of"},
           {changed(binary, "vertex 5", "vertex 2000000000"), "bytes are left"},
           {changed(binary, "face 5", "face 2000000000"), "bytes are left"}}) {
    ModelFiles files;
    expect_model_error(files.write("a.ply", c.bytes), c.message);
  }
}

TEST(MalformedPly, ValuesThatAreNotFiniteAreRefusedInBinary) {
  std::string binary = ply_pyramid(PlyBytes::Little);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::size_t body = binary.find("end_header\n") + 11;
  std::memcpy(&binary[body + 4], &nan, 4);
  ModelFiles files;
  expect_model_error(files.write("a.ply", binary), "vertex 0 is not finite");
}

TEST(MalformedPly, IndicesBeyondTheVerticesAreRefusedInBinary) {
  for (const std::int32_t index : {5, -1, std::numeric_limits<std::int32_t>::max()}) {
    std::string binary = ply_pyramid(PlyBytes::Little);
    std::memcpy(&binary[binary.size() - 4], &index, 4);
    ModelFiles files;
    expect_model_error(files.write("a.ply", binary),
                       "face 4: vertex " + std::to_string(index) + " does not exist");
  }
}

TEST(MalformedGltf, EveryTruncationIsRefused) {
  const std::string whole = one_triangle().glb();
  for (std::size_t size = 0; size < whole.size(); size += whole.size() / 10) {
    ModelFiles files;
    expect_model_error(files.write("cut.glb", whole.substr(0, size)), "error: ");
  }
  ModelFiles files;
  GltfWriter gltf = one_triangle();
  gltf.write(files);
  const std::string json = gltf.root.dump();
  for (std::size_t size = 0; size < json.size(); size += json.size() / 10) {
    expect_model_error(files.write("model.gltf", json.substr(0, size)), "error: ");
  }
}

/// What a test does to the JSON of a good file.
using Change = void (*)(nlohmann::json&);

void expect_gltf_error(Change change, const std::string& message) {
  ModelFiles files;
  GltfWriter gltf = one_triangle();
  gltf.write(files);
  change(gltf.root);
  expect_model_error(files.write("model.gltf", gltf.root.dump()), message);
}

TEST(MalformedGltf, ReferencesAndCountsBeyondTheFileAreRefused) {
  using J = nlohmann::json;
  expect_gltf_error([](J& j) { j["accessors"][0]["count"] = 4; }, "do not fit");
  expect_gltf_error([](J& j) { j["accessors"][0]["count"] = 0; }, "expected 1 to");
  expect_gltf_error([](J& j) { j["accessors"][0]["count"] = 4e9; }, "error: ");
  expect_gltf_error([](J& j) { j["accessors"][0]["count"] = 2000000000; }, "do not fit");
  expect_gltf_error([](J& j) { j["accessors"][0]["count"] = 18446744073709551615u; }, "error: ");
  expect_gltf_error([](J& j) { j["accessors"][0]["byteOffset"] = 18446744073709551612u; },
                    "do not fit");
  expect_gltf_error([](J& j) { j["accessors"][0]["bufferView"] = 7; },
                    "buffer view 7 does not exist");
  expect_gltf_error([](J& j) { j["accessors"][0].erase("bufferView"); }, "no buffer view");
  expect_gltf_error([](J& j) { j["accessors"][0]["componentType"] = 5125; }, "type float");
  expect_gltf_error([](J& j) { j["accessors"][0]["type"] = "VEC2"; }, "elements of 3 numbers");
  expect_gltf_error([](J& j) { j["accessors"][1]["componentType"] = 5126; }, "unsigned");
  expect_gltf_error([](J& j) { j["bufferViews"][0]["byteLength"] = 1000000; }, "do not fit");
  expect_gltf_error([](J& j) { j["bufferViews"][0]["byteOffset"] = 18446744073709551612u; },
                    "do not fit");
  expect_gltf_error([](J& j) { j["bufferViews"][0]["byteStride"] = 4; }, "do not fit");
  expect_gltf_error([](J& j) { j["bufferViews"][0]["buffer"] = 3; }, "buffer 3 does not exist");
  expect_gltf_error([](J& j) { j["meshes"][0]["primitives"][0]["material"] = 9; },
                    "material 9 does not exist");
  expect_gltf_error([](J& j) { j["meshes"][0]["primitives"][0]["indices"] = 9; }, "error: ");
  expect_gltf_error([](J& j) { j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 9; },
                    "accessor 9 does not exist");
  expect_gltf_error([](J& j) { j["meshes"][0]["primitives"][0]["attributes"] = J::object(); },
                    "has no POSITION");
  expect_gltf_error([](J& j) { j["meshes"][0]["primitives"][0]["mode"] = 99; }, "unknown mode");
  expect_gltf_error([](J& j) { j["nodes"][0]["mesh"] = 3; }, "mesh 3 does not exist");
  expect_gltf_error([](J& j) { j["scenes"][0]["nodes"] = {8}; }, "node 8 does not exist");
  expect_gltf_error([](J& j) { j["scene"] = 5; }, "scene 5 does not exist");
  expect_gltf_error([](J& j) { j["nodes"][0]["children"] = {0}; }, "node 0 is reached twice");
  expect_gltf_error([](J& j) { j["nodes"][0]["rotation"] = {0, 0, 0, 0}; }, "length 1");
  expect_gltf_error([](J& j) { j["nodes"][0]["scale"] = {1, 1}; }, "scale needs 3 numbers");
  expect_gltf_error([](J& j) { j["nodes"][0]["scale"] = {0, 0, 0}; }, "no face with an area");
  expect_gltf_error([](J& j) { j["nodes"] = J::array({J::object()}); }, "no face with an area");
  expect_gltf_error([](J& j) { j["asset"]["version"] = "1.0"; }, "expected 2.0");
  expect_gltf_error([](J& j) { j["buffers"][0]["uri"] = "none.bin"; }, "none.bin");
  expect_gltf_error([](J& j) { j["buffers"][0]["byteLength"] = 1; }, "mismatch");
}

TEST(MalformedGltf, ExtensionsOfAnyTypeAreRefused) {
  using J = nlohmann::json;
  ModelFiles files;
  for (const J& extension : {J{{"light", 1e300}}, J{{"light", "sun"}}, J::object()}) {
    GltfWriter gltf = one_triangle();
    gltf.root["nodes"][0]["extensions"]["KHR_lights_punctual"] = extension;
    expect_model_error(gltf.write(files), "light -1 does not exist");
  }
  GltfWriter gltf = one_triangle();
  gltf.root["materials"] = {
      {{"emissiveFactor", {1, 1, 1}},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", "much"}}}}}}};
  gltf.root["meshes"][0]["primitives"][0]["material"] = 0;
  expect_model_error(gltf.write(files), "emissiveStrength must be a number");
}

TEST(MalformedGltf, ElementsThatNothingStandsForAreFew) {
  ModelFiles files;
  GltfWriter gltf = one_triangle();
  gltf.root["accessors"][0] = {{"componentType", 5126},
                               {"count", (1u << 20) + 1},
                               {"type", "VEC3"},
                               {"sparse",
                                {{"count", 1},
                                 {"indices", {{"bufferView", 1}, {"componentType", 5123}}},
                                 {"values", {{"bufferView", 0}}}}}};
  expect_model_error(gltf.write(files), "elements without a buffer view, at most 1048576");
}

TEST(MalformedGltf, CyclesOfNodesAreRefused) {
  expect_gltf_error(
      [](nlohmann::json& j) {
        j["nodes"] = {{{"mesh", 0}, {"children", {1}}}, {{"children", {2}}}, {{"children", {1}}}};
      },
      "node 1 is reached twice");
}

TEST(MalformedGltf, WhatWouldLookDifferentIsRefused) {
  using J = nlohmann::json;
  const auto material = [](J& j) -> J& {
    j["meshes"][0]["primitives"][0]["material"] = 0;
    j["materials"] = J::array({{{"name", "glass"}}});
    return j["materials"][0];
  };
  static const auto kMaterial = material;
  expect_gltf_error([](J& j) { kMaterial(j)["alphaMode"] = "BLEND"; },
                    "material \"glass\": alphaMode \"BLEND\" is not supported");
  expect_gltf_error(
      [](J& j) {
        J& m = kMaterial(j);
        m["emissiveFactor"] = {1, 1, 1};
        m["emissiveTexture"]["index"] = 0;
      },
      "material \"glass\": emissiveTexture is not supported");
  expect_gltf_error([](J& j) { kMaterial(j)["pbrMetallicRoughness"]["metallicFactor"] = 2; },
                    "metallicFactor must be in [0, 1]");
  expect_gltf_error(
      [](J& j) {
        kMaterial(j)["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
        j["textures"] = J::array({{{"source", 0}}});
        j["images"] = J::array({{{"uri", "none.png"}}});
      },
      "none.png does not exist");
  expect_gltf_error(
      [](J& j) {
        kMaterial(j)["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
        j["textures"] = J::array({{{"source", 0}}});
        j["images"] = J::array({{{"bufferView", 0}, {"mimeType", "image/png"}}});
      },
      "image 0 is embedded");
  expect_gltf_error(
      [](J& j) {
        j["extensionsRequired"] = {"KHR_draco_mesh_compression", "EXT_meshopt"};
      },
      "KHR_draco_mesh_compression, EXT_meshopt");
}

TEST(MalformedGltf, DeeplyNestedJsonIsRefused) {
  ModelFiles files;
  const std::string json =
      "{\"asset\":{\"version\":\"2.0\"},\"extras\":" + std::string(100000, '[') +
      std::string(100000, ']') + "}";
  expect_model_error(files.write("deep.gltf", json), "nested");
}

TEST(MalformedGltf, ValuesThatAreNotFiniteAreRefused) {
  ModelFiles files;
  GltfWriter gltf;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const int positions = gltf.add_floats({0, 0, 0, 1, nan, 0, 0, 2, 0}, 3);
  gltf.add_node({{"mesh", gltf.add_mesh({{"attributes", {{"POSITION", positions}}}})}});
  expect_model_error(gltf.write(files), "accessor 0: element 1 is not finite");
}

TEST(MalformedGltf, IndicesBeyondTheVerticesAreRefused) {
  ModelFiles files;
  GltfWriter gltf;
  const int positions = gltf.add_floats({0, 0, 0, 1, 0, 0, 0, 2, 0}, 3);
  const int indices = gltf.add_indices(std::vector<std::uint32_t>{0, 1, 3});
  gltf.add_node(
      {{"mesh", gltf.add_mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}})}});
  expect_model_error(gltf.write(files), "vertex 3 does not exist; there are 3");
}

/// Flips a few bytes of a good file again and again. Any answer is right but a crash, which the
/// sanitizers make of reads and writes out of bounds.
void flip_bytes(const std::string& name, const std::string& good) {
  std::mt19937 random(20260101);
  int accepted = 0;
  for (int round = 0; round < 250; ++round) {
    std::string bytes = good;
    const std::size_t flips = 1 + random() % 4;
    for (std::size_t i = 0; i < flips; ++i) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    ModelFiles files;
    const auto file = files.write(name, bytes);
    try {
      load_model(file);
      ++accepted;
    } catch (const InputError&) {
    }
  }
  EXPECT_LT(accepted, 250) << "no change was noticed";
}

TEST(FlippedBytes, NeverCrashTheObjReader) {
  flip_bytes("a.obj",
             "mtllib a.mtl\no a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nvt 0 0\nvn 0 0 1\nusemtl m\n"
             "f 1/1/1 2/1/1 3/1/1\ng b\nf 1//1 2//1 4//1 3//1\nf -1 -2 -3\n");
}
TEST(FlippedBytes, NeverCrashThePlyReader) {
  flip_bytes("a.ply", ply_pyramid(PlyBytes::Ascii));
  flip_bytes("a.ply", ply_pyramid(PlyBytes::Little));
  flip_bytes("a.ply", ply_pyramid(PlyBytes::Big));
}
TEST(FlippedBytes, NeverCrashTheGltfReader) {
  GltfWriter gltf = one_triangle();
  gltf.root["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}}};
  gltf.root["materials"] = {{{"emissiveFactor", {1, 1, 1}}}};
  gltf.root["meshes"][0]["primitives"][0]["material"] = 0;
  gltf.add_node({{"camera", 0}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}});
  flip_bytes("a.glb", gltf.glb());
}

}  // namespace
}  // namespace penumbra
