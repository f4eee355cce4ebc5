#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "harness/statistics.h"

/// Error against time: fits, interpolation and their intervals. Numbers only.
/// Source: statistics.md 3.4.
namespace penumbra {

/// Time and error of each block at one budget. Budgets have independent seeds; block b is the same
/// round at every budget, which a drift of the machine's speed has in common.
struct BudgetRuns {
  std::vector<double> times_s;  ///< [block]; the work in another unit where a fit is against that
  std::vector<double> errors;   ///< [block], may be negative: debiased
};

/// One method at several budgets.
struct CurveData {
  std::vector<BudgetRuns> budgets;  ///< in increasing mean time, equally many blocks each
  double reference_floor{0};        ///< u_ref of the errors (metrics.h), common to all of them

  std::size_t blocks() const { return budgets.empty() ? 0 : budgets.front().times_s.size(); }
};

/// Means of one budget.
struct CurvePoint {
  double time_s{0};
  double error{0};
};

/// Means over all blocks but `skip`. @param skip  blocks() for none
std::vector<CurvePoint> points_of(const CurveData& data, std::size_t skip);

/// A value with its jackknife over blocks; no interval for one block.
struct FitEstimate {
  double value{0};
  std::optional<double> standard_error;
  std::optional<Interval> interval;  ///< t with R - 1 degrees of freedom
};

/// log error = alpha + beta log time, by least squares.
struct SlopeFit {
  FitEstimate slope;                ///< beta
  std::optional<double> p_minus_1;  ///< two-sided t test of beta = -1
};

/// All budgets have the same weight. Weights from the blocks' own variances are worse than none: in
/// a few blocks a low mean goes with a low variance, so that they follow the noise. Measured on
/// 3000 curves of renders whose relative variance falls by 1.7 from the first to the last budget,
/// 10 blocks each: intervals of 95 % held -1 in 90.2 % with such weights and in 94.0 % without, and
/// the slopes spread by 0.129 and 0.124. The reference's floor enters the standard error in
/// quadrature.
/// @return empty for fewer than two budgets, or where a mean (also of all blocks but one) is not
///         positive
std::optional<SlopeFit> fit_slope(const CurveData& data, double confidence);

/// error = a / time + b^2, b the bias floor (the root of the error that no time removes).
struct FloorFit {
  double a{0};
  FitEstimate square;                ///< b^2 fitted without the bound, may be negative
  double floor{0};                   ///< b; 0 where the interval of `square` holds 0
  std::optional<Interval> interval;  ///< of b, see fit_floor
};

/// Linear in a and b^2, hence weighted linear least squares; weights are inverse squares of the
/// fitted errors, that is, equal relative variances as in fit_slope, iterated.
///
/// The interval of b is made for b^2 without the bound, where the estimate is nearly normal even
/// if truly b = 0, and then cut: from max(0, lo) to max(0, estimate) + half width. The upper end is
/// never below what an estimate of 0 would have, so that an estimate far below 0 by chance does not
/// claim precision. A true b >= 0 is covered as often as stated or more, but for what skewed errors
/// cost: measured for intervals of 95 %, 20000 simulated curves of 5 and of 10 blocks each, 97.8 to
/// 98.2 % at b = 0 and 94.6 to 98.4 % above.
/// @return empty for fewer than three budgets or two different times
std::optional<FloorFit> fit_floor(const CurveData& data, double confidence);

/// How far beyond the measured times a curve is followed, as a factor.
inline constexpr double kMaxExtrapolation = 2.0;

/// Error at a time: log-log interpolation between neighbours; beyond the ends a line of slope
/// `slope` through the end point.
/// @param points  in increasing time, positive errors, at least one
/// @return empty further than kMaxExtrapolation beyond the ends
std::optional<double> error_at(std::span<const CurvePoint> points, double time_s, double slope);

/// The first time at which the error is as low as `target` > 0, likewise.
/// @return empty where that is further than kMaxExtrapolation beyond the ends, or never
std::optional<double> time_to(std::span<const CurvePoint> points, double target, double slope);

/// error_at with its jackknife, made for the logarithm; the floor in quadrature.
/// @return the error, its interval, and the standard error of the logarithm;
///         empty for fewer than three budgets, and where error_at is, also of all blocks but one
std::optional<FitEstimate> fitted_error_at(const CurveData& data, double time_s, double confidence);

/// Time to a baseline's error at its largest budget, and how many times faster that is than the
/// baseline there.
struct TargetFit {
  double target{0};
  FitEstimate time_s;  ///< interval and standard error made for the logarithm
  FitEstimate log_speedup;
};

/// Both curves are read at one level of error, so the reference's floor cancels.
/// @param method, baseline  of the same blocks
/// @return empty for fewer than three budgets of either, and where time_to is
std::optional<TargetFit> fit_target(const CurveData& method, const CurveData& baseline,
                                    double confidence);

}  // namespace penumbra
