// Sums, means and variances of many, large or nearly equal numbers. The naive sum in float (or the
// naive variance) has to fail each check.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "harness/metrics.h"
#include "harness/statistics.h"
#include "harness/tile.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

TEST(PixelMean, OfTwoToThe24PlusOneOnesIsOne) {
  constexpr int kEstimates = (1 << 24) + 1;
  const ShadingPoint point;
  Tile tile;
  tile.width = tile.height = tile.image_width = 1;
  tile.spp = kEstimates;
  tile.points = std::span(&point, 1);
  const std::vector<Rgb> ones(kEstimates, Rgb(1.0f));
  const Vec3d mean = pixel_mean(tile, ones);
  // Each addition rounds by half a unit of the last place of the sum: 2^24 x 2^-54 at most.
  EXPECT_NEAR(mean.x, 1.0, 1e-9);
  float naive = 0.0f;
  for (const Rgb& one : ones) naive += one.x;
  EXPECT_GT(std::abs(static_cast<double>(naive) / kEstimates - 1.0), 1e-9) << "negative control";
}

TEST(PixelMean, OfUniformNumbersKeepsNineDigits) {
  constexpr int kEstimates = 1 << 22;
  const ShadingPoint point;
  Tile tile;
  tile.width = tile.height = tile.image_width = 1;
  tile.spp = kEstimates;
  tile.points = std::span(&point, 1);
  test::TestRandom random;
  std::vector<Rgb> values(kEstimates);
  std::uint64_t exact = 0;  // in units of 2^-24, without any rounding
  float naive = 0.0f;
  for (Rgb& value : values) {
    value = Rgb(random.unit_float());
    exact += static_cast<std::uint64_t>(value.x * 0x1p24f);
    naive += value.x;
  }
  const double mean = static_cast<double>(exact) * 0x1p-24 / kEstimates;
  EXPECT_NEAR(pixel_mean(tile, values).x / mean, 1.0, 1e-9);
  EXPECT_GT(std::abs(static_cast<double>(naive) / kEstimates / mean - 1.0), 1e-9)
      << "negative control";
}

// Values m and m + 1 in turn: the variance is n/(4 (n - 1)).
template <typename T>
double naive_variance(T offset, int n) {
  T sum = 0;
  T squares = 0;
  for (int i = 0; i < n; ++i) {
    const T x = offset + static_cast<T>(i % 2);
    sum += x;
    squares += x * x;
  }
  const T mean = sum / static_cast<T>(n);
  return static_cast<double>((squares / static_cast<T>(n) - mean * mean) * static_cast<T>(n) /
                             static_cast<T>(n - 1));
}

TEST(Welford, VarianceOfAHundredMillionAndOneMoreIsAQuarter) {
  constexpr int kValues = 10'000;
  Welford values;
  for (int i = 0; i < kValues; ++i) values.add(1e8 + i % 2);
  const double exact = 0.25 * kValues / (kValues - 1);
  EXPECT_NEAR(values.variance().value() / exact, 1.0, 1e-6);
  EXPECT_GT(std::abs(naive_variance(1e8, kValues) / exact - 1.0), 1e-6) << "in double: control";
  EXPECT_GT(std::abs(naive_variance(1e4f, kValues) / exact - 1.0), 1e-6) << "in float: control";
}

TEST(Welford, MergedBlocksHaveTheVarianceOfTheWhole) {
  Welford whole;
  Welford merged;
  for (int block = 0; block < 100; ++block) {
    Welford part;
    for (int i = 0; i <= block; ++i) {
      const double x = 1e8 + (i + block) % 2;
      whole.add(x);
      part.add(x);
    }
    merged.merge(part);
  }
  EXPECT_NEAR(merged.variance().value() / whole.variance().value(), 1.0, 1e-6);
  EXPECT_NEAR(merged.mean() / whole.mean(), 1.0, 1e-14);
}

// A bright image with a small error: (x - A)(x - B) of floats is exact in double, its mean over a
// million pixels is not in float.
TEST(ImageMetrics, MeanSquareErrorOfAMillionPixelsKeepsItsDigits) {
  constexpr std::size_t kPixels = 1 << 20;
  const std::vector<Rgb> reference(kPixels, Rgb(4096.0f));
  std::vector<Rgb> image(kPixels);
  test::TestRandom random;
  long double exact = 0.0L;
  float naive = 0.0f;
  float naive_squares = 0.0f;  // E[x^2] - 2 r E[x] + r^2
  float naive_values = 0.0f;
  for (Rgb& x : image) {
    x = Rgb(4096.0f + random.unit_float());
    const long double error = static_cast<long double>(x.x) - 4096.0L;
    exact += error * error;
    naive += (x.x - 4096.0f) * (x.x - 4096.0f);
    naive_squares += x.x * x.x / static_cast<float>(kPixels);
    naive_values += x.x / static_cast<float>(kPixels);
  }
  exact /= static_cast<long double>(kPixels);
  const ImageMetrics metrics = image_metrics(image, {reference, reference}, 0.01);
  EXPECT_NEAR(metrics.mse / static_cast<double>(exact), 1.0, 1e-9);
  EXPECT_GT(std::abs(static_cast<double>(naive) / static_cast<double>(kPixels) /
                         static_cast<double>(exact) -
                     1.0),
            1e-9)
      << "negative control";
  const float expanded = naive_squares - 2.0f * 4096.0f * naive_values + 4096.0f * 4096.0f;
  EXPECT_GT(std::abs(static_cast<double>(expanded) / static_cast<double>(exact) - 1.0), 0.1)
      << "expanded square: control";
}

}  // namespace
}  // namespace penumbra
