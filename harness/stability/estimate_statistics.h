#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "harness/statistics.h"

/// Statistics of many estimates of one number, and a test of their mean that heavy tails do not
/// fool. Numbers only; estimates are relative to the exact value, so that 1 is right.
namespace penumbra::stability {

/// How many times the largest estimate seen an unseen one may be (see EstimateStatistics::test).
inline constexpr double kUnseenFactor = 4;

/// What a test of "the mean is 1" found.
struct MeanTest {
  double t{0};  ///< standard errors beyond the tolerance; 0 within it
  double p{1};  ///< two-sided
};

/// Moments of estimates in one pass. Source: Pebay 2008, "Formulas for robust, one-pass parallel
/// computation of covariances and arbitrary-order statistical moments".
class EstimateStatistics {
 public:
  /// @param value  finite; not negative but for estimators that may be
  void add(double value) noexcept;

  std::uint64_t count() const noexcept { return count_; }
  std::uint64_t zeros() const noexcept { return zeros_; }
  double mean() const noexcept { return mean_; }
  double largest() const noexcept { return largest_; }
  /// Of the estimates, divisor n - 1; 0 for fewer than two.
  double variance() const noexcept;
  /// Fourth central moment over the squared variance, 3 for a normal distribution; empty where
  /// nothing varies. Never more than n: what a sample of n shows of heavy tails ends there.
  std::optional<double> kurtosis() const noexcept;
  /// Mean of (value - 1)^2, and its standard error.
  double mean_square_error() const noexcept;
  double mean_square_error_se() const noexcept;
  /// Relative standard error of the variance, by the kurtosis: 1 or so where a single estimate
  /// decides.
  double variance_uncertainty() const noexcept;

  /// Exponent of the upper tail, P(X > x) ~ x^-index, from the largest hundred or so of the
  /// estimates; infinite where they are all the same, 0 where too few are positive. A mean exists
  /// for indices above 1 only. Source: Hill 1975, "A simple general approach to inference about the
  /// tail of a distribution".
  double tail_index() const noexcept;

  /// Whether the tail lets a sample say anything of its mean: the index is above 1 by two standard
  /// errors. Area sampling of a light nearer and nearer has an index of 1/2 up to values that no
  /// sample reaches.
  bool has_mean() const noexcept;

  /// Variance to use where estimates of a tile depend on each other; the larger one counts.
  void set_variance_of_tiles(double variance) noexcept { variance_of_tiles_ = variance; }

  /// Tests "the mean is 1".
  ///
  /// A plain t test calls estimators biased that see their light rarely: a mean below 1 comes with
  /// a variance that is too small, because the estimates that would raise both were not among those
  /// seen. No test can tell a bias from an event that is rare and large enough. So the deficit d is
  /// held against the variance that was seen and that of an event which would explain it: an
  /// estimate of kUnseenFactor times the largest one seen, M, with the probability d/M and thus the
  /// variance d M. For a surplus the event is an estimate of 0.
  ///   t = d sqrt(n) / sqrt(s^2 + d M)
  /// For bounded estimates that is Bernstein's inequality; d is significant only where such events
  /// would have been seen. Where every estimate is 0, or the tail has no mean (`has_mean`), a
  /// deficit says nothing and t is 0.
  /// @param tolerance  deviation of the mean that counts as none
  MeanTest test(double tolerance) const noexcept;

  /// Where the mean lies: all values that `test` would not reject at this confidence. The upper end
  /// is infinite where every estimate is 0 or the tail has no mean.
  Interval mean_interval(double confidence) const noexcept;

 private:
  static constexpr std::size_t kTail = 129;

  void keep_largest(double value) noexcept;
  /// Number of largest estimates that the index is worked out from.
  std::size_t tail_count() const noexcept;

  /// Variance of a mean times n.
  double spread() const noexcept;
  double unseen_above() const noexcept { return kUnseenFactor * largest_; }

  std::uint64_t count_{0}, zeros_{0};
  double mean_{0}, m2_{0}, m3_{0}, m4_{0};
  double largest_{0};
  double square_sum_{0}, fourth_sum_{0};  // of deviations from 1
  double variance_of_tiles_{0};
  std::array<double, kTail>
      tail_{};  // the largest positive estimates, a heap with the least on top
  std::size_t tail_size_{0};
};

/// Mean square errors at several numbers of samples: log error = a + b log samples by least
/// squares, weighted by their own errors.
struct SlopePoint {
  double samples{0};
  double error{0};
  double error_se{0};
};
struct Slope {
  double value{0};
  Interval interval;  ///< of the confidence asked for, normal
};
/// @return empty for fewer than two points, or where an error or its standard error is 0
std::optional<Slope> fit_error_slope(const SlopePoint* points, std::size_t count,
                                     double confidence);

}  // namespace penumbra::stability
