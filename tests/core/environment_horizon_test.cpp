// Whether an environment can light a surface: never "no" where a texel that emits is above the
// horizon. Exact, on random grids with fixed seeds.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "scenes/core/environment.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

// Cosines to the horizon that count as on it, for rounding: in double throughout.
constexpr double kOnHorizon = 1e-9;

/// A grid of which a random band of rows has texels that emit.
struct Band {
  std::uint32_t columns, rows;
  double rotation_deg;
  bool whole_rows;
  std::vector<Rgb> texels;

  explicit Band(test::TestRandom& random)
      : columns(1 + random.bits() % 8),
        rows(1 + random.bits() % 12),
        rotation_deg(random.uniform(-400, 400)),
        whole_rows(random.uniform() < 0.5),
        texels(std::size_t{columns} * rows, Rgb(0.0f)) {
    const std::uint32_t first = random.bits() % rows;
    const std::uint32_t last = first + random.bits() % (rows - first);
    for (std::uint32_t row = first; row <= last; ++row) {
      for (std::uint32_t column = 0; column < columns; ++column) {
        const bool lit = whole_rows || random.uniform() < 0.3;
        if (lit) texels[std::size_t{row} * columns + column] = Rgb(0.0f, 1.0f, 0.0f);
      }
    }
  }

  Environment environment() const { return Environment(texels, columns, rows, rotation_deg); }

  /// Largest cosine to the normal over a fine grid of each texel that emits, borders included; -2
  /// where none does.
  double highest(const Vec3& normal) const {
    constexpr int kSteps = 24;
    double result = -2.0;
    for (std::size_t i = 0; i < texels.size(); ++i) {
      if (is_black(texels[i])) continue;
      for (int k = 0; k <= kSteps * kSteps; ++k) {
        const double row = static_cast<double>(i / columns) + (k % kSteps) / (kSteps - 1.0);
        const double column = static_cast<double>(i % columns) + (k / kSteps) / (kSteps - 1.0);
        const double theta = row * M_PI / rows;
        const double phi = column * 2.0 * M_PI / columns + rotation_deg * M_PI / 180.0;
        const Vec3d w(std::sin(theta) * std::cos(phi), std::cos(theta),
                      std::sin(theta) * std::sin(phi));
        result = std::max(result, w.dot(Vec3d(normal)));
      }
    }
    return result;
  }
};

TEST(EnvironmentHorizon, ATexelAboveItIsNeverMissed) {
  test::TestRandom random;
  int below = 0, above = 0;
  for (int i = 0; i < 4000; ++i) {
    const Band band(random);
    // Some normals along the axes, where the poles are.
    Vec3 normal = random.direction();
    if (i % 10 == 0) normal = Vec3(0, i % 20 == 0 ? 1.0f : -1.0f, 0);
    const bool can = band.environment().can_light(normal);
    const double highest = band.highest(normal);
    if (highest > kOnHorizon) {
      EXPECT_TRUE(can) << "case " << i << ", cosine " << highest;
    }
    (highest > 0.0 ? above : below) += 1;
  }
  EXPECT_GT(below, 400);
  EXPECT_GT(above, 400);
}

TEST(EnvironmentHorizon, WholeRowsBelowItAreRuledOut) {
  test::TestRandom random;
  int ruled_out = 0;
  for (int i = 0; i < 4000; ++i) {
    const Band band(random);
    const Vec3 normal = random.direction();
    // Of a row the texels' fine grid misses the best azimuth by less than this.
    const double missed = 1.0 - std::cos(M_PI / 23.0);
    if (!band.whole_rows || band.highest(normal) > -(missed + kOnHorizon)) continue;
    EXPECT_FALSE(band.environment().can_light(normal)) << "case " << i;
    ++ruled_out;
  }
  EXPECT_GT(ruled_out, 100);
}

TEST(EnvironmentHorizon, ASkyDoesNotLightWhatFacesDown) {
  const std::vector<Rgb> texels = {Rgb(1.0f), Rgb(2.0f), Rgb(0.0f), Rgb(0.0f)};
  const Environment sky(texels, 2, 2);
  EXPECT_TRUE(sky.can_light(Vec3(0, 1, 0)));
  EXPECT_TRUE(sky.can_light(Vec3(0.6f, 0.8f, 0)));
  EXPECT_TRUE(sky.can_light(Vec3(0, -0.8f, 0.6f))) << "down and to a side";
  EXPECT_FALSE(sky.can_light(Vec3(0, -1, 0)));
}

TEST(EnvironmentHorizon, ABlackOneLightsNothing) {
  const std::vector<Rgb> texels(8, Rgb(0.0f));
  EXPECT_FALSE(Environment(texels, 4, 2).can_light(Vec3(0, 1, 0)));
}

}  // namespace
}  // namespace penumbra
