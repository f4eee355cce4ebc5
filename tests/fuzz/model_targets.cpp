#include <cmath>

#include "scenes/core/error.h"
#include "scenes/core/models/model_file.h"
#include "tests/fuzz/refusal.h"
#include "tests/fuzz/target.h"

namespace penumbra {
namespace {

bool finite(const Vec3d& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void check_mesh(const TriangleMeshShape& mesh) {
  const std::size_t count = mesh.vertices.size();
  for (const Vec3d& vertex : mesh.vertices) PN_CHECK(finite(vertex), "a vertex is finite");
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) PN_CHECK(corner < count, "a corner exists");
  }
  PN_CHECK(mesh.normals.empty() || mesh.normals.size() == count, "normals of all vertices or none");
  for (const Vec3& normal : mesh.normals) PN_CHECK(finite(Vec3d(normal)), "a normal is finite");
  PN_CHECK(mesh.uvs.empty() || mesh.uvs.size() == count, "coordinates of all vertices or none");
}

void check_model(const Model& model) {
  PN_CHECK(!model.shapes.empty(), "a model has a shape");
  for (const ShapeDescription& shape : model.shapes) {
    PN_CHECK(shape.material < model.materials.size(), "a material exists");
    if (const auto* mesh = std::get_if<TriangleMeshShape>(&shape.shape)) check_mesh(*mesh);
  }
}

/// Reads a model in both ways.
void read_model(const std::filesystem::path& file) {
  for (const ModelFaces faces : {ModelFaces::Triangles, ModelFaces::Subdivision}) {
    accepts<InputError>(file.parent_path().string(), [&] { check_model(load_model(file, faces)); });
  }
}

}  // namespace

/// An OBJ file, and behind a line "#--- mtl" the material library "input.mtl".
void fuzz_obj(const Sandbox& sandbox, std::string_view input) {
  const std::vector<std::string_view> parts = split_input(input, "#--- mtl\n");
  sandbox.write("input.mtl", parts.size() > 1 ? parts[1] : std::string_view());
  read_model(sandbox.write("input.obj", parts.front()));
}

void fuzz_ply(const Sandbox& sandbox, std::string_view input) {
  read_model(sandbox.write("input.ply", input));
}

void fuzz_gltf(const Sandbox& sandbox, std::string_view input) {
  read_model(sandbox.write("input.gltf", input));
}

}  // namespace penumbra
