#include "harness/color_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "harness/tone_map.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Luminance of a colour of the screen, by the inverse of the sRGB function.
double screen_luminance(Rgb8 c) {
  const auto linear = [](std::uint8_t byte) {
    const double v = byte / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(c.r) + 0.7152 * linear(c.g) + 0.0722 * linear(c.b);
}

TEST(ToneMap, HalfIs188) {
  // IEC 61966-2-1: 1.055 * 0.5^(1/2.4) - 0.055 = 0.735357; times 255 = 187.5.
  EXPECT_EQ(tone_map(Rgb(0.5f, 0.5f, 0.5f), 0.0f), (Rgb8{188, 188, 188}));
}

TEST(ToneMap, IsLinearNearBlackAndClipsOutsideTheUnitRange) {
  // 0.002 lies on the straight part: 12.92 * 0.002 * 255 = 6.59.
  EXPECT_EQ(tone_map(Rgb(0.002f, 0.0f, 1.0f), 0.0f), (Rgb8{7, 0, 255}));
  EXPECT_EQ(tone_map(Rgb(0.0f, 7.0f, 3e38f), 4.0f), (Rgb8{0, 255, 255}));
}

TEST(ToneMap, OneStopDoublesTheRadiance) {
  for (const float v : {0.001f, 0.02f, 0.1f, 0.25f, 0.4f}) {
    EXPECT_EQ(tone_map(Rgb(v), 1.0f), tone_map(Rgb(2.0f * v), 0.0f)) << v;
    EXPECT_EQ(tone_map(Rgb(v), -2.0f), tone_map(Rgb(0.25f * v), 0.0f)) << v;
  }
}

TEST(ToneMap, EveryNonFiniteOrNegativeChannelIsMagenta) {
  EXPECT_EQ(tone_map(Rgb(1.0f, -1e-30f, 1.0f), 0.0f), kNonFiniteColor);
  EXPECT_EQ(tone_map(Rgb(-0.0f), 0.0f), (Rgb8{0, 0, 0}));
  EXPECT_EQ(tone_map(Rgb(kNaN, 0.0f, 0.0f), 0.0f), kNonFiniteColor);
  EXPECT_EQ(tone_map(Rgb(0.0f, kInfinity, 0.0f), 0.0f), kNonFiniteColor);
  EXPECT_EQ(tone_map(Rgb(0.0f, 0.0f, -kInfinity), -9.0f), kNonFiniteColor);
}

TEST(ColorMap, ViridisHasItsPublishedColours) {
  // Entries 0, 128 and 255 of matplotlib's table: (0.267004, 0.004874, 0.329415), (0.127568,
  // 0.566949, 0.550556), (0.993248, 0.906157, 0.143936). Entry 128 lies between two stored ones.
  EXPECT_EQ(map_color(ColorMap::Viridis, 0.0), (Rgb8{68, 1, 84}));
  EXPECT_EQ(map_color(ColorMap::Viridis, 1.0), (Rgb8{253, 231, 37}));
  const Rgb8 middle = map_color(ColorMap::Viridis, 128.0 / 255.0);
  EXPECT_NEAR(middle.r, 32.5, 1.5);
  EXPECT_NEAR(middle.g, 144.6, 1.5);
  EXPECT_NEAR(middle.b, 140.4, 1.5);
}

TEST(ColorMap, ViridisGetsBrighterAllTheWay) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_LT(screen_luminance(map_color(ColorMap::Viridis, i / 100.0)),
              screen_luminance(map_color(ColorMap::Viridis, (i + 1) / 100.0)))
        << i;
  }
}

TEST(ColorMap, BlueWhiteRedIsWhiteAtZeroBlueBelowRedAbove) {
  const ColorScale scale{"", -2.0f, 2.0f, ColorMap::BlueWhiteRed};
  EXPECT_EQ(scale_color(scale, 0.0f), (Rgb8{255, 255, 255}));
  for (const float v : {0.1f, 0.5f, 1.0f, 2.0f, 9.0f}) {
    EXPECT_GT(scale_color(scale, v).r, scale_color(scale, v).b) << v;
    EXPECT_GT(scale_color(scale, -v).b, scale_color(scale, -v).r) << v;
  }
  EXPECT_EQ(scale_color(scale, kNaN), kNonFiniteColor);
  EXPECT_EQ(scale_color(scale, -kInfinity), kNonFiniteColor);
}

TEST(SymmetricScale, CoversTheWantedShareOfAllMaps) {
  // |values| 1 ... 100 over two maps, one NaN: 99 of 100 are at most 99.
  std::vector<ScalarImage> maps{make_scalar_image(50, 1), make_scalar_image(51, 1, kNaN)};
  for (int i = 0; i < 50; ++i) {
    maps[0].at(i, 0) = static_cast<float>(i + 1);
    maps[1].at(i, 0) = -static_cast<float>(i + 51);
  }
  const ColorScale scale = symmetric_scale(maps, "e");
  EXPECT_EQ(scale.max, 99.0f);
  EXPECT_EQ(scale.min, -99.0f);
  EXPECT_EQ(scale_fault(scale), "");
  EXPECT_EQ(symmetric_scale(maps, "e", 1.0).max, 100.0f);
  EXPECT_EQ(scale_fault(symmetric_scale({}, "e")), "") << "no values at all";
}

TEST(SignedError, IsTheDifferenceOfLuminances) {
  const ScalarImage error = signed_error(make_image(2, 1, Rgb(1.0f, 0.5f, 0.25f)),
                                         make_image(2, 1, Rgb(0.5f, 0.5f, 0.5f)));
  EXPECT_NEAR(error.at(1, 0), 0.2126f * 0.5f - 0.0722f * 0.25f, 1e-6f);
  EXPECT_THROW(signed_error(make_image(2, 1), make_image(1, 2)), RunError);
}

}  // namespace
}  // namespace penumbra
