#include "harness/color_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

/// Every fifth of the 256 published colours, rounded to 8 bits; between them linear interpolation
/// is within 1/255 of the published table. Source: viridis, by S. van der Walt, N. Smith and E.
/// Firing; matplotlib, lib/matplotlib/_cm_listed.py (CC0).
constexpr std::array<Rgb8, 52> kViridis{{
    {68, 1, 84},    {70, 8, 92},    {71, 16, 99},   {72, 23, 105},  {72, 29, 111},  {72, 36, 117},
    {71, 42, 122},  {70, 48, 126},  {69, 55, 129},  {67, 61, 132},  {65, 66, 135},  {63, 72, 137},
    {61, 78, 138},  {58, 83, 139},  {56, 89, 140},  {53, 94, 141},  {51, 99, 141},  {49, 104, 142},
    {46, 109, 142}, {44, 113, 142}, {42, 118, 142}, {41, 123, 142}, {39, 128, 142}, {37, 132, 142},
    {35, 137, 142}, {33, 142, 141}, {32, 146, 140}, {31, 151, 139}, {30, 156, 137}, {31, 161, 136},
    {33, 165, 133}, {36, 170, 131}, {40, 174, 128}, {46, 179, 124}, {53, 183, 121}, {61, 188, 116},
    {70, 192, 111}, {80, 196, 106}, {90, 200, 100}, {101, 203, 94}, {112, 207, 87}, {124, 210, 80},
    {137, 213, 72}, {149, 216, 64}, {162, 218, 55}, {176, 221, 47}, {189, 223, 38}, {202, 225, 31},
    {216, 226, 25}, {229, 228, 25}, {241, 229, 29}, {253, 231, 37},
}};

/// Own table. CIELAB lightness is about 18, 38, 60, 81, 100 from either end to the middle, equal on
/// both sides within 2.3; +x and -x stay apart by a colour difference of 30 and more at a quarter
/// of the range when protanopia, deuteranopia or tritanopia is simulated (Machado, Oliveira and
/// Fernandes 2009).
constexpr std::array<Rgb8, 9> kBlueWhiteRed{{{0, 42, 100},
                                             {0, 88, 166},
                                             {80, 150, 207},
                                             {170, 205, 232},
                                             {255, 255, 255},
                                             {245, 190, 170},
                                             {226, 116, 92},
                                             {178, 38, 43},
                                             {98, 0, 24}}};

std::uint8_t mix(std::uint8_t a, std::uint8_t b, double share_of_b) noexcept {
  const double value =
      static_cast<double>(a) * (1.0 - share_of_b) + static_cast<double>(b) * share_of_b;
  return static_cast<std::uint8_t>(std::lround(value));
}

Rgb8 interpolate(std::span<const Rgb8> table, double t) noexcept {
  const double place = t * static_cast<double>(table.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(place), table.size() - 2);
  const double f = place - static_cast<double>(i);
  const Rgb8& a = table[i];
  const Rgb8& b = table[i + 1];
  return {mix(a.r, b.r, f), mix(a.g, b.g, f), mix(a.b, b.b, f)};
}

}  // namespace

Rgb8 map_color(ColorMap map, double t) noexcept {
  if (std::isnan(t)) return kNonFiniteColor;
  const double inside = std::clamp(t, 0.0, 1.0);
  switch (map) {
    case ColorMap::Viridis:
      return interpolate(kViridis, inside);
    case ColorMap::BlueWhiteRed:
      return interpolate(kBlueWhiteRed, inside);
  }
  return kNonFiniteColor;
}

Rgb8 scale_color(const ColorScale& scale, float value) noexcept {
  if (!std::isfinite(value)) return kNonFiniteColor;
  // In double the difference of two floats cannot overflow.
  const double min = static_cast<double>(scale.min);
  const double max = static_cast<double>(scale.max);
  return map_color(scale.map, (static_cast<double>(value) - min) / (max - min));
}

std::vector<Rgb8> colors_of(const Image& image, float exposure_stops) {
  std::vector<Rgb8> colors;
  colors.reserve(image.pixels.size());
  for (const Rgb& pixel : image.pixels) colors.push_back(tone_map(pixel, exposure_stops));
  return colors;
}

std::vector<Rgb8> colors_of(const ScalarImage& image, const ColorScale& scale) {
  std::vector<Rgb8> colors;
  colors.reserve(image.pixels.size());
  for (const float pixel : image.pixels) colors.push_back(scale_color(scale, pixel));
  return colors;
}

std::string scale_fault(const ColorScale& scale) {
  if (!std::isfinite(scale.min) || !std::isfinite(scale.max) || !(scale.min < scale.max)) {
    return fmt::format("colour scale from {} to {}: both must be finite and min below max",
                       scale.min, scale.max);
  }
  if (scale.map == ColorMap::BlueWhiteRed && scale.min != -scale.max) {
    return fmt::format("colour scale from {} to {}: blue-white-red needs min = -max", scale.min,
                       scale.max);
  }
  return "";
}

ScalarImage signed_error(const Image& estimate, const Image& reference) {
  if (estimate.width != reference.width || estimate.height != reference.height) {
    throw RunError(fmt::format("error map of an image of {} x {} against a reference of {} x {}",
                               estimate.width, estimate.height, reference.width, reference.height));
  }
  PN_CHECK(is_well_formed(estimate) && is_well_formed(reference), "error map of a broken image");
  ScalarImage result = make_scalar_image(estimate.width, estimate.height);
  for (std::size_t i = 0; i < result.pixels.size(); ++i) {
    result.pixels[i] = luminance(estimate.pixels[i]) - luminance(reference.pixels[i]);
  }
  return result;
}

ColorScale symmetric_scale(std::span<const ScalarImage> maps, std::string label, double share) {
  PN_CHECK(share > 0.0 && share <= 1.0, "the share of covered values lies in (0, 1]");
  std::vector<float> sizes;
  for (const ScalarImage& map : maps) {
    for (const float value : map.pixels) {
      if (std::isfinite(value)) sizes.push_back(std::abs(value));
    }
  }
  float limit = 0.0f;
  if (!sizes.empty()) {
    const auto n_covered =
        static_cast<std::size_t>(std::ceil(share * static_cast<double>(sizes.size())));
    const auto place = sizes.begin() + static_cast<std::ptrdiff_t>(n_covered - 1);
    std::nth_element(sizes.begin(), place, sizes.end());
    limit = *place;
    // Fewer than 1 - share of the pixels differ at all: their largest error is the only scale left.
    if (limit == 0.0f) limit = *std::max_element(sizes.begin(), sizes.end());
  }
  if (limit == 0.0f) limit = 1.0f;
  return {std::move(label), -limit, limit, ColorMap::BlueWhiteRed};
}

ColorScale fitted_scale(std::span<const ScalarImage> maps, std::string label) {
  float min = std::numeric_limits<float>::infinity();
  float max = -min;
  for (const ScalarImage& map : maps) {
    for (const float value : map.pixels) {
      if (!std::isfinite(value)) continue;
      min = std::min(min, value);
      max = std::max(max, value);
    }
  }
  if (min > max) return {std::move(label), 0.0f, 1.0f, ColorMap::Viridis};
  if (min == max) {
    const float margin = std::max(std::abs(min) * 0.01f, 1e-6f);
    min -= margin;
    max += margin;
  }
  return {std::move(label), min, max, ColorMap::Viridis};
}

}  // namespace penumbra
