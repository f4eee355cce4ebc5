#pragma once

#include <ImathVec.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "scenes/core/light.h"
#include "scenes/core/vec.h"

/// The formulas of the scene core in long double, for differential tests: they take the core's
/// float inputs as exact, and share no code with it. Where the core has a form that keeps its
/// digits, the textbook's stands here.
namespace penumbra::test::oracle {

using Real = long double;
using Vec2r = Imath::Vec2<Real>;
using Vec3r = Imath::Vec3<Real>;

inline constexpr Real kPiR = std::numbers::pi_v<Real>;

/// Concentric map of Shirley and Chiu 1997 in its first form, by quarters of the square.
inline Vec2r uniform_disk(const Vec2& u) {
  const Real a = 2.0L * Real{u.x} - 1.0L;
  const Real b = 2.0L * Real{u.y} - 1.0L;
  if (a == 0.0L && b == 0.0L) return {0.0L, 0.0L};
  const bool a_major = std::abs(a) > std::abs(b);
  const Real r = a_major ? a : b;
  const Real phi = a_major ? kPiR / 4.0L * (b / a) : kPiR / 2.0L - kPiR / 4.0L * (a / b);
  return {r * std::cos(phi), r * std::sin(phi)};
}

inline Vec3r cosine_hemisphere(const Vec2& u) {
  const Vec2r d = uniform_disk(u);
  return {d.x, d.y, std::sqrt(std::max(0.0L, 1.0L - d.x * d.x - d.y * d.y))};
}

/// Uniform cone by its angle, 1 - cos = 2 sin^2(angle/2).
inline Vec3r uniform_cone(const Vec2& u, float one_minus_cos) {
  const Real angle =
      2.0L * std::asin(std::min(1.0L, std::sqrt(0.5L * Real{u.x} * Real{one_minus_cos})));
  const Real phi = 2.0L * kPiR * Real{u.y};
  return {std::sin(angle) * std::cos(phi), std::sin(angle) * std::sin(phi), std::cos(angle)};
}

/// Direction to the point (u, v) of a rectangle, and its density for uniform points: r^2/(A cos).
struct Sample {
  Vec3r wi;
  Real pdf_w;
};
inline Sample rectangle_by_area(const Light& light, const Vec3& from, const Vec2& u) {
  const Vec3r edge_u(light.edge_u);
  const Vec3r edge_v(light.edge_v);
  const Vec3r d = Vec3r(light.origin) + edge_u * Real{u.x} + edge_v * Real{u.y} - Vec3r(from);
  const Vec3r n = edge_u.cross(edge_v);
  const Real r = std::sqrt(d.dot(d));
  return {d / r, r * r * r / std::abs(n.dot(d))};
}

/// The same for a direction: 0 where it misses the rectangle.
inline Real rectangle_pdf_w(const Light& light, const Vec3& from, const Vec3& wi) {
  const Vec3r edge_u(light.edge_u);
  const Vec3r edge_v(light.edge_v);
  const Vec3r n = edge_u.cross(edge_v);
  const Vec3r to_origin = Vec3r(light.origin) - Vec3r(from);
  const Vec3r w(wi);
  const Real slope = n.dot(w);
  if (slope == 0.0L) return 0.0L;
  const Real t = n.dot(to_origin) / slope;
  if (!(t > 0.0L)) return 0.0L;
  const Vec3r p = w * t - to_origin;
  const Real u = p.dot(edge_u) / edge_u.dot(edge_u);
  const Real v = p.dot(edge_v) / edge_v.dot(edge_v);
  if (u < 0.0L || u > 1.0L || v < 0.0L || v > 1.0L) return 0.0L;
  return t * t / std::abs(slope);
}

/// Sum over the triangles of a mesh that a line of direction wi meets, by barycentric coordinates
/// from triple products.
inline Real mesh_pdf_w(const Light& light, const Vec3& from, const Vec3& wi) {
  const Vec3r w(wi);
  Real sum = 0.0L;
  Real area = 0.0L;
  for (std::size_t i = 0; i + 2 < light.vertices.size(); i += 3) {
    const Vec3r a = Vec3r(light.vertices[i]) - Vec3r(from);
    const Vec3r b = Vec3r(light.vertices[i + 1]) - Vec3r(from);
    const Vec3r c = Vec3r(light.vertices[i + 2]) - Vec3r(from);
    const Vec3r n = (b - a).cross(c - a);
    const Real twice_area = std::sqrt(n.dot(n));
    area += 0.5L * twice_area;
    const Real x = w.dot(b.cross(c));
    const Real y = w.dot(c.cross(a));
    const Real z = w.dot(a.cross(b));
    const bool inside =
        (x >= 0.0L && y >= 0.0L && z >= 0.0L) || (x <= 0.0L && y <= 0.0L && z <= 0.0L);
    const Real slope = n.dot(w);
    if (!inside || slope == 0.0L) continue;
    const Real t = n.dot(a) / slope;
    if (t > 0.0L) sum += t * t * twice_area / std::abs(slope);
  }
  return area > 0.0L ? sum / area : 0.0L;
}

/// Unpolarised Fresnel reflectance of a conductor by the formulas of Born and Wolf, section 14.4.
inline Real conductor_fresnel(Real cosine, Real eta, Real k) {
  const Real cos2 = cosine * cosine;
  const Real sin2 = 1.0L - cos2;
  const Real t0 = eta * eta - k * k - sin2;
  const Real a2b2 = std::sqrt(t0 * t0 + 4.0L * eta * eta * k * k);
  const Real a = std::sqrt(std::max(0.0L, 0.5L * (a2b2 + t0)));
  const Real rs = (a2b2 + cos2 - 2.0L * a * cosine) / (a2b2 + cos2 + 2.0L * a * cosine);
  const Real rp = rs * (cos2 * a2b2 + sin2 * sin2 - 2.0L * a * cosine * sin2) /
                  (cos2 * a2b2 + sin2 * sin2 + 2.0L * a * cosine * sin2);
  return 0.5L * (rs + rp);
}

}  // namespace penumbra::test::oracle
