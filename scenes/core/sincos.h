#pragma once

#include <cstdint>

namespace penumbra {

struct SinCos {
  float sine;
  float cosine;
};

/// Sine and cosine of 2 pi u. A polynomial on an eighth of a turn: absolute error below 1.2e-7, and
/// a third of the time of the C library's, which has to serve any angle.
/// @param u  angle in turns, |u| < 2^20
/// Source of the polynomials: Moshier, Cephes Mathematical Library, sinf and cosf.
inline SinCos sincos_turns(float u) noexcept {
  // Floor through the truncation, which vectors have on every processor.
  const float nearest = 4.0f * u + 0.5f;
  const auto truncated = static_cast<std::int32_t>(nearest);
  const std::int32_t q = truncated - (static_cast<float>(truncated) > nearest ? 1 : 0);
  const auto quarter = static_cast<float>(q);
  const float x = (u - 0.25f * quarter) * 6.28318530717958647693f;  // in [-pi/4, pi/4]
  const float x2 = x * x;
  const float s =
      x + x * x2 * (-1.6666654611e-1f + x2 * (8.3321608736e-3f - x2 * 1.9515295891e-4f));
  const float c =
      1.0f - 0.5f * x2 +
      x2 * x2 *
          (4.166664568298827e-2f + x2 * (-1.388731625493765e-3f + x2 * 2.443315711809948e-5f));
  // Quarter turns swap and negate: (s, c), (c, -s), (-s, -c), (-c, s).
  const bool odd = (q & 1) != 0;
  const float sine = odd ? c : s;
  const float cosine = odd ? s : c;
  return {(q & 2) != 0 ? -sine : sine, ((q + 1) & 2) != 0 ? -cosine : cosine};
}

}  // namespace penumbra
