#include "harness/tone_map.h"

#include <algorithm>
#include <cmath>

namespace penumbra {
namespace {

/// @param scale  factor of the exposure; the product may overflow to infinity, which is white
std::uint8_t channel_byte(float linear, float scale) noexcept {
  return static_cast<std::uint8_t>(std::lround(srgb_from_linear(linear * scale) * 255.0f));
}

}  // namespace

float srgb_from_linear(float linear) noexcept {
  const float x = std::clamp(linear, 0.0f, 1.0f);
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
}

Rgb8 tone_map(const Rgb& radiance, float exposure_stops) noexcept {
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(radiance[i]) || radiance[i] < 0.0f) return kNonFiniteColor;
  }
  const float scale = std::exp2(exposure_stops);
  return {channel_byte(radiance.x, scale), channel_byte(radiance.y, scale),
          channel_byte(radiance.z, scale)};
}

}  // namespace penumbra
