#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

/// The statistics behind every printed interval. Source: statistics.md 3.2 to 3.5.
namespace penumbra {

/// Mean and variance in one pass without cancellation.
/// Source: Welford 1962; merging: Chan, Golub, LeVeque 1979.
class Welford {
 public:
  void add(double value) noexcept;

  /// As if the values of `other` had been added here.
  void merge(const Welford& other) noexcept;

  std::size_t count() const noexcept { return count_; }

  /// Mean of the values; NaN when there is none.
  double mean() const noexcept;

  /// Unbiased variance (divisor n-1); empty for fewer than two values.
  std::optional<double> variance() const noexcept;

  /// Standard error of the mean, sqrt(variance / n); empty for fewer than two values.
  std::optional<double> standard_error() const noexcept;

 private:
  std::size_t count_{0};
  double mean_{0};
  double sum_of_squares_{0};  // of deviations from the mean
};

/// The middle value, of an even number the upper of the two. @param values  not empty
double median(std::vector<double> values);

/// Quantile of Student's t.
/// @param probability         in (0, 1)
/// @param degrees_of_freedom  > 0, not necessarily whole
double student_t_quantile(double probability, double degrees_of_freedom);

/// P(|t'| >= |t|) under Student's t; NaN for NaN, 0 for an infinite t.
double student_t_two_sided_p(double t, double degrees_of_freedom);

struct Interval {
  double lo{0};
  double hi{0};
};

/// Two-sided t interval of a mean over blocks.
/// @param floor  standard error that all blocks share, added in quadrature; 0 for none
/// @return empty for fewer than two values
std::optional<Interval> mean_interval(const Welford& blocks, double confidence, double floor = 0);

/// Two-sided p of "the mean is 0" over blocks, with a shared standard error in quadrature. Degrees
/// of freedom by Welch and Satterthwaite, the shared part counted as known exactly.
/// @return empty for fewer than two values, or when nothing varies: then there is no scale to test
/// on
std::optional<double> zero_mean_p(const Welford& blocks, double floor = 0);

/// Location by Hodges and Lehmann: the median of the means of all pairs i <= j. For times; errors
/// take the plain mean. O(n^2) memory.
/// @param values  not empty; NaN is returned when one is not finite
/// Source: Hodges, Lehmann 1963, "Estimates of Location Based on Rank Tests".
double hodges_lehmann(std::span<const double> values);

/// Cost (seconds, rays or instructions) and squared error of one method in one block.
struct CostError {
  double cost{0};
  double error{0};
};

/// A method and its baseline, measured in the same block.
struct PairedCostError {
  CostError method;
  CostError baseline;
};

/// Why there is no efficiency.
enum class NoEstimate {
  None,                 ///< there is one
  NoBlocks,             ///< not one block
  NonFinite,            ///< a cost or an error is NaN or infinite
  NonPositiveCost,      ///< a mean cost is not positive
  BelowReferenceNoise,  ///< a mean error, of all blocks or of all but one, is not positive
};

/// One clause for a report; empty for None.
std::string_view reason_text(NoEstimate reason) noexcept;

/// A natural logarithm with its interval. One block gives a value only.
struct LogEstimate {
  double value{0};
  std::optional<double> standard_error;
  std::optional<Interval> interval;
};

/// Either `log` or a reason other than None.
struct EfficiencyEstimate {
  std::optional<LogEstimate> log;
  NoEstimate reason{NoEstimate::None};
};

struct JackknifeOptions {
  double confidence{0.95};
  double reference_floor{
      0};  ///< u_ref of the errors (metrics.h, ReferenceNoise::floor), in their unit
};

/// log Eff = -log(mean cost) - log(mean error): a ratio of means, not a mean of ratios. Standard
/// error by the jackknife over blocks, which takes in the covariance of cost and error; interval
/// with t_{R-1}. The reference's floor enters in quadrature as u_ref / mean error.
EfficiencyEstimate log_efficiency(std::span<const CostError> blocks,
                                  const JackknifeOptions& options = {});

/// log(Eff_method / Eff_baseline), likewise over paired blocks. Both errors contain the same
/// reference error, so to first order the floor enters as u_ref |1/mean error_m - 1/mean error_b|:
/// it cancels between equal errors.
EfficiencyEstimate log_efficiency_ratio(std::span<const PairedCostError> blocks,
                                        const JackknifeOptions& options = {});

/// Smallest relative difference of two efficiencies that R blocks show with power 0.8 in a
/// two-sided test at 5 %: exp((t_{0.975,R-1} + t_{0.8,R-1}) SE) - 1, so that 0.05 is 5 %.
/// @param log_ratio_se  standard error of the log ratio of efficiencies
/// @return empty for fewer than two blocks
std::optional<double> detectable_effect(double log_ratio_se, std::int64_t blocks);

/// The same, foreseen from what is known before a measurement. The relative variance of an MSE is
/// 2 / P_eff (metrics.h); errors of the two methods are independent, times are paired.
/// @param p_eff_a, p_eff_b  > 0, effective pixels of one run of each
/// @param time_sd           standard deviation of the log ratio of two CPU times in one block
std::optional<double> detectable_effect(double p_eff_a, double p_eff_b, double time_sd,
                                        std::int64_t blocks);

/// Holm's step-down adjustment: reject hypothesis i at family-wise level alpha iff result[i] <=
/// alpha.
/// @param p  p values in [0, 1]
/// @return adjusted p values, same order
/// Source: Holm 1979, "A Simple Sequentially Rejective Multiple Test Procedure".
std::vector<double> holm_adjusted(std::span<const double> p);

/// Pilot runs at one number of samples.
struct PilotLevel {
  double samples{0};
  std::span<const double> times_s;  ///< CPU time of each run [s]
};

/// T(n) = fixed_s + per_sample_s n.
struct TimeFit {
  double fixed_s{0};
  double per_sample_s{0};
  bool fixed_set_aside{false};  ///< the fixed part came out negative, see fit_time
};

/// Fits the line through the Hodges-Lehmann locations of two levels. A negative fixed part has no
/// meaning (noise): it is set aside as 0, with the flag, and the slope is that from the origin to
/// the higher level, whose relative error is the smaller one.
/// @param low, high  0 < low.samples < high.samples, at least one run each
/// @return empty when the slope is not positive and finite: the levels are too close for the noise
/// Source: statistics.md 3.4.
std::optional<TimeFit> fit_time(const PilotLevel& low, const PilotLevel& high);

/// The largest whole n with T(n) <= budget.
/// @return empty when the budget does not pay for one sample
std::optional<std::int64_t> samples_for_time(const TimeFit& fit, double budget_s);

}  // namespace penumbra
