#pragma once

#include <cstdint>
#include <vector>

#include "scenes/core/ray_batch.h"
#include "scenes/core/scene_description.h"
#include "scenes/core/vec.h"

namespace penumbra {

/// A shape in scene space and single precision, as rays meet it and shading points are made on it.
struct SurfaceGeometry {
  std::uint32_t material{0};
  std::int32_t light{-1};    ///< of its emission, or kNoLight
  std::uint32_t corners{3};  ///< of a face: 3, 4, or 0 for a sphere and a subdivision surface
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;  ///< `corners` per face
  std::vector<Vec3> normals;  ///< [vertex] unit, or 0: the face's own normal there; empty: flat
  std::vector<Vec2> uvs;  ///< [vertex]; empty: none. Of quadrilaterals, only rectangles have them
  std::vector<std::uint32_t> face_sizes;  ///< of a subdivision surface's cage
  int subdivision_level{0};               ///< 0: not a subdivision surface
  Vec3 center{0.0f};                      ///< of a sphere
  float radius{0.0f};
};

/// @param shape  normalised
/// @throws InputError where a subdivision surface has an emission
SurfaceGeometry make_geometry(const ShapeDescription& shape);

/// Texture coordinates of a hit on the shape; (0, 0) where it has none.
Vec2 uv_at(const SurfaceGeometry& geometry, const RayHit& hit) noexcept;

/// Triangles that rays meet; quads count as two. Of a subdivision surface, what its level asks for:
/// `level` squared quads in a quadrilateral of the cage, and in each of the n quarters of another
/// face half as many per edge. Embree does not report what it makes of that.
std::size_t traced_triangles(const SurfaceGeometry& geometry) noexcept;

/// Whether a vertex normal has a direction: finite, and not 0. Where it has none, the face's own
/// normal stands in for it.
bool is_usable_normal(const Vec3& n) noexcept;

/// Normal of a triangle, as long as twice its area.
inline Vec3 triangle_normal(const Vec3* corner) noexcept {
  return cross(corner[1] - corner[0], corner[2] - corner[0]);
}

}  // namespace penumbra
