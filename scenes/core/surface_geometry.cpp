#include "scenes/core/surface_geometry.h"

#include <array>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

template <std::size_t N>
void add_mesh(const std::vector<Vec3d>& vertices,
              const std::vector<std::array<std::uint32_t, N>>& faces, SurfaceGeometry& geometry) {
  geometry.corners = N;
  geometry.vertices.assign(vertices.begin(), vertices.end());
  geometry.indices.reserve(faces.size() * N);
  for (const auto& face : faces) {
    geometry.indices.insert(geometry.indices.end(), face.begin(), face.end());
  }
}

void add(const RectangleShape& s, SurfaceGeometry& geometry) {
  geometry.corners = 4;
  geometry.vertices = {Vec3(s.origin), Vec3(s.origin + s.edge_u),
                       Vec3(s.origin + s.edge_u + s.edge_v), Vec3(s.origin + s.edge_v)};
  geometry.indices = {0, 1, 2, 3};
  // Upright and not mirrored for who sees edge_u to the right and edge_v upwards.
  geometry.uvs = {Vec2(0, 1), Vec2(1, 1), Vec2(1, 0), Vec2(0, 0)};
}

void add(const SphereShape& s, SurfaceGeometry& geometry) {
  geometry.corners = 0;
  geometry.center = Vec3(s.center);
  geometry.radius = static_cast<float>(s.radius);
}

void add(const TriangleMeshShape& s, SurfaceGeometry& geometry) {
  add_mesh(s.vertices, s.triangles, geometry);
  PN_CHECK(s.normals.empty() || s.normals.size() == s.vertices.size(), "one normal per vertex");
  PN_CHECK(s.uvs.empty() || s.uvs.size() == s.vertices.size(), "one uv per vertex");
  geometry.normals.reserve(s.normals.size());
  for (const Vec3& n : s.normals) {
    geometry.normals.push_back(is_usable_normal(n) ? Vec3(Vec3d(n).normalized()) : Vec3(0.0f));
  }
  geometry.uvs = s.uvs;
}

void add(const QuadMeshShape& s, SurfaceGeometry& geometry) {
  add_mesh(s.vertices, s.quads, geometry);
}

void add(const SubdivisionShape& s, SurfaceGeometry& geometry) {
  geometry.corners = 0;
  geometry.vertices.assign(s.vertices.begin(), s.vertices.end());
  geometry.indices = s.indices;
  geometry.face_sizes = s.face_sizes;
  geometry.subdivision_level = s.level;
}

}  // namespace

bool is_usable_normal(const Vec3& n) noexcept {
  return std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z) && n != Vec3(0.0f);
}

SurfaceGeometry make_geometry(const ShapeDescription& shape) {
  if (shape.emission && std::holds_alternative<SubdivisionShape>(shape.shape)) {
    throw InputError("shape \"" + shape.name +
                     "\" has an emission, but a subdivision surface cannot be a light; allowed: "
                     "rectangles, spheres and meshes of triangles or quads");
  }
  SurfaceGeometry geometry;
  geometry.material = shape.material;
  std::visit([&](const auto& s) { add(s, geometry); }, shape.shape);
  return geometry;
}

Vec2 uv_at(const SurfaceGeometry& geometry, const RayHit& hit) noexcept {
  if (geometry.uvs.empty()) return Vec2(0.0f);
  const std::uint32_t* index = &geometry.indices[std::size_t{hit.primitive} * geometry.corners];
  const auto uv = [&](std::uint32_t k) { return geometry.uvs[index[k]]; };
  // The coordinates of a parallelogram's hit count along its edges from corner 0 in both halves.
  return uv(0) * (1.0f - hit.u - hit.v) + uv(1) * hit.u + uv(geometry.corners - 1) * hit.v;
}

std::size_t traced_triangles(const SurfaceGeometry& geometry) noexcept {
  if (geometry.subdivision_level == 0) {
    return geometry.corners == 0
               ? 0
               : geometry.indices.size() / geometry.corners * (geometry.corners - 2);
  }
  const auto level = static_cast<std::size_t>(geometry.subdivision_level);
  const std::size_t half_level = (level + 1) / 2;
  std::size_t quads = 0;
  for (const std::uint32_t size : geometry.face_sizes) {
    quads += size == 4 ? level * level : size * half_level * half_level;
  }
  return 2 * quads;
}

}  // namespace penumbra
