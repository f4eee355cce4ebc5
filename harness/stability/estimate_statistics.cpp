#include "harness/stability/estimate_statistics.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace penumbra::stability {
namespace {

/// Share of the estimates that count as tail, and the least number of them.
constexpr std::size_t kTailShare = 8;
constexpr std::size_t kLeastTail = 8;

/// Quantile for both sides together.
double quantile_of(double confidence, double degrees_of_freedom) {
  return student_t_quantile(0.5 + 0.5 * confidence, degrees_of_freedom);
}

}  // namespace

void EstimateStatistics::add(double value) noexcept {
  const auto before = static_cast<double>(count_);
  const double n = before + 1;
  const double delta = value - mean_;
  const double step = delta / n;
  const double step2 = step * step;
  const double term = delta * step * before;
  mean_ += step;
  m4_ += term * step2 * (n * n - 3 * n + 3) + 6 * step2 * m2_ - 4 * step * m3_;
  m3_ += term * step * (n - 2) - 3 * step * m2_;
  m2_ += term;
  ++count_;
  zeros_ += value == 0 ? 1u : 0u;
  largest_ = std::max(largest_, value);
  keep_largest(value);
  const double square = (value - 1) * (value - 1);
  square_sum_ += square;
  fourth_sum_ += square * square;
}

void EstimateStatistics::keep_largest(double value) noexcept {
  if (!(value > 0)) return;
  const auto begin = tail_.begin();
  if (tail_size_ == kTail) {
    if (value <= tail_[0]) return;
    std::pop_heap(begin, tail_.end(), std::greater<>());
    --tail_size_;
  }
  tail_[tail_size_++] = value;
  std::push_heap(begin, begin + static_cast<std::ptrdiff_t>(tail_size_), std::greater<>());
}

std::size_t EstimateStatistics::tail_count() const noexcept {
  if (tail_size_ < 2) return 0;
  return std::min(tail_size_ - 1, static_cast<std::size_t>(count_) / kTailShare);
}

double EstimateStatistics::tail_index() const noexcept {
  const std::size_t k = tail_count();
  if (k < kLeastTail) return 0;
  std::array<double, kTail> sorted = tail_;
  std::sort(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(tail_size_),
            std::greater<>());
  double sum = 0;
  for (std::size_t i = 0; i < k; ++i) sum += std::log(sorted[i] / sorted[k]);
  return sum > 0 ? static_cast<double>(k) / sum : std::numeric_limits<double>::infinity();
}

bool EstimateStatistics::has_mean() const noexcept {
  const auto k = static_cast<double>(tail_count());
  // The standard error of the index is its size over sqrt(k).
  return k > 0 && tail_index() * (1 - 2 / std::sqrt(k)) > 1;
}

double EstimateStatistics::variance() const noexcept {
  return count_ < 2 ? 0 : m2_ / static_cast<double>(count_ - 1);
}

std::optional<double> EstimateStatistics::kurtosis() const noexcept {
  if (!(m2_ > 0)) return std::nullopt;
  return static_cast<double>(count_) * m4_ / (m2_ * m2_);
}

double EstimateStatistics::mean_square_error() const noexcept {
  return square_sum_ / static_cast<double>(count_);
}

double EstimateStatistics::mean_square_error_se() const noexcept {
  const auto n = static_cast<double>(count_);
  const double mean = square_sum_ / n;
  return std::sqrt(std::max(0.0, fourth_sum_ / n - mean * mean) / n);
}

double EstimateStatistics::variance_uncertainty() const noexcept {
  const auto found = kurtosis();
  return found ? std::sqrt(std::max(0.0, *found - 1) / static_cast<double>(count_)) : 0;
}

double EstimateStatistics::spread() const noexcept {
  return std::max(variance(), variance_of_tiles_);
}

MeanTest EstimateStatistics::test(double tolerance) const noexcept {
  const double deviation = std::abs(mean_ - 1) - tolerance;
  if (count_ < 2 || !(largest_ > 0) || !(deviation > 0)) return {};
  if (mean_ < 1 && !has_mean()) return {};
  const auto n = static_cast<double>(count_);
  const double unseen = mean_ < 1 ? unseen_above() : mean_;
  const double t = deviation * std::sqrt(n / (spread() + deviation * unseen));
  return {t, student_t_two_sided_p(t, n - 1)};
}

Interval EstimateStatistics::mean_interval(double confidence) const noexcept {
  const double infinity = std::numeric_limits<double>::infinity();
  if (count_ < 2 || !(largest_ > 0)) return {0, infinity};
  const auto n = static_cast<double>(count_);
  const double q = quantile_of(confidence, n - 1);
  // d^2 n = q^2 (s^2 + d M), solved for d.
  const auto reach = [&](double unseen) {
    const double half = 0.5 * q * q * unseen;
    return (half + std::sqrt(half * half + n * q * q * spread())) / n;
  };
  return {std::max(0.0, mean_ - reach(mean_)),
          has_mean() ? mean_ + reach(unseen_above()) : infinity};
}

std::optional<Slope> fit_error_slope(const SlopePoint* points, std::size_t count,
                                     double confidence) {
  double weights = 0;
  double x_mean = 0;
  double y_mean = 0;
  if (count < 2) return std::nullopt;
  for (std::size_t i = 0; i < count; ++i) {
    const SlopePoint& p = points[i];
    if (!(p.error > 0 && p.error_se > 0)) return std::nullopt;
    const double weight = p.error * p.error / (p.error_se * p.error_se);
    weights += weight;
    x_mean += weight * std::log(p.samples);
    y_mean += weight * std::log(p.error);
  }
  x_mean /= weights;
  y_mean /= weights;
  double xx = 0;
  double xy = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const SlopePoint& p = points[i];
    const double weight = p.error * p.error / (p.error_se * p.error_se);
    const double x = std::log(p.samples) - x_mean;
    xx += weight * x * x;
    xy += weight * x * (std::log(p.error) - y_mean);
  }
  if (!(xx > 0)) return std::nullopt;
  const double half = quantile_of(confidence, 1e6) / std::sqrt(xx);
  return Slope{xy / xx, {xy / xx - half, xy / xx + half}};
}

}  // namespace penumbra::stability
