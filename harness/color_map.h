#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/image.h"
#include "harness/tone_map.h"

/// False colours. Both maps can be read with every common colour-vision deficiency.
namespace penumbra {

enum class ColorMap {
  Viridis,       ///< dark blue (low) over green to yellow (high); lightness grows steadily
  BlueWhiteRed,  ///< blue below zero, white at zero, red above; equally dark on both sides
};

/// How the numbers of a map become colours, and what the colour bar says.
struct ColorScale {
  std::string label;  ///< quantity and unit, such as "error [W/(m² sr)]"; "_{...}" is lowered
  float min = 0.0f;   ///< value of the lowest colour
  float max = 1.0f;   ///< value of the highest colour; above `min`
  ColorMap map = ColorMap::Viridis;
};

/// The colour at place `t` of a map.
/// @param t  0 is the lowest, 1 the highest colour; outside it is clipped; NaN gives
/// `kNonFiniteColor`
Rgb8 map_color(ColorMap map, double t) noexcept;

/// The colour of a value; NaN and infinity give `kNonFiniteColor`.
Rgb8 scale_color(const ColorScale& scale, float value) noexcept;

/// The colours of all pixels: tone-mapped radiance, and the values of a map.
std::vector<Rgb8> colors_of(const Image& image, float exposure_stops);
std::vector<Rgb8> colors_of(const ScalarImage& image, const ColorScale& scale);

/// What is wrong with a scale, empty when it is fine: min and max must be finite, min < max, and
/// for BlueWhiteRed min = -max, because white has to be zero.
std::string scale_fault(const ColorScale& scale);

/// Signed error per pixel: luminance of `estimate` minus luminance of `reference`. Bias shows as
/// areas of one colour, noise as a mixture of both. Errors: RunError when the sizes differ.
ScalarImage signed_error(const Image& estimate, const Image& reference);

/// A BlueWhiteRed scale to be shared by several error maps: +-limit, where `share` of all finite
/// |values| of all maps are at most the limit. A few fireflies would otherwise make everything else
/// white; what exceeds the limit gets the end colour and an arrow at the colour bar.
/// @param share  in (0, 1]
ColorScale symmetric_scale(std::span<const ScalarImage> maps, std::string label,
                           double share = 0.99);

/// A Viridis scale from the smallest to the largest finite value of all maps; widened when they are
/// equal.
ColorScale fitted_scale(std::span<const ScalarImage> maps, std::string label);

}  // namespace penumbra
