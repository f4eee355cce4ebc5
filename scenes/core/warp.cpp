#include "scenes/core/warp.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/sincos.h"

namespace penumbra {
namespace {

constexpr float kOneMinusEpsilon = 1.0f - 0x1p-24f;

// An inverse lands where samples come from, also where rounding left the domain.
float below_one(float u) noexcept { return std::clamp(u, 0.0f, kOneMinusEpsilon); }

// Azimuth in turns, in [0, 1).
float turns(float x, float y) noexcept {
  const float phi = std::atan2(y, x) / (2.0f * kPi);
  return std::min(phi < 0.0f ? phi + 1.0f : phi, kOneMinusEpsilon);
}

Vec3 on_sphere(float z, float sin_theta, float u) noexcept {
  const SinCos phi = sincos_turns(u);
  return {sin_theta * phi.cosine, sin_theta * phi.sine, z};
}

}  // namespace

Vec2 invert_uniform_disk(const Vec2& point) noexcept {
  const float r = point.length();
  float phi = std::atan2(point.y, point.x);
  if (phi < -kPi / 4.0f) phi += 2.0f * kPi;
  float a = 0.0f;
  float b = 0.0f;
  if (phi < kPi / 4.0f) {
    a = r;
    b = phi * a / (kPi / 4.0f);
  } else if (phi < 3.0f * kPi / 4.0f) {
    b = r;
    a = -(phi - kPi / 2.0f) * b / (kPi / 4.0f);
  } else if (phi < 5.0f * kPi / 4.0f) {
    a = -r;
    b = (phi - kPi) * a / (kPi / 4.0f);
  } else {
    b = -r;
    a = -(phi - 3.0f * kPi / 2.0f) * b / (kPi / 4.0f);
  }
  return {below_one(0.5f * (a + 1.0f)), below_one(0.5f * (b + 1.0f))};
}

float cosine_hemisphere_pdf_w(float cos_theta) noexcept {
  return cos_theta > 0.0f ? cos_theta * kInvPi : 0.0f;
}

Vec2 invert_cosine_hemisphere(const Vec3& w) noexcept { return invert_uniform_disk({w.x, w.y}); }

Vec3 sample_uniform_hemisphere(const Vec2& u) noexcept { return sample_uniform_cone(u, 1.0f); }

float uniform_hemisphere_pdf_w(float cos_theta) noexcept {
  return cos_theta >= 0.0f ? 0.5f * kInvPi : 0.0f;
}

Vec2 invert_uniform_hemisphere(const Vec3& w) noexcept { return invert_uniform_cone(w, 1.0f); }

Vec3 sample_uniform_sphere(const Vec2& u) noexcept { return sample_uniform_cone(u, 2.0f); }

float uniform_sphere_pdf_w() noexcept { return 0.25f * kInvPi; }

Vec2 invert_uniform_sphere(const Vec3& w) noexcept { return invert_uniform_cone(w, 2.0f); }

float one_minus_cos_of(float angle) noexcept {
  const float s = std::sin(0.5f * angle);
  return 2.0f * s * s;
}

Vec3 sample_uniform_cone(const Vec2& u, float one_minus_cos) noexcept {
  const float depth = u.x * one_minus_cos;  // 1 - cos(theta)
  return on_sphere(1.0f - depth, std::sqrt(depth * (2.0f - depth)), u.y);
}

float uniform_cone_pdf_w(float one_minus_cos) noexcept {
  return 1.0f / (2.0f * kPi * one_minus_cos);
}

Vec2 invert_uniform_cone(const Vec3& w, float one_minus_cos) noexcept {
  // 1 - cos(theta) = sin^2/(1 + cos) keeps its digits near the axis; towards -z the plain form
  // does.
  const float sin2 = w.x * w.x + w.y * w.y;
  const float depth = w.z > 0.0f ? sin2 / (1.0f + w.z) : 1.0f - w.z;
  return {std::min(depth / one_minus_cos, kOneMinusEpsilon), turns(w.x, w.y)};
}

Vec2 sample_uniform_triangle(const Vec2& u) noexcept {
  float b1 = 0.0f;
  float b2 = 0.0f;
  if (u.y > u.x) {
    b1 = 0.5f * u.x;
    b2 = u.y - b1;
  } else {
    b2 = 0.5f * u.y;
    b1 = u.x - b2;
  }
  return {b1, b2};
}

Vec2 invert_uniform_triangle(const Vec2& barycentric) noexcept {
  const float b1 = barycentric.x;
  const float b2 = barycentric.y;
  return b2 > b1 ? Vec2(2.0f * b1, below_one(b2 + b1)) : Vec2(below_one(b1 + b2), 2.0f * b2);
}

}  // namespace penumbra
