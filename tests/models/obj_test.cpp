#include <algorithm>

#include "tests/models/model_fixture.h"

namespace penumbra {
namespace {

constexpr const char* kSquare =
    "v 0 0 0\nv 2 0 0\nv 2 0.5 0\nv 0 0.5 0\n"
    "f 1 2 3 4\n";

TEST(ObjFile, TwoTrianglesAreASquareAndGreyWithoutMaterials) {
  ModelFiles files;
  const Model model = load_model(files.write("square.obj", kSquare));
  ASSERT_EQ(model.shapes.size(), 1u);
  EXPECT_EQ(model.shapes[0].name, "square");
  ASSERT_EQ(model.materials.size(), 1u);
  EXPECT_EQ(std::get<LambertMaterial>(model.materials[0].model).reflectance, Rgb(0.5f));
  const TriangleMeshShape& mesh = mesh_of(model, 0);
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_DOUBLE_EQ(area_of(mesh), 1.0);
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_TRUE(mesh.uvs.empty());
}

TEST(ObjFile, ShapesAreGroupsTimesMaterialsWithUniqueNames) {
  ModelFiles files;
  files.write("m.mtl", "newmtl red\nKd 1 0 0\nnewmtl lamp\nKd 0 0 0\nKe 3 4 5\n");
  const Model model = load_model(files.write(
      "scene.obj", std::string("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n") +
                       "o box\nusemtl red\nf 1 2 3\nusemtl lamp\nf 3 2 1\nusemtl red\nf 2 3 1\n"
                       "o ball\nusemtl red\nf 1 2 3\ng\ng top\nf 1 2 3\n"));
  std::vector<std::string> names;
  for (const ShapeDescription& shape : model.shapes) names.push_back(shape.name);
  EXPECT_EQ(names, (std::vector<std::string>{"box.red", "box.lamp", "ball", "ball.top"}));
  EXPECT_EQ(mesh_of(model, 0).triangles.size(), 2u);
  ASSERT_TRUE(model.shapes[1].emission);
  EXPECT_EQ(model.shapes[1].emission->radiance, Rgb(3, 4, 5));
  EXPECT_FALSE(model.shapes[0].emission);
  EXPECT_EQ(model.materials.at(model.shapes[2].material).name, "red");
}

TEST(ObjFile, CornersThatDifferInUvOrNormalAreVerticesOfTheirOwn) {
  ModelFiles files;
  const Model model = load_model(
      files.write("a.obj",
                  "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 2\nvn 0 1 0\nvt 0 0\nvt 0.25 0.75\n"
                  "f 1/1/1 2/1/1 3/2/1\nf 1/1/1 3/2/2 4/1/1\nf -4/-1/-2 -2/1/1 -1/1/1\n"));
  const TriangleMeshShape& mesh = mesh_of(model, 0);
  // 1/1/1, 2/1/1, 3/2/1, 3/2/2, 4/1/1, 1/2/1, 3/1/1
  EXPECT_EQ(mesh.vertices.size(), 7u);
  ASSERT_EQ(mesh.normals.size(), 7u);
  ASSERT_EQ(mesh.uvs.size(), 7u);
  const std::uint32_t third = mesh.triangles[0][2];
  // The first row of an image is at v = 1 in the file and at v = 0 here.
  EXPECT_EQ(mesh.uvs[third], Vec2(0.25f, 0.25f));
  EXPECT_EQ(mesh.normals[third], Vec3(0, 0, 1));
  EXPECT_EQ(mesh.normals[mesh.triangles[1][1]], Vec3(0, 1, 0));
}

TEST(ObjFile, ConcaveFacesKeepTheirAreaAndWinding) {
  ModelFiles files;
  // An L of area 3; a fan from its first corner would cover area outside of it.
  const Model model = load_model(files.write(
      "l.obj", "v 0 2 0\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nf 4 5 6 1 2 3\n"));
  const TriangleMeshShape& mesh = mesh_of(model, 0);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  double signed_area = 0.0;
  for (const auto& t : mesh.triangles) {
    const Vec3d n = (mesh.vertices[t[1]] - mesh.vertices[t[0]])
                        .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    EXPECT_GT(n.z, 0.0);
    signed_area += 0.5 * n.z;
  }
  EXPECT_DOUBLE_EQ(signed_area, 3.0);
}

TEST(ObjFile, SubdivisionKeepsPolygons) {
  ModelFiles files;
  const Model model =
      load_model(files.write("cage.obj", std::string(kSquare) + "v 3 3 3\nf 2 3 5\n"),
                 ModelFaces::Subdivision);
  const auto& cage = std::get<SubdivisionShape>(model.shapes.at(0).shape);
  EXPECT_EQ(cage.face_sizes, (std::vector<std::uint32_t>{4, 3}));
  EXPECT_EQ(cage.indices, (std::vector<std::uint32_t>{0, 1, 2, 3, 1, 2, 4}));
  EXPECT_EQ(cage.vertices.size(), 5u);
}

}  // namespace
}  // namespace penumbra
