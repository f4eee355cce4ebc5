#pragma once

#include <algorithm>
#include <cmath>

#include "scenes/core/vec.h"

/// Building blocks of implicit surfaces: signed distances, exact or close to it, negative inside.
namespace penumbra::generated {

/// Union that rounds the seam.
/// @param width  of the blend
inline double smooth_min(double a, double b, double width) {
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - 0.25 * width * h * h;
}

/// Intersection that rounds the edge.
inline double smooth_max(double a, double b, double width) { return -smooth_min(-a, -b, width); }

/// 0 below `from`, 1 above `to`, smooth between; `from` may be the larger one.
inline double ramp(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// Capsule whose radius changes linearly from one end to the other.
inline double capsule(const Vec3d& p, const Vec3d& a, const Vec3d& b, double radius_a,
                      double radius_b) {
  const Vec3d axis = b - a;
  const double t = std::clamp((p - a).dot(axis) / axis.length2(), 0.0, 1.0);
  return (p - a - axis * t).length() - (radius_a + (radius_b - radius_a) * t);
}

/// First-order distance to an ellipsoid with its axes along the coordinates.
inline double ellipsoid(const Vec3d& p, const Vec3d& center, const Vec3d& radii) {
  const Vec3d q = (p - center) / radii;
  const double k0 = q.length();
  const double k1 = (q / radii).length();
  return k1 > 0.0 ? k0 * (k0 - 1.0) / k1 : -std::min({radii.x, radii.y, radii.z});
}

/// Box with rounded edges.
/// @param half  half extents, rounding included
inline double rounded_box(const Vec3d& p, const Vec3d& center, const Vec3d& half, double rounding) {
  const Vec3d q =
      Vec3d(std::abs(p.x - center.x), std::abs(p.y - center.y), std::abs(p.z - center.z)) - half +
      Vec3d(rounding);
  const Vec3d outside(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
  return outside.length() + std::min(std::max({q.x, q.y, q.z}), 0.0) - rounding;
}

/// Upright disc with a rounded rim.
inline double disc(const Vec3d& p, double low, double high, double radius, double rounding) {
  const double across = std::hypot(p.x, p.z) - radius + rounding;
  const double along = std::abs(p.y - 0.5 * (low + high)) - 0.5 * (high - low) + rounding;
  return std::hypot(std::max(across, 0.0), std::max(along, 0.0)) +
         std::min(std::max(across, along), 0.0) - rounding;
}

}  // namespace penumbra::generated
