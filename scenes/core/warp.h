#pragma once

#include <algorithm>
#include <cmath>

#include "scenes/core/sincos.h"
#include "scenes/core/vec.h"

/// Maps from the unit square to directions and surfaces; each with its density and its inverse
/// beside it. Frames are local, z up; densities per steradian (`_w`) or per unit area. `u` is
/// uniform in [0, 1)^2.
namespace penumbra {

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;

/// Unit square to unit disc, area-preserving and continuous.
/// Source: Shirley and Chiu 1997, "A low distortion map between disk and square".
inline Vec2 sample_uniform_disk(const Vec2& u) noexcept {
  const float x = 2.0f * u.x - 1.0f;
  const float y = 2.0f * u.y - 1.0f;
  const bool x_major = std::abs(x) > std::abs(y);
  const float r = x_major ? x : y;
  const float ratio = (x_major ? y : x) / (r == 0.0f ? 1.0f : r);
  const float phi = 0.125f * ratio;  // turns from the nearer axis
  const SinCos turn = sincos_turns(phi);
  return {r * (x_major ? turn.cosine : turn.sine), r * (x_major ? turn.sine : turn.cosine)};
}
Vec2 invert_uniform_disk(const Vec2& point) noexcept;

/// Density cos(theta)/pi over the upper hemisphere.
inline Vec3 sample_cosine_hemisphere(const Vec2& u) noexcept {
  const Vec2 d = sample_uniform_disk(u);
  return {d.x, d.y, std::sqrt(std::max(0.0f, 1.0f - d.x * d.x - d.y * d.y))};
}
float cosine_hemisphere_pdf_w(float cos_theta) noexcept;
Vec2 invert_cosine_hemisphere(const Vec3& w) noexcept;

/// Density 1/(2 pi) over the upper hemisphere.
Vec3 sample_uniform_hemisphere(const Vec2& u) noexcept;
float uniform_hemisphere_pdf_w(float cos_theta) noexcept;
Vec2 invert_uniform_hemisphere(const Vec3& w) noexcept;

/// Density 1/(4 pi) over the sphere.
Vec3 sample_uniform_sphere(const Vec2& u) noexcept;
float uniform_sphere_pdf_w() noexcept;
Vec2 invert_uniform_sphere(const Vec3& w) noexcept;

/// Uniform directions in a cone about +z, in terms of 1 - cos(half angle), which stays exact for
/// cones of 1e-7 rad where the cosine itself rounds to 1.
/// @param one_minus_cos  in (0, 2]
Vec3 sample_uniform_cone(const Vec2& u, float one_minus_cos) noexcept;
float uniform_cone_pdf_w(float one_minus_cos) noexcept;
Vec2 invert_uniform_cone(const Vec3& w, float one_minus_cos) noexcept;

/// 1 - cos(angle) without cancellation.
float one_minus_cos_of(float angle) noexcept;

/// Barycentric coordinates (b1, b2) of a uniform point of a triangle; density 1/area.
/// Source: Heitz 2019, "A low-distortion map between triangle and square".
Vec2 sample_uniform_triangle(const Vec2& u) noexcept;
Vec2 invert_uniform_triangle(const Vec2& barycentric) noexcept;

}  // namespace penumbra
