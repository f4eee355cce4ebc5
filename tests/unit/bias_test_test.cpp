// The test of equal means against values worked out by hand, and its level and power on skewed
// noise.
//
// False alarms: the two tests of the level count alarms among 600 comparisons whose true rate is at
// most 1 %; 18 or more of them have probability 5e-5 (binomial). Seeds are fixed.

#include "harness/bias_test.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr int kOneSide[] = {8};
constexpr int kBothSides[] = {16, 8};

// One tile that is the whole image of one pixel.
TileReplicates numbers(const std::vector<double>& values) {
  TileReplicates result(bias_tiles(1, 1, {}));
  for (const double value : values) result.add(std::vector<Vec3d>{Vec3d(value)});
  return result;
}

TileReplicates exact_number(double value) {
  return TileReplicates::exact(bias_tiles(1, 1, {}), std::vector<Vec3d>{Vec3d(value)});
}

TEST(BiasTiles, AreTheWholeImageAndEachScaleRowByRow) {
  const std::vector<BiasTile> tiles = bias_tiles(20, 16, kBothSides);
  ASSERT_EQ(tiles.size(), 1u + 2u + 6u);
  EXPECT_EQ(tiles[0].rect, (PixelRect{0, 0, 20, 16}));
  EXPECT_EQ(tiles[2].rect, (PixelRect{16, 0, 4, 16}));
  EXPECT_EQ(tiles[8].rect, (PixelRect{16, 8, 4, 8}));
  EXPECT_EQ(tiles[8].side, 8);
}

TEST(BiasTiles, TileThatIsTheWholeImageIsTestedOnce) {
  EXPECT_EQ(bias_tiles(8, 8, kBothSides).size(), 1u);
  EXPECT_EQ(bias_tiles(16, 8, kBothSides).size(), 3u);
}

TEST(TileReplicatesOf, ReplicateIsMeansOverPixelsAndChannels) {
  TileReplicates replicates(bias_tiles(16, 8, kOneSide));
  std::vector<Vec3d> pixels(128, Vec3d(1, 2, 3));
  for (int y = 0; y < 8; ++y) pixels[pixel_index(16, 8 + y, y)] = Vec3d(0, 0, 66);
  replicates.add(pixels);
  EXPECT_DOUBLE_EQ(replicates.replicate(0)[1], 2.0);
  EXPECT_DOUBLE_EQ(replicates.replicate(0)[2], 2.0 + 8 * (22.0 - 2.0) / 64);
  EXPECT_DOUBLE_EQ(replicates.replicate(0)[0], 2.0 + 8 * (22.0 - 2.0) / 128);
}

TEST(Welch, UnequalVariancesAndCounts) {
  // Means 3 and 6, variances 5/2 and 4, so variances of the means 1/2 and 4/3.
  const WelchTest test = bias_test(numbers({1, 2, 3, 4, 5}), numbers({4, 6, 8})).worst_tile().test;
  EXPECT_DOUBLE_EQ(test.difference, -3.0);
  EXPECT_DOUBLE_EQ(test.standard_error, std::sqrt(11.0 / 6.0));
  EXPECT_DOUBLE_EQ(test.t, -3.0 / std::sqrt(11.0 / 6.0));
  // (11/6)^2 / ((1/2)^2/4 + (4/3)^2/2)
  EXPECT_DOUBLE_EQ(test.degrees_of_freedom, 484.0 / 137.0);
}

TEST(Welch, PValueOfTwoDegreesOfFreedomHasAClosedForm) {
  // t = -3/sqrt(2); two-sided p of t_2 is 1 - |t|/sqrt(2 + t^2).
  const WelchTest test = bias_test(numbers({0, 2}), numbers({3, 5})).worst_tile().test;
  EXPECT_DOUBLE_EQ(test.degrees_of_freedom, 2.0);
  EXPECT_NEAR(test.p, 1 - 3 / std::sqrt(13.0), 1e-14);
}

TEST(Welch, ExactSideHasNoVarianceOfItsOwn) {
  // t = 1 with one degree of freedom (Cauchy): p = 1/2.
  const WelchTest test = bias_test(numbers({1, 3}), exact_number(1)).worst_tile().test;
  EXPECT_DOUBLE_EQ(test.degrees_of_freedom, 1.0);
  EXPECT_NEAR(test.p, 0.5, 1e-14);
}

TEST(Welch, MeansKnownWithTheirUncertaintyCountAsASide) {
  // As against {4, 6, 8}: mean 6, variance of the mean 4/3 with 2 degrees of freedom.
  const std::vector<MeanEstimate> b{{6.0, 4.0 / 3.0, 2.0}};
  const BiasTestResult given = bias_test(numbers({1, 2, 3, 4, 5}), b);
  const BiasTestResult sampled = bias_test(numbers({1, 2, 3, 4, 5}), numbers({4, 6, 8}));
  EXPECT_DOUBLE_EQ(given.smallest_p, sampled.smallest_p);
  EXPECT_DOUBLE_EQ(given.worst_tile().test.degrees_of_freedom, 484.0 / 137.0);
  EXPECT_DOUBLE_EQ(given.relative_bias->interval.hi, sampled.relative_bias->interval.hi);
}

TEST(Welch, WithoutVarianceTheAnswerIsCertain) {
  const BiasTestResult equal = bias_test(numbers({2, 2}), numbers({2, 2, 2}));
  EXPECT_EQ(equal.worst_tile().test.p, 1.0);
  EXPECT_FALSE(equal.rejected);
  const BiasTestResult different = bias_test(numbers({2, 2}), exact_number(2.5));
  EXPECT_EQ(different.worst_tile().test.p, 0.0);
  EXPECT_TRUE(std::isinf(different.worst_tile().test.t));
  EXPECT_TRUE(different.rejected);
}

TEST(Welch, ToleranceIsAShareOfTheWholeImagesMean) {
  BiasTestOptions options;
  options.tolerance = 0.25;
  EXPECT_FALSE(bias_test(numbers({2.5, 2.5}), exact_number(2), options).rejected);
  EXPECT_TRUE(bias_test(numbers({2.75, 2.75}), exact_number(2), options).rejected);
  // Of the difference 1.5, one half is beyond it; the standard error is one half, so t = 1.
  options.tolerance = 0.5;
  const BiasTestResult noisy = bias_test(numbers({3, 4}), exact_number(2), options);
  EXPECT_DOUBLE_EQ(noisy.worst_tile().test.t, 1.0);
}

// Per tile x: replicates x -+ 1 against -+ 1, so p = 1 - x/sqrt(4 + x^2) as above.
double shift_for(double p) {
  const double q = 1 - p;
  return 2 * q / std::sqrt(1 - q * q);
}

TEST(Holm, IsOverAllTilesOfAllScales) {
  const double p[] = {0.03, 0.04, 0.01};
  TileReplicates a(bias_tiles(16, 8, kOneSide));
  TileReplicates b(bias_tiles(16, 8, kOneSide));
  for (const double sign : {-1.0, 1.0}) {
    a.add_values(std::vector<double>{shift_for(p[0]) + sign, shift_for(p[1]) + sign,
                                     shift_for(p[2]) + sign});
    b.add_values(std::vector<double>{sign, sign, sign});
  }
  BiasTestOptions options;
  options.level = 0.05;
  const BiasTestResult result = bias_test(a, b, options);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(result.tiles[i].test.p, p[i], 1e-12);
  // 3 x 0.01, 2 x 0.03, and 1 x 0.04 raised to the one before.
  EXPECT_NEAR(result.tiles[2].adjusted_p, 0.03, 1e-12);
  EXPECT_NEAR(result.tiles[0].adjusted_p, 0.06, 1e-12);
  EXPECT_NEAR(result.tiles[1].adjusted_p, 0.06, 1e-12);
  EXPECT_EQ(result.worst, 2u);
  EXPECT_EQ(result.worst_tile().tile.rect, (PixelRect{8, 0, 8, 8}));
  EXPECT_TRUE(result.rejected);
  options.level = 0.02;
  EXPECT_FALSE(bias_test(a, b, options).rejected);
  // 20 bins of 0.05: all three in the first.
  EXPECT_EQ(result.p_histogram[0], 3u);
}

TEST(Tost, IntervalInsideTheMarginShowsASmallBias) {
  // Relative bias 0.001, standard error 1e-4 with 1 degree of freedom: t_0.95 = tan(0.45 pi).
  const double half_width = std::tan(0.45 * std::numbers::pi) * 1e-4;
  const RelativeBias bias =
      bias_test(numbers({1.0009, 1.0011}), exact_number(1)).relative_bias.value();
  EXPECT_NEAR(bias.value, 0.001, 1e-12);
  EXPECT_NEAR(bias.interval.lo, 0.001 - half_width, 1e-12);
  EXPECT_NEAR(bias.interval.hi, 0.001 + half_width, 1e-12);
  EXPECT_TRUE(bias.shown_small);
  BiasTestOptions options;
  options.equivalence_margin = 0.0016;
  EXPECT_FALSE(bias_test(numbers({1.0009, 1.0011}), exact_number(1), options)
                   .relative_bias.value()
                   .shown_small);
}

TEST(Tost, NoiseOfBothSidesCounts) {
  // Ratio 2; relative variances 0.01 from a and 2^2 x 0.0025 from b; 2 degrees of freedom, where
  // the quantile of u is (2u - 1)/sqrt(2u(1 - u)).
  const RelativeBias bias =
      bias_test(numbers({1.9, 2.1}), numbers({0.95, 1.05})).relative_bias.value();
  EXPECT_NEAR(bias.value, 1.0, 1e-12);
  EXPECT_NEAR(bias.standard_error, std::sqrt(0.02), 1e-12);
  EXPECT_NEAR(bias.interval.hi, 1 + 0.9 / std::sqrt(2 * 0.95 * 0.05) * std::sqrt(0.02), 1e-9);
  EXPECT_FALSE(bias.shown_small);
}

TEST(Tost, BlackImageHasNoRelativeBias) {
  EXPECT_FALSE(bias_test(numbers({0, 0}), numbers({0, 0})).relative_bias.has_value());
}

TEST(BiasTestErrors, NameWhatWasFoundAndWhatIsAllowed) {
  EXPECT_THROW(bias_test(numbers({1}), numbers({1, 2})), InputError);
  EXPECT_THROW(bias_test(numbers({1, 2}), numbers({})), InputError);
  EXPECT_THROW(bias_test(exact_number(1), exact_number(1)), InputError);
  EXPECT_THROW(numbers({std::nan("")}), InputError);
  EXPECT_THROW(exact_number(1).add_values(std::vector<double>{1}), InputError);
  EXPECT_THROW(bias_tiles(0, 8, {}), InputError);
  EXPECT_THROW(bias_tiles(8, 8, std::vector<int>{0}), InputError);
  EXPECT_THROW(numbers({1}).add(std::vector<Vec3d>(2)), InputError);
  TileReplicates other(bias_tiles(16, 8, kOneSide));
  other.add(std::vector<Vec3d>(128));
  other.add(std::vector<Vec3d>(128));
  EXPECT_THROW(bias_test(other, numbers({1, 2})), InputError);
  EXPECT_THROW(bias_test(numbers({1, 2}), std::vector<MeanEstimate>(2)), InputError);
  EXPECT_THROW(bias_test(numbers({1}), std::vector<MeanEstimate>(1)), InputError);
  BiasTestOptions options;
  options.level = 1;
  EXPECT_THROW(bias_test(numbers({1, 2}), numbers({1, 2}), options), InputError);
}

// Images of 32x32 pixels of independent log-normal noise of mean `mean`.
class SkewedImages {
 public:
  SkewedImages(std::uint64_t seed, double sigma) : engine_(seed), sigma_(sigma) {}

  TileReplicates replicates(int count, double mean) {
    TileReplicates result(bias_tiles(32, 32, kBothSides));
    std::vector<Vec3d> pixels(32 * 32);
    for (int r = 0; r < count; ++r) {
      for (Vec3d& pixel : pixels) pixel = Vec3d(mean * noise());
      result.add(pixels);
    }
    return result;
  }

 private:
  // exp(sigma g - sigma^2/2) has mean 1; g by Box and Muller.
  double noise() {
    const double g =
        std::sqrt(-2 * std::log(1 - uniform())) * std::cos(2 * std::numbers::pi * uniform());
    return std::exp(sigma_ * g - 0.5 * sigma_ * sigma_);
  }
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

  std::mt19937_64 engine_;
  double sigma_;
};

constexpr int kTrials = 600;
constexpr int kMostAlarms = 17;

TEST(BiasTestLevel, HoldsUnderSkewedNoiseOfBothSides) {
  SkewedImages images(1001, 1.0);  // skewness 6.2 of a pixel
  int alarms = 0;
  for (int i = 0; i < kTrials; ++i) {
    const TileReplicates a = images.replicates(16, 1.0);
    alarms += bias_test(a, images.replicates(16, 1.0)).rejected ? 1 : 0;
  }
  std::printf("alarms: %d of %d\n", alarms, kTrials);
  EXPECT_LE(alarms, kMostAlarms);
}

TEST(BiasTestLevel, HoldsAgainstAnExactImage) {
  SkewedImages images(1002, 0.5);  // skewness 1.8 of a pixel
  const TileReplicates truth =
      TileReplicates::exact(bias_tiles(32, 32, kBothSides), std::vector<Vec3d>(1024, Vec3d(1)));
  int alarms = 0;
  for (int i = 0; i < kTrials; ++i) {
    alarms += bias_test(images.replicates(16, 1.0), truth).rejected ? 1 : 0;
  }
  std::printf("alarms: %d of %d\n", alarms, kTrials);
  EXPECT_LE(alarms, kMostAlarms);
}

// The relative standard error of the difference of the whole image is sqrt(2 (e - 1)/16384) = 1.4
// %, so 15 % is more than ten of them.
TEST(BiasTestPower, ErrorOfTenStandardErrorsIsAlwaysFound) {
  SkewedImages images(1003, 1.0);
  for (int i = 0; i < 20; ++i) {
    const TileReplicates a = images.replicates(16, 1.15);
    EXPECT_TRUE(bias_test(a, images.replicates(16, 1.0)).rejected);
  }
}

TEST(BiasTestReport, NamesVerdictTileAndBias) {
  const std::string text = describe(bias_test(numbers({1.0009, 1.0011}), exact_number(1)));
  EXPECT_NE(text.find("whole image"), std::string::npos) << text;
  EXPECT_NE(text.find("+0.100 %"), std::string::npos) << text;
  EXPECT_NE(text.find("shown to be small"), std::string::npos) << text;
}

}  // namespace
}  // namespace penumbra
