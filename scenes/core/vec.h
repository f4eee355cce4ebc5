#pragma once

#include <ImathColor.h>
#include <ImathVec.h>

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ != 0)
#error "fast-math deletes the checks for NaN and infinity; build without -ffast-math"
#endif

/// Vector and colour types of the whole project: Imath's, so that images, meshes and geometry share
/// one set.
namespace penumbra {

using Vec2 = Imath::V2f;
using Vec3 = Imath::V3f;
using Vec3d = Imath::V3d;

/// Linear RGB with Rec. 709 primaries; radiance in W/(m^2 sr), or a reflectance.
using Rgb = Imath::C3f;

/// Relative luminance of linear Rec. 709 RGB.
/// Source: ITU-R BT.709-6, section 3.
inline float luminance(const Rgb& c) noexcept {
  return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}

inline float dot(const Vec3& a, const Vec3& b) noexcept { return a.dot(b); }
inline Vec3 cross(const Vec3& a, const Vec3& b) noexcept { return a.cross(b); }

inline bool is_black(const Rgb& c) noexcept { return c.x == 0.0f && c.y == 0.0f && c.z == 0.0f; }

}  // namespace penumbra
