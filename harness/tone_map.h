#pragma once

#include <cstdint>

#include "scenes/core/vec.h"

namespace penumbra {

/// A colour of the screen: sRGB, 8 bits per channel.
struct Rgb8 {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
  friend bool operator==(const Rgb8&, const Rgb8&) = default;
};

/// Pure magenta stands for NaN, infinity and negative radiance in every picture, so that they are
/// seen.
inline constexpr Rgb8 kNonFiniteColor{255, 0, 255};

/// The sRGB transfer function.
/// @param linear  values outside of [0, 1] are clipped
/// @return in [0, 1]
/// Source: IEC 61966-2-1:1999.
float srgb_from_linear(float linear) noexcept;

/// The colour that shows a radiance on the screen: exposure, clipping at white, sRGB. A
/// channel that is not finite or negative gives `kNonFiniteColor`.
/// @param radiance        linear RGB; 1 is white at exposure 0
/// @param exposure_stops  brighter by a factor of 2 to this power
Rgb8 tone_map(const Rgb& radiance, float exposure_stops) noexcept;

}  // namespace penumbra
