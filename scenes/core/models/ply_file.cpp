#include <assimp/mesh.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <span>

#include "scenes/core/file_bytes.h"
#include "scenes/core/models/importers.h"
#include "scenes/core/models/mesh_tools.h"
#include "scenes/core/models/ply_layout.h"

/// PLY by assimp, between a check of the file's structure and one of the result.
namespace penumbra {
namespace {

std::size_t corner_count(const aiMesh& mesh) {
  std::size_t corners = 0;
  for (const aiFace& face : std::span(mesh.mFaces, mesh.mNumFaces)) corners += face.mNumIndices;
  return corners;
}

/// Whether faces name vertices that there are. The file's own were checked before; these are what
/// the importer made of them.
bool has_sound_indices(const aiMesh& mesh) {
  for (const aiFace& face : std::span(mesh.mFaces, mesh.mNumFaces)) {
    for (const unsigned index : std::span(face.mIndices, face.mNumIndices)) {
      if (index >= mesh.mNumVertices) return false;
    }
  }
  return true;
}

/// @throws InputError when a coordinate is not finite or too large for a scene
void check_vertices(const std::filesystem::path& file, const aiMesh& mesh) {
  constexpr float kMaxCoordinate = 1e30f;
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D& p = mesh.mVertices[i];
    if (std::abs(p.x) <= kMaxCoordinate && std::abs(p.y) <= kMaxCoordinate &&
        std::abs(p.z) <= kMaxCoordinate) {
      continue;
    }
    model_error(file, "vertex " + std::to_string(i) + " is not finite or beyond 1e30");
  }
}

/// Normals where every one can be normalised; none otherwise.
void set_normals(const aiMesh& mesh, TriangleMeshShape& shape, ModelBuilder& builder) {
  if (!mesh.HasNormals()) return;
  shape.normals.reserve(mesh.mNumVertices);
  for (const aiVector3D& n : std::span(mesh.mNormals, mesh.mNumVertices)) {
    const Vec3 normal = Vec3(n.x, n.y, n.z).normalized();
    // The sum is finite only if all are, and a zero normal stays zero.
    if (!std::isfinite(normal.x + normal.y + normal.z)) {
      model_error(builder.file(),
                  "normal " + std::to_string(shape.normals.size()) + " is not finite");
    }
    if (normal == Vec3(0.0f)) {
      builder.warn("normal " + std::to_string(shape.normals.size()) +
                   " has length 0: normals are left out and faces are flat");
      shape.normals.clear();
      return;
    }
    shape.normals.push_back(normal);
  }
}

void set_uvs(const aiMesh& mesh, TriangleMeshShape& shape, ModelBuilder& builder) {
  if (!mesh.HasTextureCoords(0)) return;
  shape.uvs.reserve(mesh.mNumVertices);
  for (const aiVector3D& uv : std::span(mesh.mTextureCoords[0], mesh.mNumVertices)) {
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) {
      model_error(builder.file(),
                  "texture coordinate " + std::to_string(shape.uvs.size()) + " is not finite");
    }
    shape.uvs.emplace_back(uv.x, 1.0f - uv.y);
  }
}

void add_triangles(const aiMesh& mesh, ModelBuilder& builder, bool keep_uvs) {
  TriangleMeshShape shape;
  shape.vertices.reserve(mesh.mNumVertices);
  for (const aiVector3D& p : std::span(mesh.mVertices, mesh.mNumVertices)) {
    shape.vertices.emplace_back(p.x, p.y, p.z);
  }
  set_normals(mesh, shape, builder);
  if (keep_uvs) set_uvs(mesh, shape, builder);
  shape.triangles.reserve(mesh.mNumFaces);
  std::vector<Vec3d> polygon;
  std::vector<std::array<std::uint32_t, 3>> cut;
  std::size_t left_out = 0;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const std::span corners(mesh.mFaces[f].mIndices, mesh.mFaces[f].mNumIndices);
    if (corners.size() == 3) {
      shape.triangles.push_back({corners[0], corners[1], corners[2]});
      continue;
    }
    polygon.clear();
    cut.clear();
    for (const unsigned corner : corners) polygon.push_back(shape.vertices[corner]);
    if (!triangulate(polygon, cut)) {
      model_error(builder.file(), "face " + std::to_string(f) + " is concave and has " +
                                      std::to_string(corners.size()) + " corners, at most " +
                                      std::to_string(kMaxConcaveCorners) + " are supported");
    }
    if (cut.empty()) left_out += corners.size() - 2;
    for (const auto& t : cut) {
      shape.triangles.push_back({corners[t[0]], corners[t[1]], corners[t[2]]});
    }
  }
  builder.add_mesh(builder.file().stem().string(), 0, std::move(shape), std::nullopt, left_out);
}

void add_cage(const aiMesh& mesh, ModelBuilder& builder) {
  SubdivisionShape cage;
  for (const aiVector3D& p : std::span(mesh.mVertices, mesh.mNumVertices)) {
    cage.vertices.emplace_back(p.x, p.y, p.z);
  }
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const std::span corners(mesh.mFaces[f].mIndices, mesh.mFaces[f].mNumIndices);
    if (has_repeats(corners)) {
      model_error(builder.file(),
                  "face " + std::to_string(f) + " of a subdivision cage meets a vertex twice");
    }
    cage.face_sizes.push_back(static_cast<std::uint32_t>(corners.size()));
    cage.indices.insert(cage.indices.end(), corners.begin(), corners.end());
  }
  builder.add_cage(builder.file().stem().string(), 0, std::move(cage), std::nullopt);
}

void report(const PlyLayout& layout, ModelBuilder& builder) {
  for (const PlyElement& element : layout.elements) {
    if (element.name == "vertex" || element.name == "face" || element.count == 0) continue;
    builder.warn(std::to_string(element.count) + " elements \"" + element.name +
                 "\" are not supported and left out");
  }
  const PlyElement& vertex = *layout.find("vertex");
  if (vertex.find("x")->type.bytes == 8) {
    builder.warn("coordinates of type double are read in single precision");
  }
  if (vertex.find("red") != nullptr) {
    builder.warn("colours of vertices are not supported and left out");
  }
}

}  // namespace

Model load_ply(const std::filesystem::path& file, ModelFaces faces) {
  ModelBuilder builder(file);
  const std::string bytes = read_bytes(file);
  const PlyLayout layout = check_ply(file, bytes);
  if (layout.find("tristrips") != nullptr) {
    model_error(file, "element \"tristrips\" is not supported; give faces");
  }
  Assimp::Importer importer;
  const aiScene* const scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, "ply");
  if (scene == nullptr || scene->mNumMeshes != 1) {
    model_error(file, std::string("assimp cannot read it: ") + importer.GetErrorString());
  }
  const aiMesh& mesh = *scene->mMeshes[0];
  if (mesh.mNumVertices != layout.find("vertex")->count ||
      mesh.mNumFaces != layout.find("face")->count || corner_count(mesh) != layout.corners) {
    model_error(file, "assimp reads " + std::to_string(mesh.mNumVertices) + " vertices and " +
                          std::to_string(mesh.mNumFaces) + " faces, the file holds " +
                          std::to_string(layout.find("vertex")->count) + " and " +
                          std::to_string(layout.find("face")->count));
  }
  if (!has_sound_indices(mesh)) {
    model_error(file, "assimp reads faces of vertices that there are not");
  }
  check_vertices(file, mesh);
  report(layout, builder);
  builder.model().materials.push_back({"default", LambertMaterial{}});
  if (faces == ModelFaces::Subdivision) {
    add_cage(mesh, builder);
  } else {
    const PlyElement& face = *layout.find("face");
    const bool has_face_uvs = face.find("texcoord") != nullptr;
    if (has_face_uvs) builder.warn("texture coordinates of faces are not supported and left out");
    add_triangles(mesh, builder, !has_face_uvs);
  }
  return builder.take();
}

}  // namespace penumbra
