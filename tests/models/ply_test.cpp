#include <algorithm>
#include <bit>
#include <cstring>

#include "tests/models/ply_writer.h"

namespace penumbra {
namespace {

TEST(PlyFile, AllFormatsGiveTheSameMesh) {
  for (const PlyBytes format : {PlyBytes::Ascii, PlyBytes::Little, PlyBytes::Big}) {
    ModelFiles files;
    const Model model = load_model(files.write("pyramid.ply", ply_pyramid(format)));
    ASSERT_EQ(model.shapes.size(), 1u);
    EXPECT_EQ(model.shapes[0].name, "pyramid");
    const TriangleMeshShape& mesh = mesh_of(model, 0);
    ASSERT_EQ(mesh.vertices.size(), 5u);
    EXPECT_EQ(mesh.vertices[4], Vec3d(0.5, 0.5, 2));
    // The base is one quadrilateral.
    ASSERT_EQ(mesh.triangles.size(), 6u);
    EXPECT_NEAR(area_of(mesh), 1 + 4 * 0.5 * std::sqrt(4.25), 1e-6);
    ASSERT_EQ(mesh.normals.size(), 5u);
    EXPECT_EQ(mesh.normals[4], Vec3(0, 0, 1));
    ASSERT_EQ(mesh.uvs.size(), 5u);
    EXPECT_EQ(mesh.uvs[1], Vec2(1, 1));  // (1, 0) of the file, whose v grows upwards
  }
}

TEST(PlyFile, SubdivisionKeepsPolygons) {
  ModelFiles files;
  const Model model = load_model(files.write("pyramid.ply", ply_pyramid(PlyBytes::Little)),
                                 ModelFaces::Subdivision);
  const auto& cage = std::get<SubdivisionShape>(model.shapes.at(0).shape);
  EXPECT_EQ(cage.face_sizes, (std::vector<std::uint32_t>{4, 3, 3, 3, 3}));
  EXPECT_EQ(cage.vertices.size(), 5u);
}

TEST(PlyFile, FacesWithoutAreaAreCountedAndLeftOut) {
  ModelFiles files;
  std::string text = ply_pyramid(PlyBytes::Ascii);
  text.replace(text.find("3 0 1 4"), 7, "3 0 1 1");
  const Model model = load_model(files.write("a.ply", text));
  EXPECT_EQ(mesh_of(model, 0).triangles.size(), 5u);
  EXPECT_TRUE(std::any_of(model.warnings.begin(), model.warnings.end(), [](const std::string& w) {
    return w.find("1 of 6 triangles have no area") != std::string::npos;
  }));
}

TEST(PlyFile, WindowsLineEndsOfTextAreRead) {
  ModelFiles files;
  std::string text = ply_pyramid(PlyBytes::Ascii);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n') text.insert(i++, 1, '\r');
  }
  const Model model = load_model(files.write("a.ply", text));
  EXPECT_EQ(mesh_of(model, 0).triangles.size(), 6u);
}

TEST(PlyFile, CoordinatesInDoubleAreReadWithAWarning) {
  ModelFiles files;
  const Model model = load_model(files.write(
      "a.ply",
      "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 3\nproperty double x\nproperty "
      "double y\nproperty double z\nelement face 1\nproperty list uchar uint vertex_index\n"
      "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"));
  EXPECT_DOUBLE_EQ(area_of(mesh_of(model, 0)), 0.5);
  EXPECT_TRUE(std::any_of(model.warnings.begin(), model.warnings.end(), [](const std::string& w) {
    return w.find("single precision") != std::string::npos;
  }));
}

}  // namespace
}  // namespace penumbra
