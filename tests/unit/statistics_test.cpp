#include "harness/statistics.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/unit/noise.h"

namespace penumbra {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Welford welford(const std::vector<double>& values) {
  Welford w;
  for (const double v : values) w.add(v);
  return w;
}

TEST(Welford, MeanAndVarianceMatchHandComputation) {
  const Welford w = welford({2, 4, 4, 4, 5, 5, 7, 9});
  EXPECT_DOUBLE_EQ(w.mean(), 5.0);
  EXPECT_DOUBLE_EQ(w.variance().value(), 32.0 / 7.0);  // squares of deviations: 9+1+1+1+0+0+4+16
  EXPECT_DOUBLE_EQ(w.standard_error().value(), std::sqrt(32.0 / 7.0 / 8.0));
}

TEST(Welford, LargeOffsetDoesNotCancel) {
  const Welford w = welford({1e9 + 4, 1e9 + 7, 1e9 + 13, 1e9 + 16});
  EXPECT_DOUBLE_EQ(w.variance().value(), 30.0);  // (36+9+9+36)/3
}

TEST(Welford, MergeEqualsAddingInOneSequence) {
  Welford left = welford({1, 2, 10});
  left.merge(welford({-3, 8}));
  const Welford all = welford({1, 2, 10, -3, 8});
  EXPECT_EQ(left.count(), 5u);
  EXPECT_NEAR(left.mean(), all.mean(), 1e-14);
  EXPECT_NEAR(left.variance().value(), all.variance().value(), 1e-12);
  left.merge(Welford{});
  EXPECT_EQ(left.count(), 5u);
  Welford empty;
  empty.merge(all);
  EXPECT_DOUBLE_EQ(empty.mean(), all.mean());
}

TEST(Welford, TooFewValuesHaveNoVariance) {
  EXPECT_TRUE(std::isnan(Welford{}.mean()));
  EXPECT_FALSE(welford({3}).variance().has_value());
  EXPECT_FALSE(welford({3}).standard_error().has_value());
}

TEST(StudentT, QuantilesMatchTheClosedFormsOfOneAndTwoDegreesOfFreedom) {
  for (const double p : {0.6, 0.9, 0.975, 0.9995}) {
    const double one = std::tan(std::numbers::pi * (p - 0.5));
    const double two = (2 * p - 1) / std::sqrt(2 * p * (1 - p));
    EXPECT_NEAR(student_t_quantile(p, 1), one, 1e-9 * one) << p;
    EXPECT_NEAR(student_t_quantile(p, 2), two, 1e-9 * two) << p;
  }
  EXPECT_NEAR(student_t_quantile(0.975, 9), 2.2622, 5e-5);  // every printed t table
}

TEST(StudentT, TwoSidedPMatchesTheClosedFormOfOneDegreeOfFreedom) {
  for (const double t : {-3.0, 0.0, 0.5, 12.7}) {
    EXPECT_NEAR(student_t_two_sided_p(t, 1), 1 - 2 / std::numbers::pi * std::atan(std::abs(t)),
                1e-12);
  }
  EXPECT_EQ(student_t_two_sided_p(std::numeric_limits<double>::infinity(), 4), 0.0);
  EXPECT_TRUE(std::isnan(student_t_two_sided_p(kNaN, 4)));
}

TEST(MeanInterval, AddsTheSharedErrorInQuadrature) {
  // {1, 3}: mean 2, standard error 1; with sqrt(3) it is 2.
  const double t = std::tan(std::numbers::pi * 0.475);
  const Interval plain = mean_interval(welford({1, 3}), 0.95).value();
  EXPECT_NEAR(plain.lo, 2 - t, 1e-8);
  EXPECT_NEAR(plain.hi, 2 + t, 1e-8);
  EXPECT_NEAR(mean_interval(welford({1, 3}), 0.95, std::sqrt(3.0))->hi, 2 + 2 * t, 1e-8);
  EXPECT_FALSE(mean_interval(welford({1}), 0.95).has_value());
}

TEST(ZeroMeanP, MatchesHandComputation) {
  EXPECT_NEAR(zero_mean_p(welford({1, 3})).value(), 1 - 2 / std::numbers::pi * std::atan(2.0),
              1e-12);
  // Standard error 2 instead of 1: t = 1; Welch-Satterthwaite: 1 x (4/1)^2 degrees of freedom.
  EXPECT_NEAR(zero_mean_p(welford({1, 3}), std::sqrt(3.0)).value(), student_t_two_sided_p(1, 16),
              1e-12);
  EXPECT_NEAR(zero_mean_p(welford({1, 3}), 1e200).value(), 1.0, 1e-12);
}

TEST(ZeroMeanP, DoesNotTestWithoutSpread) {
  EXPECT_FALSE(zero_mean_p(welford({2, 2, 2})).has_value());
  EXPECT_FALSE(zero_mean_p(welford({2})).has_value());
}

TEST(HodgesLehmann, IsTheMedianOfAllPairMeans) {
  // Sorted pair means of {1,2,3,10}: 1 1.5 2 2 2.5 | 3 5.5 6 6.5 10.
  EXPECT_DOUBLE_EQ(hodges_lehmann(std::vector<double>{10, 1, 3, 2}), 2.75);
  // Of {1,2,5}: 1 1.5 2 | 3 3.5 5.
  EXPECT_DOUBLE_EQ(hodges_lehmann(std::vector<double>{5, 1, 2}), 2.5);
  EXPECT_DOUBLE_EQ(hodges_lehmann(std::vector<double>{1, 4}), 2.5);
  EXPECT_DOUBLE_EQ(hodges_lehmann(std::vector<double>{7}), 7);
  EXPECT_TRUE(std::isnan(hodges_lehmann(std::vector<double>{1, kNaN})));
}

TEST(LogEfficiency, TwoBlocksMatchHandComputation) {
  // Mean error 2; leaving one out: log 1 and log 3, so that SE^2 = 1/2 x 2 (log(3)/2)^2.
  const std::vector<CostError> blocks{{1, 1}, {1, 3}};
  const LogEstimate e = log_efficiency(blocks).log.value();
  EXPECT_DOUBLE_EQ(e.value, -std::log(2.0));
  EXPECT_NEAR(e.standard_error.value(), std::log(3.0) / 2, 1e-14);
  const double half_width = std::tan(std::numbers::pi * 0.475) * std::log(3.0) / 2;
  EXPECT_NEAR(e.interval->hi, -std::log(2.0) + half_width, 1e-8);
  EXPECT_NEAR(e.interval->lo, -std::log(2.0) - half_width, 1e-8);
}

TEST(LogEfficiency, UsesTheRatioOfMeansNotTheMeanOfRatios) {
  const std::vector<CostError> blocks{{1, 4}, {3, 2}};
  EXPECT_DOUBLE_EQ(log_efficiency(blocks).log->value, -std::log(2.0 * 3.0));
}

TEST(LogEfficiency, JackknifeOfALogMeanAgreesWithTheDeltaMethodForSmallSpread) {
  std::vector<CostError> blocks;
  for (int i = 0; i < 9; ++i) blocks.push_back({1, 1 + 1e-4 * (i - 4)});
  // s = 1e-4 sqrt(60/8), SE = s / 3 / mean.
  const double expected = 1e-4 * std::sqrt(60.0 / 8.0) / 3.0;
  EXPECT_NEAR(log_efficiency(blocks).log->standard_error.value(), expected, 1e-3 * expected);
}

TEST(LogEfficiency, ErrorBelowReferenceNoiseHasNoLogarithm) {
  const auto fails = [](std::vector<CostError> blocks, NoEstimate reason) {
    const EfficiencyEstimate e = log_efficiency(blocks);
    EXPECT_FALSE(e.log.has_value());
    EXPECT_EQ(e.reason, reason);
    EXPECT_FALSE(reason_text(e.reason).empty());
  };
  fails({{1, -2}, {1, 1}}, NoEstimate::BelowReferenceNoise);
  fails({{1, 0}, {1, 0}}, NoEstimate::BelowReferenceNoise);
  fails({{1, 3}, {1, -2}}, NoEstimate::BelowReferenceNoise);  // positive only with the first
  fails({{1, kNaN}, {1, 1}}, NoEstimate::NonFinite);
  fails({{0, 1}, {0, 1}}, NoEstimate::NonPositiveCost);
  fails({}, NoEstimate::NoBlocks);
}

TEST(LogEfficiency, OneBlockHasAValueButNoInterval) {
  const LogEstimate e = log_efficiency(std::vector<CostError>{{2, 5}}).log.value();
  EXPECT_DOUBLE_EQ(e.value, -std::log(10.0));
  EXPECT_FALSE(e.standard_error.has_value());
  EXPECT_FALSE(e.interval.has_value());
}

TEST(LogEfficiency, ReferenceFloorIsRelativeToTheError) {
  const std::vector<CostError> blocks(4, {1, 2});
  EXPECT_NEAR(log_efficiency(blocks, {0.95, 0.1}).log->standard_error.value(), 0.05, 1e-15);
}

TEST(LogEfficiencyRatio, IsTheDifferenceOfTheLogEfficiencies) {
  const std::vector<PairedCostError> blocks{{{1, 4}, {2, 2}}, {{3, 2}, {2, 6}}, {{2, 3}, {5, 1}}};
  std::vector<CostError> method;
  std::vector<CostError> baseline;
  for (const PairedCostError& b : blocks) {
    method.push_back(b.method);
    baseline.push_back(b.baseline);
  }
  EXPECT_NEAR(log_efficiency_ratio(blocks).log->value,
              log_efficiency(method).log->value - log_efficiency(baseline).log->value, 1e-14);
}

TEST(LogEfficiencyRatio, CommonDriftOfABlockCancels) {
  std::vector<PairedCostError> blocks;
  for (const double drift : {1.0, 1.7, 0.6, 2.5}) {
    blocks.push_back({{drift, 1}, {3 * drift, 1}});
  }
  const LogEstimate e = log_efficiency_ratio(blocks).log.value();
  EXPECT_NEAR(e.value, std::log(3.0), 1e-14);
  EXPECT_NEAR(e.standard_error.value(), 0.0, 1e-14);
}

TEST(LogEfficiencyRatio, ReferenceFloorIsCommonToBothSides) {
  const JackknifeOptions options{0.95, 0.1};
  const std::vector<PairedCostError> equal(4, {{1, 2}, {1, 2}});
  EXPECT_NEAR(log_efficiency_ratio(equal, options).log->standard_error.value(), 0.0, 1e-15);
  const std::vector<PairedCostError> unequal(4, {{1, 2}, {1, 4}});  // 0.1 (1/2 - 1/4)
  EXPECT_NEAR(log_efficiency_ratio(unequal, options).log->standard_error.value(), 0.025, 1e-15);
}

TEST(Median, IsTheMiddleValue) {
  EXPECT_EQ(median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median({4.0, 1.0, 3.0, 2.0}), 3.0) << "the upper of two";
}

TEST(HolmAdjusted, MatchesHandComputation) {
  // Sorted: .005 x 4, .01 x 3, .03 x 2, then .04 x 1 raised to the one before.
  const std::vector<double> adjusted = holm_adjusted(std::vector<double>{0.01, 0.04, 0.03, 0.005});
  const std::array<double, 4> expected{0.03, 0.06, 0.06, 0.02};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(adjusted[i], expected[i], 1e-15) << i;
  EXPECT_DOUBLE_EQ(holm_adjusted(std::vector<double>{0.9, 0.8})[1], 1.0);
  EXPECT_TRUE(holm_adjusted({}).empty());
}

TEST(FitTime, RecoversALineAndResistsOneDisturbedRun) {
  const std::vector<double> low{2.5, 2.5, 2.5, 2.5, 90};    // 0.5 + 0.25 x 8
  const std::vector<double> high{8.5, 8.5, 8.5, 8.5, 8.5};  // 0.5 + 0.25 x 32
  const TimeFit fit = fit_time({8, low}, {32, high}).value();
  EXPECT_NEAR(fit.per_sample_s, 0.25, 1e-15);
  EXPECT_NEAR(fit.fixed_s, 0.5, 1e-14);
  EXPECT_FALSE(fit.fixed_set_aside);
}

TEST(FitTime, NegativeFixedPartIsSetAsideAndSaidSo) {
  const TimeFit fit =
      fit_time({1, std::vector<double>{1.0}}, {4, std::vector<double>{8.0}}).value();
  EXPECT_TRUE(fit.fixed_set_aside);
  EXPECT_EQ(fit.fixed_s, 0.0);
  EXPECT_DOUBLE_EQ(fit.per_sample_s, 2.0);  // 8 / 4
}

TEST(FitTime, LevelsThatDoNotGrowGiveNoFit) {
  EXPECT_FALSE(fit_time({1, std::vector<double>{2.0}}, {4, std::vector<double>{2.0}}).has_value());
  EXPECT_FALSE(fit_time({1, std::vector<double>{kNaN}}, {4, std::vector<double>{2.0}}).has_value());
}

TEST(SamplesForTime, RoundsDownAndRefusesLessThanOne) {
  EXPECT_EQ(samples_for_time({0.5, 0.25, false}, 2.9).value(), 9);  // 2.4 / 0.25 = 9.6
  EXPECT_FALSE(samples_for_time({0.5, 0.25, false}, 0.7).has_value());
}

/// Simulated blocks: log-normal times with a drift that a block shares, errors like chi-square with
/// 8 degrees of freedom (relative standard deviation 0.5). The method takes 1.5 and errs 0.5 times
/// as much as its baseline.
std::vector<PairedCostError> simulated_blocks(int count, Noise& noise) {
  std::vector<PairedCostError> blocks;
  for (int i = 0; i < count; ++i) {
    const double drift = std::exp(0.3 * noise.gaussian());
    const double time_m = 1.5 * drift * std::exp(0.1 * noise.gaussian());
    const double time_b = drift * std::exp(0.1 * noise.gaussian());
    const double error_m = 0.5 * noise.mean_square(8);
    blocks.push_back({{time_m, error_m}, {time_b, noise.mean_square(8)}});
  }
  return blocks;
}

constexpr int kTrials = 2000;

bool covers_nominally(int hits) { return is_nominal(hits, kTrials, 0.95); }

/// @param critical  of the interval's half width in standard errors; 0 for the interval as it is
/// reported
int count_covered(int blocks, double critical, Noise& noise) {
  const double truth = -std::log(1.5 * 0.5);
  int hits = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const LogEstimate e = log_efficiency_ratio(simulated_blocks(blocks, noise)).log.value();
    Interval interval = e.interval.value();
    if (critical > 0) {
      const double half_width = critical * e.standard_error.value();
      interval = {e.value - half_width, e.value + half_width};
    }
    if (interval.lo <= truth && truth <= interval.hi) ++hits;
  }
  return hits;
}

// Seed: the test's name; 2 tests at false-alarm level 1e-3.
TEST(StatisticalJackknife, IntervalOfTheRatioCoversTheTruthAsOftenAsItSays) {
  Noise noise("StatisticalJackknife.IntervalOfTheRatioCoversTheTruthAsOftenAsItSays");
  for (const int blocks : {5, 10}) {
    const int hits = count_covered(blocks, 0, noise);
    EXPECT_TRUE(covers_nominally(hits)) << hits << " of " << kTrials << " at R = " << blocks;
  }
}

// Seed: the test's name; false-alarm level 1e-3.
TEST(StatisticalJackknife, IntervalOfOneEfficiencyCoversTheTruthAsOftenAsItSays) {
  Noise noise("StatisticalJackknife.IntervalOfOneEfficiencyCoversTheTruthAsOftenAsItSays");
  // Means of the log-normal times: 1.5 exp((0.3^2 + 0.1^2)/2).
  const double truth = -std::log(1.5 * std::exp(0.05) * 0.5);
  int hits = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<CostError> blocks;
    for (const PairedCostError& b : simulated_blocks(10, noise)) blocks.push_back(b.method);
    const Interval interval = log_efficiency(blocks).log->interval.value();
    if (interval.lo <= truth && truth <= interval.hi) ++hits;
  }
  EXPECT_TRUE(covers_nominally(hits)) << hits << " of " << kTrials;
}

// Negative control of the test above: a normal instead of a t quantile at R = 3 (truly about 0.8).
TEST(StatisticalJackknife, NormalIntervalOfThreeBlocksIsFoundOut) {
  Noise noise("StatisticalJackknife.NormalIntervalOfThreeBlocksIsFoundOut");
  const int hits = count_covered(3, 1.96, noise);
  EXPECT_FALSE(covers_nominally(hits)) << hits << " of " << kTrials;
  EXPECT_LT(hits, kTrials * 9 / 10);
}

TEST(DetectableEffect, MatchesHandComputation) {
  // Two blocks: one degree of freedom, quantiles tan(pi (p - 1/2)).
  const double t = std::tan(std::numbers::pi * 0.475) + std::tan(std::numbers::pi * 0.3);
  EXPECT_NEAR(detectable_effect(0.01, 2).value(), std::exp(0.01 * t) - 1, 1e-9);
  // 2/50 + 2/200 + 0.5^2 = 0.3, over two blocks.
  EXPECT_NEAR(detectable_effect(50, 200, 0.5, 2).value(), std::exp(std::sqrt(0.15) * t) - 1, 1e-6);
  EXPECT_FALSE(detectable_effect(0.01, 1).has_value());
  EXPECT_FALSE(detectable_effect(50, 200, 0.5, 1).has_value());
}

// Seed: the test's name. The formula adds two quantiles where the exact power needs the non-central
// t, so the power is 0.8 within 0.03 and not exactly; the binomial part is 3.29 standard errors.
TEST(StatisticalDetectableEffect, IsFoundInFourOfFiveMeasurements) {
  Noise noise("StatisticalDetectableEffect.IsFoundInFourOfFiveMeasurements");
  constexpr int kPixels = 500;
  constexpr double kTimeSd = 0.05;
  for (const int count : {6, 10, 20}) {
    const double effect = detectable_effect(kPixels, kPixels, kTimeSd, count).value();
    int found = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      std::vector<PairedCostError> blocks;
      for (int i = 0; i < count; ++i) {
        const double time = std::exp(kTimeSd * noise.gaussian());
        const auto error = [&] { return 1 + std::sqrt(2.0 / kPixels) * noise.gaussian(); };
        const double own = error();
        blocks.push_back({{time, own / (1 + effect)}, {1, error()}});
      }
      const Interval interval = log_efficiency_ratio(blocks).log->interval.value();
      found += interval.lo > 0 || interval.hi < 0 ? 1 : 0;
    }
    const double power = static_cast<double>(found) / kTrials;
    EXPECT_NEAR(power, 0.8, 0.03 + 3.29 * std::sqrt(0.16 / kTrials)) << "at R = " << count;
  }
}

}  // namespace
}  // namespace penumbra
