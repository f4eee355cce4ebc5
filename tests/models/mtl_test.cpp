#include <algorithm>

#include "scenes/core/file_bytes.h"
#include "tests/models/model_fixture.h"

namespace penumbra {
namespace {

/// Loads a triangle whose material is the first of a library.
Model load_with_material(const ModelFiles& files, const std::string& statements) {
  files.write("m.mtl", "newmtl m\n" + statements);
  return load_model(
      files.write("a.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"));
}

bool warns(const Model& model, const std::string& text) {
  return std::any_of(model.material_warnings.begin(), model.material_warnings.end(),
                     [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

TEST(MtlFile, DiffuseColourIsALambertSurface) {
  ModelFiles files;
  const Model model = load_with_material(files, "Ka 1 1 1\nKd 0.5 0.25 0\nNi 1.5\nd 1\nillum 1\n");
  EXPECT_EQ(model.materials.at(0).name, "m");
  EXPECT_EQ(std::get<LambertMaterial>(model.materials[0].model).reflectance,
            Rgb(0.5f, 0.25f, 0.0f));
  EXPECT_TRUE(model.material_warnings.empty()) << model.material_warnings[0];
}

TEST(MtlFile, HighlightIsAPhongLobeWithinEnergy) {
  ModelFiles files;
  const Model sound =
      load_with_material(files, "Kd 0.5 0.5 0.5\nKs 0.25 0.25 0.25\nNs 30\nillum 2\n");
  const auto& phong = std::get<PhongMaterial>(sound.materials.at(0).model);
  EXPECT_EQ(phong.specular, Rgb(0.25f));
  EXPECT_EQ(phong.exponent, 30.0f);
  EXPECT_TRUE(sound.material_warnings.empty());

  const Model loud = load_with_material(files, "Kd 1 0.5 0.5\nKs 1 0.5 0.5\nNs 0\n");
  const auto& scaled = std::get<PhongMaterial>(loud.materials.at(0).model);
  EXPECT_EQ(scaled.diffuse, Rgb(0.5f, 0.25f, 0.25f));
  EXPECT_EQ(scaled.specular, Rgb(0.5f, 0.25f, 0.25f));
  EXPECT_EQ(scaled.exponent, 1.0f);
  EXPECT_TRUE(warns(loud, "scaled to 1"));
  EXPECT_TRUE(warns(loud, "Ns"));
}

TEST(MtlFile, ReflectionModel3WithoutDiffuseColourIsAMirror) {
  ModelFiles files;
  const Model model = load_with_material(files, "Kd 0 0 0\nKs 0.9 0.8 0.7\nNs 100\nillum 3\n");
  EXPECT_EQ(std::get<MirrorMaterial>(model.materials.at(0).model).reflectance,
            Rgb(0.9f, 0.8f, 0.7f));
}

TEST(MtlFile, RoughnessAndMetalnessAreThoseOfGltf) {
  ModelFiles files;
  files.write("rough.png", "r");
  files.write("color.png", "c");
  const Model model = load_with_material(
      files,
      "Kd 0.5 0.5 0.5\nPr 0.25\nPm 1\nmap_Pr rough.png\nmap_Kd -clamp on color.png\n"
      "map_d color.png\n");
  const MaterialDescription& material = model.materials.at(0);
  const auto& pbr = std::get<MetallicRoughnessMaterial>(material.model);
  EXPECT_EQ(pbr.roughness, 0.25f);
  EXPECT_EQ(pbr.metallic, 1.0f);
  ASSERT_TRUE(material.roughness_texture && material.reflectance_texture && material.mask);
  EXPECT_FALSE(material.metallic_texture);
  EXPECT_EQ(material.roughness_texture->content_hash, hash_bytes("r"));
  EXPECT_FALSE(material.roughness_texture->srgb);
  EXPECT_TRUE(material.reflectance_texture->srgb);
  EXPECT_EQ(material.reflectance_texture->wrap_v, TextureWrap::Clamp);
  EXPECT_EQ(material.mask->texture.channel, 3);  // alpha of the colours' own image
}

TEST(MtlFile, TextureWithoutColourIsTheWholeColourInEveryMaterial) {
  ModelFiles files;
  files.write("color.png", "c");
  // tinyobjloader itself would take 0.6 in the first and, after its Kd, 0 in the second.
  files.write("m.mtl", "newmtl m\nKd 0.5 0.5 0.5\nnewmtl n\nmap_Kd color.png\n");
  const Model model = load_model(
      files.write("a.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl n\nf 1 2 3\n"));
  EXPECT_EQ(std::get<LambertMaterial>(model.materials.at(0).model).reflectance, Rgb(1.0f));
}

TEST(MtlFile, UnsupportedStatementsAreNamed) {
  ModelFiles files;
  files.write("bump.png", "b");
  const Model model =
      load_with_material(files, "Kd 1 1 1\nd 0.5\nmap_Bump bump.png\nPcr 0.5\nPs 0\nfoo 1\n");
  EXPECT_TRUE(warns(model, "transparent"));
  EXPECT_TRUE(warns(model, "\"map_Bump\""));
  EXPECT_TRUE(warns(model, "\"Pcr\""));
  EXPECT_FALSE(warns(model, "\"Ps\""));  // 0 is nothing
  EXPECT_TRUE(warns(model, "\"foo\""));
}

TEST(MtlFile, MissingLibraryLeavesGreyAndSaysSo) {
  ModelFiles files;
  const Model model = load_model(
      files.write("a.obj", "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"));
  EXPECT_EQ(std::get<LambertMaterial>(model.materials.at(0).model).reflectance, Rgb(0.5f));
  EXPECT_TRUE(warns(model, "line 1: material library \"gone.mtl\" does not exist"));
  EXPECT_TRUE(warns(model, "material \"m\" is not defined"));
}

TEST(MtlFile, NamesMayHoldSpacesAndStatementsSeveralLibraries) {
  ModelFiles files;
  files.write("my colours.mtl", "newmtl light red\r\nKd 1 0.5 0.5\r\n");
  files.write("b.mtl", "newmtl blue\nKd 0 0 1\n");
  files.write("c.mtl", "newmtl green\nKd 0 1 0\n");
  const Model model = load_model(
      files.write("a.obj",
                  "mtllib my colours.mtl\nmtllib b.mtl c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"
                  "usemtl light red\nf 1 2 3\nusemtl green\nf 1 2 3\n"));
  ASSERT_EQ(model.materials.size(), 2u);
  EXPECT_EQ(model.materials[0].name, "light red");
  EXPECT_EQ(std::get<LambertMaterial>(model.materials[1].model).reflectance, Rgb(0, 1, 0));
}

}  // namespace
}  // namespace penumbra
