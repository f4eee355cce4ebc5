#pragma once

#include <cmath>

#include "scenes/core/vec.h"

namespace penumbra {

/// Right-handed orthonormal frame whose z axis is a given unit normal.
/// Source: Duff et al. 2017, "Building an orthonormal basis, revisited" (stable at the south pole).
class Frame {
 public:
  /// @param z  unit length
  explicit Frame(const Vec3& z) noexcept : z_(z) {
    const float sign = std::copysign(1.0f, z.z);
    const float a = -1.0f / (sign + z.z);
    const float b = z.x * z.y * a;
    x_ = Vec3(1.0f + sign * z.x * z.x * a, sign * b, -sign * z.x);
    y_ = Vec3(b, sign + z.y * z.y * a, -z.y);
  }

  const Vec3& normal() const noexcept { return z_; }
  Vec3 to_local(const Vec3& world) const noexcept {
    return {dot(world, x_), dot(world, y_), dot(world, z_)};
  }
  Vec3 to_world(const Vec3& local) const noexcept {
    return x_ * local.x + y_ * local.y + z_ * local.z;
  }

 private:
  Vec3 x_, y_, z_;
};

}  // namespace penumbra
