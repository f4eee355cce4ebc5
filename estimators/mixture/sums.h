#pragma once

#include "scenes/core/vec.h"

namespace penumbra {

/// Double-precision RGB, for sums and weights.
using RgbSum = Vec3d;

inline RgbSum widen(const Rgb& c) noexcept { return {c.x, c.y, c.z}; }
inline Rgb narrow(const RgbSum& c) noexcept {
  return {static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)};
}
inline double luminance(const RgbSum& c) noexcept {
  return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
}

}  // namespace penumbra
