#include "scenes/core/mesh_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scenes/core/surface_geometry.h"

namespace penumbra {
namespace {

Vec3d rotated(Vec3d v, const Vec3d& degrees) {
  for (int axis = 0; axis < 3; ++axis) {
    const double angle = degrees[axis] * M_PI / 180.0;
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    const int a = (axis + 1) % 3;
    const int b = (axis + 2) % 3;
    const double va = v[a];
    v[a] = c * va - s * v[b];
    v[b] = s * va + c * v[b];
  }
  return v;
}

Vec3d rotated(Vec3d v, const std::vector<Vec3d>& rotations_deg) {
  for (const Vec3d& degrees : rotations_deg) v = rotated(v, degrees);
  return v;
}

bool place_vertices(std::vector<Vec3d>& vertices, const ModelPlacement& placement) {
  std::vector<Vec3d> placed(vertices.size());
  Vec3d low(std::numeric_limits<double>::infinity());
  Vec3d high = -low;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    placed[i] = rotated(vertices[i], placement.rotations_deg);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], placed[i][axis]);
      high[axis] = std::max(high[axis], placed[i][axis]);
    }
  }
  const double height = high.y - low.y;
  if (placement.height && !(height > 0.0)) return false;
  const double scale = placement.height ? *placement.height / height : placement.scale;
  const Vec3d base((low.x + high.x) * 0.5, low.y, (low.z + high.z) * 0.5);
  for (Vec3d& p : placed) {
    p = placement.position ? (p - base) * scale + *placement.position : p * scale;
  }
  vertices = std::move(placed);
  return true;
}

void append_vertices(std::vector<Vec3d>& vertices, const std::vector<Vec3d>& other) {
  vertices.insert(vertices.end(), other.begin(), other.end());
}

// Appends values per vertex where either mesh has them.
template <typename T>
void append_values(std::vector<T>& values, std::size_t vertices, const std::vector<T>& other,
                   std::size_t other_vertices) {
  if (values.empty() && other.empty()) return;
  values.resize(vertices, T(0.0f));
  values.insert(values.end(), other.begin(), other.end());
  values.resize(vertices + other_vertices, T(0.0f));
}

}  // namespace

bool place_mesh(TriangleMeshShape& mesh, const ModelPlacement& placement) {
  if (!place_vertices(mesh.vertices, placement)) return false;
  for (Vec3& n : mesh.normals) n = Vec3(rotated(Vec3d(n), placement.rotations_deg));
  return true;
}

bool place_mesh(SubdivisionShape& cage, const ModelPlacement& placement) {
  return place_vertices(cage.vertices, placement);
}

void append_mesh(TriangleMeshShape& mesh, const TriangleMeshShape& other) {
  const std::size_t count = mesh.vertices.size();
  append_values(mesh.normals, count, other.normals, other.vertices.size());
  append_values(mesh.uvs, count, other.uvs, other.vertices.size());
  append_vertices(mesh.vertices, other.vertices);
  const auto first = static_cast<std::uint32_t>(count);
  for (const auto& t : other.triangles) {
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

void append_mesh(SubdivisionShape& cage, const SubdivisionShape& other) {
  const auto first = static_cast<std::uint32_t>(cage.vertices.size());
  append_vertices(cage.vertices, other.vertices);
  cage.face_sizes.insert(cage.face_sizes.end(), other.face_sizes.begin(), other.face_sizes.end());
  for (const std::uint32_t index : other.indices) cage.indices.push_back(index + first);
}

void smooth_normals(TriangleMeshShape& mesh) {
  std::vector<Vec3d> sums(mesh.vertices.size(), Vec3d(0.0));
  for (const auto& t : mesh.triangles) {
    // As long as twice the area.
    const Vec3d n = (mesh.vertices[t[1]] - mesh.vertices[t[0]])
                        .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    for (const std::uint32_t vertex : t) sums[vertex] += n;
  }
  mesh.normals.resize(mesh.vertices.size(), Vec3(0.0f));
  for (std::size_t v = 0; v < sums.size(); ++v) {
    if (!is_usable_normal(mesh.normals[v])) mesh.normals[v] = Vec3(sums[v].normalized());
  }
}

std::size_t drop_unusable_normals(TriangleMeshShape& mesh) {
  std::size_t dropped = 0;
  for (Vec3& n : mesh.normals) {
    if (is_usable_normal(n)) continue;
    n = Vec3(0.0f);
    ++dropped;
  }
  return dropped;
}

}  // namespace penumbra
