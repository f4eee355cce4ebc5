// Lights that are triangle meshes: whether they can contribute, and their density over directions.

#include <algorithm>
#include <cmath>

#include "scenes/core/light.h"

namespace penumbra {
namespace {

// Möller-Trumbore for a ray from the origin; returns the distance along the unit direction, or 0
// for a miss.
float intersect_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& wi) noexcept {
  const Vec3 e1 = b - a;
  const Vec3 e2 = c - a;
  const Vec3 p = cross(wi, e2);
  const float det = dot(e1, p);
  if (det == 0.0f) return 0.0f;
  const float inv_det = 1.0f / det;
  const float u = -dot(a, p) * inv_det;
  if (!(u >= 0.0f && u <= 1.0f)) return 0.0f;
  const Vec3 q = cross(-a, e1);
  const float v = dot(wi, q) * inv_det;
  if (!(v >= 0.0f && u + v <= 1.0f)) return 0.0f;
  return std::max(dot(e2, q) * inv_det, 0.0f);
}

// Largest signed distance of a box's corners over the plane through `from`.
float highest_corner(const Light& light, const Vec3& from, const Vec3& normal) noexcept {
  float height = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    const float corner = normal[axis] > 0.0f ? light.bounds_max[axis] : light.bounds_min[axis];
    height += normal[axis] * (corner - from[axis]);
  }
  return height;
}

}  // namespace

bool LightProposal::set_up_mesh(const Vec3& normal, bool keep_all) noexcept {
  const Light& light = *light_;
  mode_ = Mode::Mesh;
  if (!keep_all && !(highest_corner(light, from_, normal) > 0.0f)) return false;
  const Vec3d low(light.bounds_min);
  const Vec3d high(light.bounds_max);
  const Vec3d to_middle = (low + high) * 0.5 - Vec3d(from_);
  const double radius = 0.5 * (high - low).length();
  if (!keep_all && !light.two_sided &&
      light.normal_bounds.all_face_away_from(from_, to_middle.length() + radius)) {
    return false;
  }
  const DirectionCone cone = cone_around(to_middle, radius);
  axis_ = cone.axis;
  one_minus_cos_ = cone.one_minus_cos;
  return true;
}

float LightProposal::mesh_pdf_w(const Vec3& wi) const noexcept {
  const Light& light = *light_;
  if (!((wi - axis_).length2() <= 2.0f * one_minus_cos_)) return 0.0f;  // no number neither
  double sum = 0.0;
  if (light.crossings != nullptr) {
    light.crossings->visit_crossings(from_, wi, [&](float t, const Vec3& n) {
      const float slope = std::abs(dot(n, wi));
      if (slope > 0.0f) sum += static_cast<double>(t * t * n.length() / slope);
    });
    return static_cast<float>(sum / light.area);
  }
  for (std::size_t i = 0; i + 2 < light.vertices.size(); i += 3) {
    const Vec3 a = light.vertices[i] - from_;
    const Vec3 b = light.vertices[i + 1] - from_;
    const Vec3 c = light.vertices[i + 2] - from_;
    const float t = intersect_triangle(a, b, c, wi);
    if (!(t > 0.0f)) continue;
    const Vec3 n = cross(b - a, c - a);  // length: twice the area
    const float slope = std::abs(dot(n, wi));
    if (slope > 0.0f) sum += static_cast<double>(t * t * n.length() / slope);
  }
  return static_cast<float>(sum / light.area);
}

}  // namespace penumbra
