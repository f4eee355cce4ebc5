#include "harness/statistics.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <numeric>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

/// Mean of every block but `skip`; the number of blocks skips none.
PairedCostError mean_without(std::span<const PairedCostError> blocks, std::size_t skip) {
  PairedCostError sum;
  double n = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (i == skip) continue;
    sum.method.cost += blocks[i].method.cost;
    sum.method.error += blocks[i].method.error;
    sum.baseline.cost += blocks[i].baseline.cost;
    sum.baseline.error += blocks[i].baseline.error;
    n += 1;
  }
  return {{sum.method.cost / n, sum.method.error / n},
          {sum.baseline.cost / n, sum.baseline.error / n}};
}

NoEstimate fault_of(const PairedCostError& mean) {
  for (const CostError& side : {mean.method, mean.baseline}) {
    if (!std::isfinite(side.cost) || !std::isfinite(side.error)) return NoEstimate::NonFinite;
    if (side.cost <= 0) return NoEstimate::NonPositiveCost;
    if (side.error <= 0) return NoEstimate::BelowReferenceNoise;
  }
  return NoEstimate::None;
}

double log_ratio(const PairedCostError& mean) {
  return std::log(mean.baseline.cost) + std::log(mean.baseline.error) - std::log(mean.method.cost) -
         std::log(mean.method.error);
}

/// @param mean            of all blocks, without fault
/// @param relative_floor  in quadrature, of the means over all blocks
EfficiencyEstimate jackknife(std::span<const PairedCostError> blocks, const PairedCostError& mean,
                             double confidence, double relative_floor) {
  LogEstimate estimate{log_ratio(mean), std::nullopt, std::nullopt};
  if (blocks.size() < 2) return {estimate, NoEstimate::None};
  Welford without;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const PairedCostError rest = mean_without(blocks, i);
    if (const NoEstimate fault = fault_of(rest); fault != NoEstimate::None) {
      return {std::nullopt, fault};
    }
    without.add(log_ratio(rest));
  }
  // (R-1)/R times the sum of squares of the R leave-one-out values, = (R-1)^2/R times their
  // variance.
  const double n = static_cast<double>(blocks.size());
  const double variance = (n - 1) * (n - 1) / n * without.variance().value();
  const double standard_error = std::sqrt(variance + relative_floor * relative_floor);
  const double half_width = student_t_quantile(0.5 + 0.5 * confidence, n - 1) * standard_error;
  estimate.standard_error = standard_error;
  estimate.interval = Interval{estimate.value - half_width, estimate.value + half_width};
  return {estimate, NoEstimate::None};
}

}  // namespace

void Welford::add(double value) noexcept {
  ++count_;
  const double difference = value - mean_;
  mean_ += difference / static_cast<double>(count_);
  sum_of_squares_ += difference * (value - mean_);
}

void Welford::merge(const Welford& other) noexcept {
  if (other.count_ == 0) return;
  if (count_ == 0) {
    *this = other;
    return;
  }
  const double n = static_cast<double>(count_);
  const double m = static_cast<double>(other.count_);
  const double difference = other.mean_ - mean_;
  mean_ += difference * (m / (n + m));
  sum_of_squares_ += other.sum_of_squares_ + difference * difference * (n * m / (n + m));
  count_ += other.count_;
}

double Welford::mean() const noexcept {
  return count_ == 0 ? std::numeric_limits<double>::quiet_NaN() : mean_;
}

std::optional<double> Welford::variance() const noexcept {
  if (count_ < 2) return std::nullopt;
  return sum_of_squares_ / static_cast<double>(count_ - 1);
}

std::optional<double> Welford::standard_error() const noexcept {
  const std::optional<double> spread = variance();
  if (!spread) return std::nullopt;
  return std::sqrt(*spread / static_cast<double>(count_));
}

double student_t_quantile(double probability, double degrees_of_freedom) {
  PN_CHECK(probability > 0 && probability < 1, "a quantile is of a probability in (0, 1)");
  PN_CHECK(degrees_of_freedom > 0, "Student's t has positive degrees of freedom");
  return boost::math::quantile(boost::math::students_t(degrees_of_freedom), probability);
}

double student_t_two_sided_p(double t, double degrees_of_freedom) {
  PN_CHECK(degrees_of_freedom > 0, "Student's t has positive degrees of freedom");
  if (std::isnan(t)) return t;
  if (std::isinf(t)) return 0;
  const boost::math::students_t distribution(degrees_of_freedom);
  return 2 * boost::math::cdf(boost::math::complement(distribution, std::abs(t)));
}

std::optional<Interval> mean_interval(const Welford& blocks, double confidence, double floor) {
  const std::optional<double> block_error = blocks.standard_error();
  if (!block_error) return std::nullopt;
  const double dof = static_cast<double>(blocks.count() - 1);
  const double half_width =
      student_t_quantile(0.5 + 0.5 * confidence, dof) * std::hypot(*block_error, floor);
  return Interval{blocks.mean() - half_width, blocks.mean() + half_width};
}

std::optional<double> zero_mean_p(const Welford& blocks, double floor) {
  const std::optional<double> block_error = blocks.standard_error();
  if (!block_error || *block_error == 0) return std::nullopt;
  const double standard_error = std::hypot(*block_error, floor);
  const double ratio = standard_error / *block_error;
  const double dof = static_cast<double>(blocks.count() - 1) * std::pow(ratio, 4);
  return student_t_two_sided_p(blocks.mean() / standard_error, dof);
}

double hodges_lehmann(std::span<const double> values) {
  PN_CHECK(!values.empty(), "a location needs at least one value");
  std::vector<double> means;
  means.reserve(values.size() * (values.size() + 1) / 2);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) return std::numeric_limits<double>::quiet_NaN();
    for (std::size_t j = i; j < values.size(); ++j) means.push_back(0.5 * (values[i] + values[j]));
  }
  const auto middle = means.begin() + static_cast<std::ptrdiff_t>(means.size() / 2);
  std::nth_element(means.begin(), middle, means.end());
  if (means.size() % 2 == 1) return *middle;
  return 0.5 * (*std::max_element(means.begin(), middle) + *middle);
}

std::string_view reason_text(NoEstimate reason) noexcept {
  switch (reason) {
    case NoEstimate::None:
      return "";
    case NoEstimate::NoBlocks:
      return "no common blocks";
    case NoEstimate::NonFinite:
      return "a cost or an error is not finite";
    case NoEstimate::NonPositiveCost:
      return "a cost is not positive";
    case NoEstimate::BelowReferenceNoise:
      return "below reference noise";
  }
  return "";
}

EfficiencyEstimate log_efficiency(std::span<const CostError> blocks,
                                  const JackknifeOptions& options) {
  if (blocks.empty()) return {std::nullopt, NoEstimate::NoBlocks};
  // Against a constant baseline of 1, whose logarithm is exactly 0.
  std::vector<PairedCostError> paired;
  paired.reserve(blocks.size());
  for (const CostError& block : blocks) paired.push_back({block, {1, 1}});
  const PairedCostError mean = mean_without(paired, paired.size());
  if (const NoEstimate fault = fault_of(mean); fault != NoEstimate::None) {
    return {std::nullopt, fault};
  }
  return jackknife(paired, mean, options.confidence, options.reference_floor / mean.method.error);
}

EfficiencyEstimate log_efficiency_ratio(std::span<const PairedCostError> blocks,
                                        const JackknifeOptions& options) {
  if (blocks.empty()) return {std::nullopt, NoEstimate::NoBlocks};
  const PairedCostError mean = mean_without(blocks, blocks.size());
  if (const NoEstimate fault = fault_of(mean); fault != NoEstimate::None) {
    return {std::nullopt, fault};
  }
  const double relative_floor =
      options.reference_floor * std::abs(1 / mean.method.error - 1 / mean.baseline.error);
  return jackknife(blocks, mean, options.confidence, relative_floor);
}

std::optional<double> detectable_effect(double log_ratio_se, std::int64_t blocks) {
  if (blocks < 2) return std::nullopt;
  const double dof = static_cast<double>(blocks - 1);
  const double distance = student_t_quantile(0.975, dof) + student_t_quantile(0.8, dof);
  return std::expm1(distance * log_ratio_se);
}

std::optional<double> detectable_effect(double p_eff_a, double p_eff_b, double time_sd,
                                        std::int64_t blocks) {
  PN_CHECK(p_eff_a > 0 && p_eff_b > 0, "an error rests on a positive number of pixels");
  if (blocks < 2) return std::nullopt;
  const double variance = 2 / p_eff_a + 2 / p_eff_b + time_sd * time_sd;
  return detectable_effect(std::sqrt(variance / static_cast<double>(blocks)), blocks);
}

double median(std::vector<double> values) {
  PN_CHECK(!values.empty(), "there is no middle of nothing");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<double> holm_adjusted(std::span<const double> p) {
  for (const double value : p) PN_CHECK(value >= 0 && value <= 1, "a p value lies in [0, 1]");
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return p[i] < p[j]; });
  std::vector<double> adjusted(p.size());
  double largest = 0;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    const double scaled = static_cast<double>(p.size() - rank) * p[order[rank]];
    largest = std::max(largest, std::min(1.0, scaled));
    adjusted[order[rank]] = largest;
  }
  return adjusted;
}

std::optional<TimeFit> fit_time(const PilotLevel& low, const PilotLevel& high) {
  PN_CHECK(low.samples > 0 && low.samples < high.samples,
           "pilot levels must increase from above 0");
  const double time_low = hodges_lehmann(low.times_s);
  const double time_high = hodges_lehmann(high.times_s);
  const double slope = (time_high - time_low) / (high.samples - low.samples);
  if (!(slope > 0) || !std::isfinite(slope)) return std::nullopt;
  const double fixed = time_low - slope * low.samples;
  if (fixed < 0) return TimeFit{0, time_high / high.samples, true};
  return TimeFit{fixed, slope, false};
}

std::optional<std::int64_t> samples_for_time(const TimeFit& fit, double budget_s) {
  PN_CHECK(fit.per_sample_s > 0, "a fit has a positive time per sample");
  const double samples = std::floor((budget_s - fit.fixed_s) / fit.per_sample_s);
  if (!(samples >= 1) || samples >= 9e18) return std::nullopt;
  return static_cast<std::int64_t>(samples);
}

}  // namespace penumbra
