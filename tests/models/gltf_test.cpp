#include <algorithm>
#include <cmath>
#include <numbers>

#include "scenes/core/file_bytes.h"
#include "tests/models/gltf_writer.h"

namespace penumbra {
namespace {

Vec3d normal_of(const TriangleMeshShape& mesh, std::size_t triangle) {
  const auto& t = mesh.triangles.at(triangle);
  return (mesh.vertices[t[1]] - mesh.vertices[t[0]])
      .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
}

void expect_near(const Vec3d& a, const Vec3d& b, double tolerance) {
  EXPECT_LE((a - b).length(), tolerance) << a << " against " << b;
}

// Made by assimp from the hand-written box.dae; the expected numbers are those of that file.
void expect_assimp_box(const std::string& name) {
  const Model model =
      load_model(std::filesystem::path(PENUMBRA_SOURCE_DIR) / "tests/data/assimp_box" / name);
  ASSERT_EQ(model.shapes.size(), 2u);
  EXPECT_EQ(model.shapes[0].name, "box-node.red");
  EXPECT_EQ(model.shapes[1].name, "box-node.lamp");
  const auto& red =
      std::get<MetallicRoughnessMaterial>(model.materials.at(model.shapes[0].material).model);
  EXPECT_EQ(red.base_color, Rgb(0.75f, 0.25f, 0.125f));
  EXPECT_EQ(red.metallic, 0.0f);
  ASSERT_TRUE(model.shapes[1].emission);
  EXPECT_EQ(model.shapes[1].emission->radiance, Rgb(1.0f, 0.5f, 0.25f));
  EXPECT_FALSE(model.shapes[1].emission->two_sided);

  // Sides 2 x 6 and 1 x 6 twice each, bottom 2 x 1; then the top.
  EXPECT_NEAR(area_of(mesh_of(model, 0)), 2 * 12 + 2 * 6 + 2, 1e-5);
  EXPECT_NEAR(area_of(mesh_of(model, 1)), 2, 1e-5);
  Vec3d low(1e9), high(-1e9);
  for (const Vec3d& p : mesh_of(model, 0).vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  expect_near(low, {0.0, 0.0, -3.0}, 1e-6);
  expect_near(high, {1.0, 6.0, -1.0}, 1e-6);
  const Vec3d center = (low + high) * 0.5;
  for (std::size_t shape = 0; shape < 2; ++shape) {
    const TriangleMeshShape& mesh = mesh_of(model, shape);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      EXPECT_GT(normal_of(mesh, i).dot(mesh.vertices[mesh.triangles[i][0]] - center), 0.0)
          << "triangle " << i << " of shape " << shape << " faces inwards";
    }
  }
}

TEST(GltfFile, BoxOfAThirdPartyExporterHasItsValues) { expect_assimp_box("box.gltf"); }
TEST(GltfFile, BinaryBoxOfAThirdPartyExporterHasItsValues) { expect_assimp_box("box.glb"); }

TEST(GltfFile, NodesTransformTheirChildrenAndInstancesAreShapes) {
  ModelFiles files;
  GltfWriter gltf = one_triangle();
  // 90 degrees about z, then (10, 0, 0); the child is scaled by 2 first.
  const double h = std::sqrt(0.5);
  gltf.root["nodes"].push_back({{"mesh", 0}, {"scale", {2, 2, 2}}, {"name", "child"}});
  gltf.add_node({{"rotation", {0, 0, h, h}}, {"translation", {10, 0, 0}}, {"children", {1}}});
  const Model model = load_model(gltf.write(files));
  ASSERT_EQ(model.shapes.size(), 2u);
  EXPECT_EQ(model.shapes[0].name, "piece");
  EXPECT_EQ(model.shapes[1].name, "child");
  const TriangleMeshShape& mesh = mesh_of(model, 1);
  expect_near(mesh.vertices[0], {10, 0, 0}, 1e-12);
  expect_near(mesh.vertices[1], {10, 2, 0}, 1e-12);
  expect_near(mesh.vertices[2], {6, 0, 0}, 1e-12);
}

TEST(GltfFile, MirroredNodesKeepTheirFrontAndNormals) {
  ModelFiles files;
  GltfWriter gltf;
  const int positions = gltf.add_floats({0, 0, 0, 1, 0, 1, 0, 1, 0}, 3);
  // The triangle's own normal, (0-1*1, ...) = (1,0,1) x (0,1,0) = (-1, 0, 1).
  const int normals = gltf.add_floats({-1, 0, 1, -1, 0, 1, -1, 0, 1}, 3);
  gltf.add_node(
      {{"mesh", gltf.add_mesh({{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}}})},
       {"scale", {-3, 1, 0.5}}});
  const Model model = load_model(gltf.write(files));
  const TriangleMeshShape& mesh = mesh_of(model, 0);
  // Points (x, z) -> (-3x, z/2): the plane z = x becomes z = -x/6, its front towards +z.
  const Vec3d expected = Vec3d(1.0 / 6.0, 0, 1).normalized();
  expect_near(normal_of(mesh, 0).normalized(), expected, 1e-9);
  expect_near(Vec3d(mesh.normals.at(0)), expected, 1e-6);
}

TEST(GltfFile, StripsFansAndAllIndexTypesGiveTheSameSquare) {
  for (const int mode : {4, 5, 6}) {
    for (const std::size_t bytes :
         {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{4}}) {
      ModelFiles files;
      GltfWriter gltf;
      std::vector<std::uint32_t> corners = mode == 4 ? std::vector<std::uint32_t>{0, 1, 2, 2, 1, 3}
                                           : mode == 5 ? std::vector<std::uint32_t>{0, 1, 2, 3}
                                                       : std::vector<std::uint32_t>{0, 1, 3, 2};
      const std::vector<float> square{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
      std::vector<float> positions = square;
      nlohmann::json primitive = {{"mode", mode}};
      if (bytes == 0) {
        positions.clear();
        for (const std::uint32_t corner : corners) {
          positions.insert(positions.end(), &square[corner * 3], &square[corner * 3] + 3);
        }
      } else if (bytes == 1) {
        primitive["indices"] =
            gltf.add_indices(std::vector<std::uint8_t>(corners.begin(), corners.end()));
      } else if (bytes == 2) {
        primitive["indices"] =
            gltf.add_indices(std::vector<std::uint16_t>(corners.begin(), corners.end()));
      } else {
        primitive["indices"] = gltf.add_indices(corners);
      }
      primitive["attributes"]["POSITION"] = gltf.add_floats(positions, 3);
      gltf.add_node({{"mesh", gltf.add_mesh(primitive)}});
      const Model model = load_model(gltf.write(files));
      const TriangleMeshShape& mesh = mesh_of(model, 0);
      ASSERT_EQ(mesh.triangles.size(), 2u) << "mode " << mode << ", index bytes " << bytes;
      EXPECT_DOUBLE_EQ(area_of(mesh), 1.0);
      for (std::size_t i = 0; i < 2; ++i) expect_near(normal_of(mesh, i), {0, 0, 1}, 0.0);
    }
  }
}

TEST(GltfFile, SparseAccessorsReplaceElements) {
  ModelFiles files;
  GltfWriter gltf = one_triangle();
  const int indices = gltf.add_view(std::vector<std::uint16_t>{2});
  const int values = gltf.add_view(std::vector<float>{0, 5, 0});
  gltf.root["accessors"][0]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
      {"values", {{"bufferView", values}}}};
  const Model model = load_model(gltf.write(files));
  expect_near(mesh_of(model, 0).vertices[2], {0, 5, 0}, 0.0);
  expect_near(mesh_of(model, 0).vertices[1], {1, 0, 0}, 0.0);
}

TEST(GltfFile, MaterialsMapFactorsTexturesAndMasks) {
  ModelFiles files;
  GltfWriter gltf = one_triangle();
  files.write("leaf color.png", "not decoded here");
  files.write("orm.png", "neither");
  gltf.root["images"] = {{{"uri", "leaf%20color.png"}}, {{"uri", "orm.png"}}};
  gltf.root["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}}};
  gltf.root["textures"] = {{{"source", 0}, {"sampler", 0}}, {{"source", 1}}};
  gltf.root["materials"] = {
      {{"name", "leaf"},
       {"alphaMode", "MASK"},
       {"alphaCutoff", 0.25},
       {"doubleSided", true},
       {"emissiveFactor", {1, 0.5, 0}},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 8.0}}}}},
       {"pbrMetallicRoughness",
        {{"baseColorFactor", {0.5, 1, 1, 0.5}},
         {"metallicFactor", 0.75},
         {"roughnessFactor", 0.5},
         {"baseColorTexture", {{"index", 0}}},
         {"metallicRoughnessTexture", {{"index", 1}}}}}}};
  gltf.root["meshes"][0]["primitives"][0]["material"] = 0;
  const Model model = load_model(gltf.write(files));
  const MaterialDescription& material = model.materials.at(0);
  EXPECT_EQ(material.name, "leaf");
  const auto& pbr = std::get<MetallicRoughnessMaterial>(material.model);
  EXPECT_EQ(pbr.base_color, Rgb(0.5f, 1.0f, 1.0f));
  EXPECT_EQ(pbr.metallic, 0.75f);
  EXPECT_EQ(pbr.roughness, 0.5f);
  ASSERT_TRUE(material.reflectance_texture);
  EXPECT_EQ(material.reflectance_texture->file, (files.folder() / "leaf color.png").string());
  EXPECT_EQ(material.reflectance_texture->content_hash, hash_bytes("not decoded here"));
  EXPECT_TRUE(material.reflectance_texture->srgb);
  EXPECT_EQ(material.reflectance_texture->wrap_u, TextureWrap::Clamp);
  EXPECT_EQ(material.reflectance_texture->wrap_v, TextureWrap::Mirror);
  ASSERT_TRUE(material.roughness_texture && material.metallic_texture);
  EXPECT_EQ(material.roughness_texture->channel, 1);
  EXPECT_EQ(material.metallic_texture->channel, 2);
  EXPECT_FALSE(material.roughness_texture->srgb);
  ASSERT_TRUE(material.mask);
  EXPECT_EQ(material.mask->texture.channel, 3);
  EXPECT_FLOAT_EQ(material.mask->cutoff, 0.5f);  // 0.25 of alpha that is halved
  ASSERT_TRUE(model.shapes[0].emission);
  EXPECT_EQ(model.shapes[0].emission->radiance, Rgb(8.0f, 4.0f, 0.0f));
  EXPECT_TRUE(model.shapes[0].emission->two_sided);
}

TEST(GltfFile, SmoothMetalWithoutTexturesIsAMirrorAndNoMaterialIsTheDefault) {
  ModelFiles files;
  GltfWriter gltf = one_triangle();
  gltf.root["materials"] = {{{"pbrMetallicRoughness",
                              {{"baseColorFactor", {0.9, 0.8, 0.7, 1}}, {"roughnessFactor", 0}}}}};
  gltf.root["meshes"][0]["primitives"].push_back(gltf.root["meshes"][0]["primitives"][0]);
  gltf.root["meshes"][0]["primitives"][0]["material"] = 0;
  const Model model = load_model(gltf.write(files));
  EXPECT_EQ(std::get<MirrorMaterial>(model.materials.at(0).model).reflectance,
            Rgb(0.9f, 0.8f, 0.7f));
  EXPECT_EQ(std::get<MetallicRoughnessMaterial>(model.materials.at(1).model).roughness, 1.0f);
  EXPECT_EQ(model.materials.at(1).name, "default");
}

TEST(GltfFile, LightsShineAlongMinusZOfTheirNodes) {
  ModelFiles files;
  GltfWriter gltf = one_triangle();
  gltf.root["extensionsUsed"] = {"KHR_lights_punctual"};
  gltf.root["extensionsRequired"] = {"KHR_lights_punctual"};
  gltf.root["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"intensity", 10.0}, {"color", {1, 0.5, 0}}, {"range", 5.0}},
      {{"type", "spot"},
       {"intensity", 2.0},
       {"spot",
        {{"innerConeAngle", std::numbers::pi / 6}, {"outerConeAngle", std::numbers::pi / 3}}}},
      {{"type", "directional"}, {"name", "sun"}, {"intensity", 3.0}}};
  const auto light = [](int index) {
    return nlohmann::json{{"KHR_lights_punctual", {{"light", index}}}};
  };
  const double h = std::sqrt(0.5);
  gltf.add_node({{"name", "bulb"}, {"translation", {1, 2, 3}}, {"extensions", light(0)}});
  // Turned by 90 degrees about x, -z becomes +y.
  gltf.add_node({{"name", "torch"}, {"rotation", {h, 0, 0, h}}, {"extensions", light(1)}});
  gltf.add_node({{"rotation", {-h, 0, 0, h}}, {"extensions", light(2)}});
  const Model model = load_model(gltf.write(files));
  ASSERT_EQ(model.point_lights.size(), 1u);
  EXPECT_EQ(model.point_lights[0].name, "bulb");
  expect_near(model.point_lights[0].position, {1, 2, 3}, 0.0);
  expect_near(model.point_lights[0].intensity, {10, 5, 0}, 1e-12);
  ASSERT_EQ(model.spot_lights.size(), 1u);
  expect_near(model.spot_lights[0].direction, {0, 1, 0}, 1e-12);
  EXPECT_NEAR(model.spot_lights[0].inner_angle_deg, 30.0, 1e-9);
  EXPECT_NEAR(model.spot_lights[0].outer_angle_deg, 60.0, 1e-9);
  ASSERT_EQ(model.directional_lights.size(), 1u);
  EXPECT_EQ(model.directional_lights[0].name, "sun");
  expect_near(model.directional_lights[0].direction, {0, -1, 0}, 1e-12);
  EXPECT_EQ(model.directional_lights[0].irradiance, Rgb(3.0f));
  EXPECT_TRUE(std::any_of(model.warnings.begin(), model.warnings.end(), [](const std::string& w) {
    return w.find("range") != std::string::npos;
  }));
}

TEST(GltfFile, FirstPerspectiveCameraIsTaken) {
  ModelFiles files;
  GltfWriter gltf = one_triangle();
  gltf.root["cameras"] = {{{"type", "orthographic"},
                           {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0}, {"zfar", 9}}}},
                          {{"type", "perspective"},
                           {"perspective", {{"yfov", 0.5}, {"aspectRatio", 0.5}, {"znear", 0.1}}}}};
  const double h = std::sqrt(0.5);
  gltf.add_node({{"camera", 0}});
  // Turned by -90 degrees about y, -z becomes +x.
  gltf.add_node({{"camera", 1}, {"translation", {0, 1, 0}}, {"rotation", {0, -h, 0, h}}});
  gltf.add_node({{"camera", 1}});
  const Model model = load_model(gltf.write(files));
  ASSERT_TRUE(model.camera);
  EXPECT_NEAR(model.camera->vertical_fov_deg, 0.5 * 180 / std::numbers::pi, 1e-9);
  expect_near(model.camera->position, {0, 1, 0}, 0.0);
  expect_near(model.camera->look_at - model.camera->position, {1, 0, 0}, 1e-12);
  expect_near(model.camera->up, {0, 1, 0}, 1e-12);
  EXPECT_EQ(model.camera->resolution, (std::array<int, 2>{240, 480}));
}

TEST(GltfFile, BinaryContainerHoldsTheSameModel) {
  ModelFiles files;
  const Model model = load_model(files.write("a.glb", one_triangle().glb()));
  EXPECT_DOUBLE_EQ(area_of(mesh_of(model, 0)), 1.0);
}

}  // namespace
}  // namespace penumbra
