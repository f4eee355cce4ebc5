// Fits of error against time, on curves made by hand and on simulated ones.
//
// Simulations: seeds are the tests' names; where a coverage is compared with its nominal value, the
// false-alarm level is 1e-3 per comparison (is_nominal).

#include "harness/curve_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "tests/unit/noise.h"

namespace penumbra {
namespace {

/// Budgets without noise, the same in every block.
CurveData exact_curve(const std::vector<double>& times, const std::function<double(double)>& error,
                      std::size_t blocks) {
  CurveData data;
  for (const double t : times) {
    data.budgets.push_back({std::vector<double>(blocks, t), std::vector<double>(blocks, error(t))});
  }
  return data;
}

/// Budgets 1, 2, 4, 8 with error a/T + b^2; errors as noisy as if `degrees` pixels decided them,
/// times with a drift that a block shares.
CurveData noisy_curve(double a, double b, int degrees, int blocks, Noise& noise) {
  CurveData data;
  std::vector<double> drift;
  for (int i = 0; i < blocks; ++i) drift.push_back(std::exp(0.1 * noise.gaussian()));
  for (const double t : {1.0, 2.0, 4.0, 8.0}) {
    BudgetRuns& runs = data.budgets.emplace_back();
    for (int i = 0; i < blocks; ++i) {
      runs.times_s.push_back(t * drift[static_cast<std::size_t>(i)] *
                             std::exp(0.02 * noise.gaussian()));
      runs.errors.push_back((a / t + b * b) * noise.mean_square(degrees));
    }
  }
  return data;
}

TEST(FitSlope, OfAPowerLawIsItsExponent) {
  const auto fit = fit_slope(exact_curve(
                                 {1, 2, 8}, [](double t) { return 3 * std::pow(t, -0.7); }, 4),
                             0.95);
  EXPECT_NEAR(fit->slope.value, -0.7, 1e-12);
  EXPECT_NEAR(fit->slope.standard_error.value(), 0, 1e-12);
}

TEST(FitSlope, TwoBlocksMatchHandComputation) {
  // Budgets 1 and e, so that the slope is the difference of the log errors: -log(4) for the means,
  // and for either block alone.
  CurveData data;
  data.budgets.push_back({{1, 1}, {1, 3}});
  data.budgets.push_back({{std::numbers::e, std::numbers::e}, {0.25, 0.75}});
  EXPECT_NEAR(fit_slope(data, 0.95)->slope.value, -std::log(4.0), 1e-12);
  EXPECT_NEAR(fit_slope(data, 0.95)->slope.standard_error.value(), 0, 1e-12);
  data.budgets[1].errors = {0.75, 0.25};
  // Alone: log(1/4) - log(3) and log(3/4) - log(1), which differ by 2 log(3); SE is half of that.
  const SlopeFit fit = fit_slope(data, 0.95).value();
  EXPECT_NEAR(fit.slope.standard_error.value(), std::log(3.0), 1e-12);
  const double t = std::tan(std::numbers::pi * 0.475);
  EXPECT_NEAR(fit.slope.interval->hi, -std::log(4.0) + t * std::log(3.0), 1e-7);
  // t = (1 - log 4)/log 3 with one degree of freedom.
  const double p = 1 - 2 / std::numbers::pi * std::atan((std::log(4.0) - 1) / std::log(3.0));
  EXPECT_NEAR(fit.p_minus_1.value(), p, 1e-9);
}

TEST(FitSlope, ReferenceFloorWidensTheInterval) {
  CurveData data = exact_curve(
      {1, std::numbers::e}, [](double t) { return 1 / t; }, 4);
  data.reference_floor = 0.01;
  // slope = log e_2 - log e_1; a shift of 0.01 changes it by 0.01 (e - 1).
  EXPECT_NEAR(fit_slope(data, 0.95)->slope.standard_error.value(), 0.01 * (std::numbers::e - 1),
              1e-12);
}

TEST(FitSlope, HasNoneBelowReferenceNoiseOrFromOneBudget) {
  CurveData data = exact_curve(
      {1, 2, 4}, [](double t) { return 1 / t; }, 3);
  data.budgets[2].errors = {1, 1, -5};
  EXPECT_FALSE(fit_slope(data, 0.95).has_value());
  data.budgets[2].errors = {5, 1, -5};  // positive with all blocks, not without the first
  EXPECT_FALSE(fit_slope(data, 0.95).has_value());
  EXPECT_FALSE(fit_slope(exact_curve(
                             {1}, [](double) { return 1.0; }, 3),
                         0.95)
                   .has_value());
  EXPECT_FALSE(fit_slope(exact_curve(
                             {1, 1}, [](double) { return 1.0; }, 3),
                         0.95)
                   .has_value());
}

TEST(FitSlope, OneBlockHasAValueButNoInterval) {
  const auto fit = fit_slope(exact_curve(
                                 {1, 2}, [](double t) { return 1 / t; }, 1),
                             0.95);
  EXPECT_NEAR(fit->slope.value, -1, 1e-12);
  EXPECT_FALSE(fit->slope.interval || fit->p_minus_1);
}

TEST(FitFloor, RecoversAnExactCurve) {
  const auto fit = fit_floor(exact_curve(
                                 {1, 2, 4, 8}, [](double t) { return 3 / t + 0.25; }, 4),
                             0.95);
  EXPECT_NEAR(fit->a, 3, 1e-9);
  EXPECT_NEAR(fit->floor, 0.5, 1e-9);
}

TEST(FitFloor, IntervalIsCutAtZeroAndKeepsItsUpperEnd) {
  CurveData data = exact_curve(
      {1, 2, 4}, [](double t) { return 1 / t; }, 4);
  data.reference_floor = 0.01;  // the only uncertainty
  const double t = 3.1824463;   // 0.975 quantile with 3 degrees of freedom, every printed table
  FloorFit fit = fit_floor(data, 0.95).value();
  EXPECT_EQ(fit.floor, 0);
  EXPECT_EQ(fit.interval->lo, 0);
  EXPECT_NEAR(fit.interval->hi, std::sqrt(0.01 * t), 1e-6);
  // Errors that fall faster than 1/T have a negative b^2; the upper end stays.
  data = exact_curve(
      {1, 2, 4}, [](double x) { return 1 / x - 0.1; }, 4);
  data.reference_floor = 0.01;
  fit = fit_floor(data, 0.95).value();
  EXPECT_NEAR(fit.square.value, -0.1, 1e-9);
  EXPECT_EQ(fit.floor, 0);
  EXPECT_NEAR(fit.interval->hi, std::sqrt(0.01 * t), 1e-6);
}

TEST(FitFloor, NeedsThreeBudgets) {
  EXPECT_FALSE(fit_floor(exact_curve(
                             {1, 2}, [](double t) { return 1 / t; }, 3),
                         0.95));
}

const std::vector<CurvePoint> kPoints{{1, 8}, {2, 4}, {8, 1}};

TEST(ErrorAt, InterpolatesLogarithmsAndFollowsTheSlopeBeyondTheEnds) {
  EXPECT_DOUBLE_EQ(error_at(kPoints, 1, -1).value(), 8);
  EXPECT_NEAR(error_at(kPoints, 4, -1).value(), 2, 1e-12);
  EXPECT_NEAR(error_at(kPoints, 16, -0.5).value(), std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(error_at(kPoints, 0.5, -1).value(), 16, 1e-12);
  EXPECT_FALSE(error_at(kPoints, 16.1, -1).has_value());
  EXPECT_FALSE(error_at(kPoints, 0.49, -1).has_value());
}

TEST(TimeTo, IsTheFirstTimeAtWhichTheErrorIsReached) {
  EXPECT_NEAR(time_to(kPoints, 2, -1).value(), 4, 1e-12);
  EXPECT_NEAR(time_to(kPoints, 0.5, -1).value(), 16, 1e-12);
  EXPECT_NEAR(time_to(kPoints, 16, -1).value(), 0.5, 1e-12);
  EXPECT_FALSE(time_to(kPoints, 0.4, -1).has_value());
  EXPECT_FALSE(time_to(kPoints, 17, -1).has_value());
  EXPECT_FALSE(time_to(kPoints, 0.9, 0.1).has_value()) << "an error that grows is never lower";
  const std::vector<CurvePoint> bumpy{{1, 8}, {2, 2}, {4, 3}, {8, 1}};
  EXPECT_NEAR(time_to(bumpy, 2, -1).value(), 2, 1e-12);
}

TEST(FittedErrorAt, ReferenceFloorIsRelativeToTheError) {
  CurveData data = exact_curve(
      {1, 2, 4}, [](double t) { return 1 / t; }, 4);
  data.reference_floor = 0.05;
  const FitEstimate at = fitted_error_at(data, 2, 0.95).value();
  EXPECT_NEAR(at.value, 0.5, 1e-12);
  EXPECT_NEAR(at.standard_error.value(), 0.1, 1e-12);
  EXPECT_NEAR(at.interval->hi, 0.5 * std::exp(3.1824463 * 0.1), 1e-7);
  data.budgets.pop_back();
  EXPECT_FALSE(fitted_error_at(data, 2, 0.95).has_value());
}

TEST(FitTarget, SpeedupIsTheRatioOfTimesAtOneError) {
  const auto error = [](double t) { return 1 / t; };
  const CurveData baseline = exact_curve({1, 2, 4}, error, 4);
  const CurveData method = exact_curve(
      {1, 2, 4}, [](double t) { return 0.4 / t; }, 4);  // 2.5 times as fast
  const TargetFit fit = fit_target(method, baseline, 0.95).value();
  EXPECT_NEAR(fit.target, 0.25, 1e-12);
  EXPECT_NEAR(fit.time_s.value, 1.6, 1e-12);
  EXPECT_NEAR(std::exp(fit.log_speedup.value), 2.5, 1e-12);
  const TargetFit self = fit_target(baseline, baseline, 0.95).value();
  EXPECT_NEAR(self.log_speedup.value, 0, 1e-12);
  // 20 times as fast: the target is reached long before the first budget.
  const CurveData fast = exact_curve(
      {1, 2, 4}, [](double t) { return 0.05 / t; }, 4);
  EXPECT_FALSE(fit_target(fast, baseline, 0.95).has_value());
}

constexpr int kTrials = 2000;

TEST(StatisticalCurveFit, SlopeOfAnUnbiasedEstimatorCoversMinusOneAsOftenAsItSays) {
  for (const int blocks : {5, 10}) {
    Noise noise("StatisticalCurveFit.Slope" + std::to_string(blocks));
    int covered = 0;
    int rejected = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const SlopeFit fit = fit_slope(noisy_curve(1, 0, 8, blocks, noise), 0.95).value();
      covered += fit.slope.interval->lo <= -1 && -1 <= fit.slope.interval->hi ? 1 : 0;
      rejected += *fit.p_minus_1 < 0.05 ? 1 : 0;
    }
    EXPECT_TRUE(is_nominal(covered, kTrials, 0.95)) << covered << " at R = " << blocks;
    EXPECT_EQ(covered + rejected, kTrials) << "the test is that of the interval";
  }
}

TEST(StatisticalCurveFit, SlopeOfABiasedEstimatorIsFoundOut) {
  Noise noise("StatisticalCurveFit.SlopeOfABiasedEstimatorIsFoundOut");
  int rejected = 0;
  for (int trial = 0; trial < 200; ++trial) {
    rejected += *fit_slope(noisy_curve(1, 0.5, 50, 10, noise), 0.95)->p_minus_1 < 0.05 ? 1 : 0;
  }
  EXPECT_GT(rejected, 180);
}

/// @return how often the interval holds b
int floor_covered(double b, int blocks, Noise& noise, int& zeros) {
  int covered = 0;
  zeros = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const FloorFit fit = fit_floor(noisy_curve(1, b, 20, blocks, noise), 0.95).value();
    covered += fit.interval->lo <= b && b <= fit.interval->hi ? 1 : 0;
    zeros += fit.floor == 0 ? 1 : 0;
  }
  return covered;
}

// At b = 0 only the lower end can miss: 97.5 % or more. Above, 95 % or more; how much more depends
// on how far b is from 0. 0.01 is what the skewness of these errors may cost.
TEST(StatisticalCurveFit, IntervalOfTheFloorCoversItAtLeastAsOftenAsItSays) {
  const double noise_of = 3.29 * std::sqrt(0.05 * 0.95 / kTrials);
  for (const double b : {0.0, 0.1, 0.3, 1.0}) {
    Noise noise("StatisticalCurveFit.Floor" + std::to_string(b));
    int zeros = 0;
    const double covered = floor_covered(b, 10, noise, zeros) / static_cast<double>(kTrials);
    EXPECT_GE(covered, (b == 0 ? 0.975 : 0.95) - noise_of - 0.01) << b;
    if (b == 0) {
      EXPECT_GT(zeros, 0.95 * kTrials);
    } else if (b == 1) {
      EXPECT_EQ(zeros, 0) << "a bias as large as the error is never reported as none";
    }
  }
}

TEST(StatisticalCurveFit, ErrorAtABudgetAndSpeedupCoverTheTruth) {
  Noise noise("StatisticalCurveFit.ErrorAtABudgetAndSpeedupCoverTheTruth");
  int at_covered = 0;
  int speedup_covered = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const CurveData baseline = noisy_curve(1, 0, 50, 10, noise);
    const CurveData method = noisy_curve(0.4, 0, 50, 10, noise);
    const Interval at = fitted_error_at(method, 3, 0.95)->interval.value();
    // The drift of times, mean exp(0.1^2/2 + 0.02^2/2), moves the curve along T.
    const double truth = 0.4 / 3 * std::exp(0.0052);
    at_covered += at.lo <= truth && truth <= at.hi ? 1 : 0;
    const Interval speedup = fit_target(method, baseline, 0.95)->log_speedup.interval.value();
    speedup_covered += speedup.lo <= std::log(2.5) && std::log(2.5) <= speedup.hi ? 1 : 0;
  }
  EXPECT_TRUE(is_nominal(at_covered, kTrials, 0.95)) << at_covered;
  EXPECT_TRUE(is_nominal(speedup_covered, kTrials, 0.95)) << speedup_covered;
}

}  // namespace
}  // namespace penumbra
