#include "harness/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "harness/statistics.h"
#include "tests/unit/noise.h"

namespace penumbra {
namespace {

constexpr double kEpsilon = 0.01;

/// Two-sided normal limit at a false-alarm level of 1e-4.
constexpr double kLimit = 3.89;

// Errors x-rbar: .5 .5 1.5 | -1 1 1; halves' differences: 1 -1 -1 | -2 0 -2.
const std::vector<Rgb> kImage{{1, 2, 3}, {4, 5, 6}};
const std::vector<Rgb> kHalfA{{1, 1, 1}, {4, 4, 4}};
const std::vector<Rgb> kHalfB{{0, 2, 2}, {6, 4, 6}};

TEST(ImageMetrics, MseIsTheMeanProductOfErrorsAgainstTheHalves) {
  const ImageMetrics m = image_metrics(kImage, {kHalfA, kHalfB}, kEpsilon);
  // Products: 0 0 2 | 0 1 0.
  EXPECT_DOUBLE_EQ(m.mse, 3.0 / 6.0);
  EXPECT_DOUBLE_EQ(m.rmse.value(), std::sqrt(0.5));
  // .25 + .25 + 2.25 + 1 + 1 + 1
  EXPECT_DOUBLE_EQ(m.mse_naive, 5.75 / 6.0);
  EXPECT_DOUBLE_EQ(m.mean_error, 3.5 / 6.0);
  EXPECT_EQ(m.nonfinite, 0u);
}

TEST(ImageMetrics, NaiveMinusDebiasedIsTheVarianceOfTheReference) {
  const ImageMetrics m = image_metrics(kImage, {kHalfA, kHalfB}, kEpsilon);
  // mean((A-B)^2)/4 = 11/6/4
  EXPECT_DOUBLE_EQ(m.reference.variance, 11.0 / 24.0);
  EXPECT_DOUBLE_EQ(m.mse_naive - m.mse, 11.0 / 24.0);
  EXPECT_DOUBLE_EQ(m.reference_share.value(), (11.0 / 24.0) / 0.5);
}

TEST(ReferenceNoise, MatchesHandComputation) {
  const ReferenceNoise n = reference_noise({kHalfA, kHalfB});
  EXPECT_DOUBLE_EQ(n.mean, 17.5 / 6.0);  // rbar: .5 1.5 1.5 | 5 4 5
  // Differences of the channel means: -1/3, -4/3; half of each squared: 1/36 + 16/36.
  EXPECT_DOUBLE_EQ(n.mean_se, std::sqrt(17.0 / 36.0) / 2.0);
  // Mean squared differences: 1, 8/3; their squares: 1 + 64/9.
  EXPECT_DOUBLE_EQ(n.floor, std::sqrt(73.0 / 9.0 / 12.0) / 2.0);
}

TEST(ImageMetrics, RelativeErrorsKeepPixelsWhoseReferenceIsZero) {
  const std::vector<Rgb> image{{0.5f, 0.5f, 0.5f}, {3, 3, 3}};
  const std::vector<Rgb> half{{0, 0, 0}, {2, 2, 2}};
  const ImageMetrics m = image_metrics(image, {half, half}, 0.25);
  // mean(rbar) = 1; offsets 0.25 x 1 and 0.01 x 1.
  EXPECT_DOUBLE_EQ(m.relmse.value(), (0.25 / 0.25 + 1.0 / 4.25) / 2.0);
  EXPECT_DOUBLE_EQ(m.mape.value(), (0.5 / 0.01 + 1.0 / 2.01) / 2.0);
}

TEST(ImageMetrics, ErrorBelowReferenceNoiseHasNoRootAndNoShare) {
  const std::vector<Rgb> image{{1, 1, 1}};
  const std::vector<Rgb> half_a{{0, 0, 0}};
  const std::vector<Rgb> half_b{{2, 2, 2}};
  const ImageMetrics m = image_metrics(image, {half_a, half_b}, kEpsilon);
  EXPECT_DOUBLE_EQ(m.mse, -1.0);
  EXPECT_FALSE(m.rmse.has_value());
  EXPECT_FALSE(m.reference_share.has_value());
  EXPECT_FALSE(m.p_eff.has_value()) << "x equals rbar";
}

TEST(ImageMetrics, NonFinitePixelMakesEveryErrorNonFinite) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    std::vector<Rgb> image = kImage;
    image[1].y = bad;
    const ImageMetrics m = image_metrics(image, {kHalfA, kHalfB}, kEpsilon);
    EXPECT_EQ(m.nonfinite, 1u);
    for (const MetricInfo& metric : metric_table()) {
      const std::optional<double> value = metric.value(m);
      ASSERT_TRUE(value.has_value()) << metric.name << " with " << bad;
      EXPECT_FALSE(std::isfinite(*value)) << metric.name << " with " << bad;
    }
  }
}

TEST(ImageMetrics, NonFiniteReferenceIsCountedApart) {
  std::vector<Rgb> half = kHalfA;
  half[0].x = std::numeric_limits<float>::quiet_NaN();
  const ImageMetrics m = image_metrics(kImage, {half, kHalfB}, kEpsilon);
  EXPECT_EQ(m.nonfinite, 0u);
  EXPECT_EQ(m.reference.nonfinite, 1u);
  EXPECT_TRUE(std::isnan(m.mse));
}

TEST(ImageMetrics, BlackReferenceHasNoRelativeError) {
  const std::vector<Rgb> black{{0, 0, 0}, {0, 0, 0}};
  const ImageMetrics m = image_metrics(kImage, {black, black}, kEpsilon);
  EXPECT_FALSE(m.relmse.has_value());
  EXPECT_FALSE(m.mape.has_value());
  EXPECT_DOUBLE_EQ(m.mse, (1.0 + 4 + 9 + 16 + 25 + 36) / 6.0);
}

TEST(EffectivePixels, OneRenderUsesTheGaussianFourthMoment) {
  // 3 (sum v)^2 / sum v^2 - 2 with v = 1, 3.
  EXPECT_DOUBLE_EQ(effective_pixels(std::vector<double>{1, 3}, 1).value(), 3.0 * 16.0 / 10.0 - 2.0);
  // A single pixel decides: 1.
  EXPECT_DOUBLE_EQ(effective_pixels(std::vector<double>{0, 7, 0}, 1).value(), 1.0);
}

TEST(EffectivePixels, ManyReplicatesGiveTheDefinitionItself) {
  // (1+3)^2 / (1+9); corrections are of order 1/nu.
  EXPECT_NEAR(effective_pixels(std::vector<double>{1, 3}, 1e12).value(), 1.6, 1e-10);
}

// Two hundred pixels of reference 1 with errors of 0.1, but for three of 2, 3 and 1.
TEST(ImageMetrics, TrimmedRelmseLeavesOutTheWorstHundredthOfThePixels) {
  const std::vector<Rgb> reference(200, Rgb(1.0f));
  std::vector<Rgb> image(200, Rgb(1.125f));
  image[7] = Rgb(3.0f);
  image[50] = Rgb(4.0f);
  image[199] = Rgb(2.0f);
  const ImageMetrics m = image_metrics(image, {reference, reference}, 0.25);
  EXPECT_NEAR(m.relmse.value(), (197.0 / 64.0 + 4.0 + 9.0 + 1.0) / 1.25 / 200.0, 1e-13);
  EXPECT_NEAR(m.relmse_trim.value(), (197.0 / 64.0 + 1.0) / 1.25 / 198.0, 1e-13);
}

TEST(ImageMetrics, TrimmingLooksAtTheErrorAgainstTheMeanAndAveragesTheDebiasedOne) {
  // Halves 0 and 2 everywhere, mean 1, 100 pixels. One pixel has x = 4: naive 9, debiased 4 x 2 =
  // 8; the others x = 1: naive 0, debiased -1.
  const std::vector<Rgb> half_a(100, Rgb(0.0f));
  const std::vector<Rgb> half_b(100, Rgb(2.0f));
  std::vector<Rgb> image(100, Rgb(1.0f));
  image[31] = Rgb(4.0f);
  const ImageMetrics m = image_metrics(image, {half_a, half_b}, 1.0);
  EXPECT_DOUBLE_EQ(m.relmse_trim.value(), -1.0 / 2.0);
}

TEST(ImageMetrics, FewerThanAHundredPixelsAreNotTrimmed) {
  const std::vector<Rgb> reference(99, Rgb(1.0f));
  std::vector<Rgb> image(99, Rgb(1.0f));
  image[3] = Rgb(2.0f);
  const ImageMetrics m = image_metrics(image, {reference, reference}, 0.25);
  EXPECT_DOUBLE_EQ(m.relmse_trim.value(), m.relmse.value());
}

/// Every metric of kImage against kHalfA and kHalfB, worked out by hand in exact fractions. rbar is
/// .5 1.5 1.5 | 5 4 5 with mean 35/12.
std::map<std::string_view, double> by_hand() {
  const double m = 35.0 / 12.0;
  const double eps = kEpsilon * m * m;
  const double relmse = (2.0 / (2.25 + eps) + 1.0 / (16.0 + eps)) / 6.0;  // products 0 0 2 | 0 1 0
  const double delta = 0.01 * m;
  // Squared errors per pixel, mean over channels: (.25 + .25 + 2.25)/3 and 1.
  const double v0 = 2.75 / 3.0;
  return {{"mse", 0.5},
          {"mse_naive", 5.75 / 6.0},
          {"rmse", std::sqrt(0.5)},
          {"relmse", relmse},
          {"relmse_trim", relmse},  // two pixels: none is trimmed
          {"mape", (0.5 / (0.5 + delta) + 0.5 / (1.5 + delta) + 1.5 / (1.5 + delta) +
                    2.0 / (5.0 + delta) + 1.0 / (4.0 + delta)) /
                       6.0},
          {"mean_error", 3.5 / 6.0},
          {"p_eff", 3.0 * (v0 + 1.0) * (v0 + 1.0) / (v0 * v0 + 1.0) - 2.0},
          {"reference_share", 11.0 / 12.0}};
}

TEST(MetricTable, EveryMetricEqualsItsValueByHand) {
  const ImageMetrics metrics = image_metrics(kImage, {kHalfA, kHalfB}, kEpsilon);
  std::map<std::string_view, double> expected = by_hand();
  for (const MetricInfo& metric : metric_table()) {
    const auto found = expected.find(metric.name);
    ASSERT_NE(found, expected.end()) << metric.name << " has no case computed by hand";
    EXPECT_NEAR(metric.value(metrics).value(), found->second, 1e-14 * std::abs(found->second))
        << metric.name << " = " << metric.formula;
    expected.erase(found);
  }
  EXPECT_TRUE(expected.empty()) << expected.begin()->first << " is not in the table";
}

TEST(MetricTable, EpsilonIsStatedWhereTheFormulaHasOne) {
  for (const MetricInfo& metric : metric_table()) {
    const bool in_formula = metric.formula.find("eps") != std::string_view::npos;
    EXPECT_EQ(in_formula, !metric.epsilon.empty()) << metric.name;
  }
}

TEST(MetricTable, TrimmedMetricsDecideNothing) {
  EXPECT_TRUE(find_metric("relmse_trim")->diagnostic);
  EXPECT_FALSE(find_metric("mse")->diagnostic);
  EXPECT_FALSE(find_metric("relmse")->diagnostic);
}

TEST(MetricTable, NamesAreUniqueAndFound) {
  std::set<std::string_view> names;
  for (const MetricInfo& metric : metric_table()) {
    EXPECT_TRUE(names.insert(metric.name).second) << metric.name;
    EXPECT_EQ(find_metric(metric.name), &metric);
    EXPECT_FALSE(metric.unit.empty());
    EXPECT_FALSE(metric.formula.empty());
  }
  EXPECT_EQ(find_metric("psnr"), nullptr);
}

/// Independent noise in every channel around a constant truth of 1.
std::vector<Rgb> noisy(std::size_t pixels, double sigma, Noise& noise) {
  std::vector<Rgb> image(pixels);
  for (Rgb& c : image) {
    for (int i = 0; i < 3; ++i) c[i] = static_cast<float>(1 + sigma * noise.gaussian());
  }
  return image;
}

// Seed: the test's name; 3 tests at false-alarm level 1e-4 each, and one control whose power is >
// 0.9999.
TEST(StatisticalMetrics, DebiasedMseIsUnbiasedWhereTheNaiveOneDoubles) {
  Noise noise("StatisticalMetrics.DebiasedMseIsUnbiasedWhereTheNaiveOneDoubles");
  const double variance =
      0.04;  // of a render; the reference's budget is the same: halves have twice the variance
  Welford debiased;
  Welford naive;
  Welford bias;
  for (int i = 0; i < 400; ++i) {
    const std::vector<Rgb> image = noisy(300, std::sqrt(variance), noise);
    const std::vector<Rgb> half_a = noisy(300, std::sqrt(2 * variance), noise);
    const std::vector<Rgb> half_b = noisy(300, std::sqrt(2 * variance), noise);
    const ImageMetrics m = image_metrics(image, {half_a, half_b}, kEpsilon);
    debiased.add(m.mse);
    naive.add(m.mse_naive);
    bias.add(m.mean_error);
  }
  EXPECT_LT(std::abs(debiased.mean() - variance), kLimit * debiased.standard_error().value());
  EXPECT_LT(std::abs(naive.mean() - 2 * variance), kLimit * naive.standard_error().value());
  EXPECT_LT(std::abs(bias.mean()), kLimit * bias.standard_error().value());
  EXPECT_GT(std::abs(naive.mean() - variance), kLimit * naive.standard_error().value())
      << "negative control: the naive MSE must fail the test of unbiasedness";
}

// Seed: the test's name; 2 tests at false-alarm level 1e-4 each.
TEST(StatisticalMetrics, FloorAndMeanErrorOfTheReferenceHaveTheirStatedVariance) {
  Noise noise("StatisticalMetrics.FloorAndMeanErrorOfTheReferenceHaveTheirStatedVariance");
  const std::size_t pixels = 100;
  Welford floor_difference;  // (mean of a b)^2 - u_ref^2, grey noise: mean 0
  Welford mean_difference;   // (mean rbar - 1)^2 - mean_se^2: mean 0
  for (int i = 0; i < 4000; ++i) {
    std::vector<Rgb> half_a(pixels);
    std::vector<Rgb> half_b(pixels);
    double product = 0;
    for (std::size_t p = 0; p < pixels; ++p) {
      const double sigma = p % 10 == 0 ? 0.3 : 0.1;
      half_a[p] = Rgb(static_cast<float>(1 + sigma * noise.gaussian()));
      half_b[p] = Rgb(static_cast<float>(1 + sigma * noise.gaussian()));
      product += (static_cast<double>(half_a[p].x) - 1) * (static_cast<double>(half_b[p].x) - 1);
    }
    product /= static_cast<double>(pixels);
    const ReferenceNoise n = reference_noise({half_a, half_b});
    floor_difference.add(product * product - n.floor * n.floor);
    mean_difference.add((n.mean - 1) * (n.mean - 1) - n.mean_se * n.mean_se);
  }
  EXPECT_LT(std::abs(floor_difference.mean()), kLimit * floor_difference.standard_error().value());
  EXPECT_LT(std::abs(mean_difference.mean()), kLimit * mean_difference.standard_error().value());
}

// Seed: the test's name; false-alarm level 1e-4, besides an allowance for the bias of the quotient,
// at most the relative variance of its denominator: with 10.9 mean s^4 of which 10 come from a
// tenth of the pixels, (105/9 - 1) (10/10.9)^2 / 4000 = 0.0023.
TEST(StatisticalMetrics, EffectivePixelsOfOneRenderMatchTheTrueVariances) {
  Noise noise("StatisticalMetrics.EffectivePixelsOfOneRenderMatchTheTrueVariances");
  const std::size_t pixels = 40000;
  // Variances 1, every tenth 10: (1.9 P)^2 / (10.9 P).
  const double truth = 3.61 / 10.9 * static_cast<double>(pixels);
  const std::vector<Rgb> reference(pixels, Rgb(1.0f));
  std::vector<Rgb> image(pixels);
  Welford estimates;
  for (int i = 0; i < 50; ++i) {
    for (std::size_t p = 0; p < pixels; ++p) {
      const double sigma = p % 10 == 0 ? std::sqrt(10.0) : 1.0;
      image[p] = Rgb(static_cast<float>(1 + sigma * noise.gaussian()));
    }
    estimates.add(image_metrics(image, {reference, reference}, kEpsilon).p_eff.value());
  }
  const double limit = kLimit * estimates.standard_error().value() + 0.0023 * truth;
  EXPECT_NEAR(estimates.mean(), truth, limit);
  EXPECT_GT(std::abs(estimates.mean() / 3 - truth), limit)
      << "negative control: without the factor 3 of the fourth moment";
}

}  // namespace
}  // namespace penumbra
