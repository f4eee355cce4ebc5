#include "harness/curve_fit.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr std::size_t kLeastForInterpolation = 3;
constexpr int kReweightings = 20;

double mean_without(const std::vector<double>& values, std::size_t skip) {
  Welford mean;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i != skip) mean.add(values[i]);
  }
  return mean.mean();
}

bool are_positive(std::span<const CurvePoint> points) {
  return std::all_of(points.begin(), points.end(), [](const CurvePoint& p) {
    return p.time_s > 0 && p.error > 0 && std::isfinite(p.time_s) && std::isfinite(p.error);
  });
}

bool are_in_order(std::span<const CurvePoint> points) {
  return std::is_sorted(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a.time_s <= b.time_s;  // equal times are out of order, too
  });
}

/// Coefficients c of slope = sum c_k log e_k. @return empty where all times are equal
std::vector<double> slope_coefficients(std::span<const CurvePoint> points) {
  Welford log_times;
  for (const CurvePoint& p : points) log_times.add(std::log(p.time_s));
  const double spread = static_cast<double>(points.size() - 1) * log_times.variance().value_or(0);
  std::vector<double> coefficients;
  if (!(spread > 0)) return coefficients;
  for (const CurvePoint& p : points) {
    coefficients.push_back((std::log(p.time_s) - log_times.mean()) / spread);
  }
  return coefficients;
}

std::optional<double> slope_of(std::span<const CurvePoint> points) {
  if (points.size() < 2 || !are_positive(points)) return std::nullopt;
  const std::vector<double> coefficients = slope_coefficients(points);
  if (coefficients.empty()) return std::nullopt;
  double slope = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    slope += coefficients[k] * std::log(points[k].error);
  }
  return slope;
}

struct Line {
  double a{0}, square{0};
};

/// Fits error = a / time + square with weights 1 / fitted error squared.
std::optional<Line> floor_line(std::span<const CurvePoint> points) {
  std::vector<double> fitted;
  for (const CurvePoint& p : points) fitted.push_back(p.error);
  Line line;
  for (int round = 0; round < kReweightings; ++round) {
    double w = 0, wu = 0, wuu = 0, we = 0, wue = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double u = 1 / points[k].time_s;
      const double weight = 1 / (fitted[k] * fitted[k]);
      w += weight;
      wu += weight * u;
      wuu += weight * u * u;
      we += weight * points[k].error;
      wue += weight * u * points[k].error;
    }
    const double determinant = w * wuu - wu * wu;
    if (!(determinant > 1e-12 * w * wuu)) return std::nullopt;
    line = {(w * wue - wu * we) / determinant, (wuu * we - wu * wue) / determinant};
    for (std::size_t k = 0; k < points.size(); ++k) {
      // A fitted error that is not positive has no relative variance; the measured one has.
      const double value = line.a / points[k].time_s + line.square;
      fitted[k] = value > 0 ? value : std::abs(points[k].error);
      if (!(fitted[k] > 0)) return std::nullopt;
    }
  }
  return line;
}

/// Jackknife of a statistic over blocks.
/// @param value  (block to leave out, or `blocks` for none) -> the statistic, or nothing
/// @param more   standard error that blocks do not show, in quadrature
template <class Statistic>
std::optional<FitEstimate> jackknife(std::size_t blocks, double confidence, double more,
                                     const Statistic& value) {
  const std::optional<double> all = value(blocks);
  if (!all) return std::nullopt;
  FitEstimate estimate{*all, {}, {}};
  if (blocks < 2) return estimate;
  Welford without;
  for (std::size_t b = 0; b < blocks; ++b) {
    const std::optional<double> rest = value(b);
    if (!rest) return std::nullopt;
    without.add(*rest);
  }
  const double n = static_cast<double>(blocks);
  const double variance = (n - 1) * (n - 1) / n * without.variance().value();
  estimate.standard_error = std::sqrt(variance + more * more);
  const double half_width =
      student_t_quantile(0.5 + 0.5 * confidence, n - 1) * *estimate.standard_error;
  estimate.interval = Interval{*all - half_width, *all + half_width};
  return estimate;
}

/// Change of the slope by a shift of all errors, the reference's.
double slope_shift(std::span<const CurvePoint> points, double floor) {
  const std::vector<double> coefficients = slope_coefficients(points);
  double shift = 0;
  for (std::size_t k = 0; k < coefficients.size(); ++k) shift += coefficients[k] / points[k].error;
  return floor * std::abs(shift);
}

double interpolated(double x, double x0, double y0, double x1, double y1) {
  return y0 + (y1 - y0) * (x - x0) / (x1 - x0);
}

std::optional<double> log_time_to(const CurveData& data, double target, std::size_t skip) {
  const std::vector<CurvePoint> points = points_of(data, skip);
  const std::optional<double> slope = slope_of(points);
  if (!slope || !are_in_order(points)) return std::nullopt;
  const std::optional<double> time_s = time_to(points, target, *slope);
  return time_s ? std::optional(std::log(*time_s)) : std::nullopt;
}

}  // namespace

std::vector<CurvePoint> points_of(const CurveData& data, std::size_t skip) {
  std::vector<CurvePoint> points;
  for (const BudgetRuns& budget : data.budgets) {
    points.push_back({mean_without(budget.times_s, skip), mean_without(budget.errors, skip)});
  }
  return points;
}

std::optional<SlopeFit> fit_slope(const CurveData& data, double confidence) {
  const std::vector<CurvePoint> points = points_of(data, data.blocks());
  if (!slope_of(points)) return std::nullopt;
  const auto estimate =
      jackknife(data.blocks(), confidence, slope_shift(points, data.reference_floor),
                [&](std::size_t skip) { return slope_of(points_of(data, skip)); });
  if (!estimate) return std::nullopt;
  SlopeFit fit{*estimate, {}};
  if (estimate->standard_error && *estimate->standard_error > 0) {
    fit.p_minus_1 = student_t_two_sided_p((estimate->value + 1) / *estimate->standard_error,
                                          static_cast<double>(data.blocks() - 1));
  }
  return fit;
}

std::optional<FloorFit> fit_floor(const CurveData& data, double confidence) {
  if (data.budgets.size() < kLeastForInterpolation) return std::nullopt;
  const std::vector<CurvePoint> points = points_of(data, data.blocks());
  const std::optional<Line> line = floor_line(points);
  if (!line) return std::nullopt;
  // A shift of all errors is a shift of b^2.
  const auto square = jackknife(data.blocks(), confidence, data.reference_floor,
                                [&](std::size_t skip) -> std::optional<double> {
                                  const std::optional<Line> rest =
                                      floor_line(points_of(data, skip));
                                  return rest ? std::optional(rest->square) : std::nullopt;
                                });
  if (!square) return std::nullopt;
  FloorFit fit{line->a, *square, 0, {}};
  if (!square->interval) {
    fit.floor = std::sqrt(std::max(0.0, square->value));
    return fit;
  }
  const double half_width = square->interval->hi - square->value;
  if (square->interval->lo > 0) fit.floor = std::sqrt(square->value);
  fit.interval = Interval{std::sqrt(std::max(0.0, square->interval->lo)),
                          std::sqrt(std::max(0.0, square->value) + half_width)};
  return fit;
}

std::optional<double> error_at(std::span<const CurvePoint> points, double time_s, double slope) {
  PN_CHECK(!points.empty(), "a curve has a point");
  const CurvePoint& first = points.front();
  const CurvePoint& last = points.back();
  if (!(time_s * kMaxExtrapolation >= first.time_s) ||
      !(time_s <= kMaxExtrapolation * last.time_s)) {
    return std::nullopt;
  }
  if (time_s <= first.time_s) return first.error * std::pow(time_s / first.time_s, slope);
  for (std::size_t k = 1; k < points.size(); ++k) {
    if (time_s > points[k].time_s) continue;
    return std::exp(interpolated(std::log(time_s), std::log(points[k - 1].time_s),
                                 std::log(points[k - 1].error), std::log(points[k].time_s),
                                 std::log(points[k].error)));
  }
  return last.error * std::pow(time_s / last.time_s, slope);
}

std::optional<double> time_to(std::span<const CurvePoint> points, double target, double slope) {
  PN_CHECK(!points.empty() && target > 0, "a curve has a point, a target is positive");
  const auto beyond = [&](const CurvePoint& end) -> std::optional<double> {
    if (!(slope < 0)) return std::nullopt;
    const double factor = std::pow(target / end.error, 1 / slope);
    if (factor > kMaxExtrapolation || factor * kMaxExtrapolation < 1) return std::nullopt;
    return end.time_s * factor;
  };
  if (points.front().error <= target) return beyond(points.front());
  for (std::size_t k = 1; k < points.size(); ++k) {
    if (points[k].error > target) continue;
    return std::exp(interpolated(std::log(target), std::log(points[k - 1].error),
                                 std::log(points[k - 1].time_s), std::log(points[k].error),
                                 std::log(points[k].time_s)));
  }
  return beyond(points.back());
}

std::optional<FitEstimate> fitted_error_at(const CurveData& data, double time_s,
                                           double confidence) {
  if (data.budgets.size() < kLeastForInterpolation) return std::nullopt;
  const auto log_error = [&](std::size_t skip) -> std::optional<double> {
    const std::vector<CurvePoint> points = points_of(data, skip);
    const std::optional<double> slope = slope_of(points);
    if (!slope || !are_in_order(points)) return std::nullopt;
    const std::optional<double> error = error_at(points, time_s, *slope);
    return error ? std::optional(std::log(*error)) : std::nullopt;
  };
  const std::optional<double> at = log_error(data.blocks());
  if (!at) return std::nullopt;
  auto estimate =
      jackknife(data.blocks(), confidence, data.reference_floor / std::exp(*at), log_error);
  if (!estimate) return std::nullopt;
  estimate->value = std::exp(estimate->value);
  if (estimate->interval) {
    estimate->interval = {std::exp(estimate->interval->lo), std::exp(estimate->interval->hi)};
  }
  return estimate;
}

std::optional<TargetFit> fit_target(const CurveData& method, const CurveData& baseline,
                                    double confidence) {
  if (std::min(method.budgets.size(), baseline.budgets.size()) < kLeastForInterpolation) {
    return std::nullopt;
  }
  PN_CHECK(method.blocks() == baseline.blocks(), "both curves are of the same blocks");
  const std::size_t blocks = method.blocks();
  const CurvePoint goal = points_of(baseline, blocks).back();
  if (!(goal.error > 0)) return std::nullopt;
  const auto log_time = [&](std::size_t skip) -> std::optional<double> {
    const CurvePoint end = points_of(baseline, skip).back();
    if (!(end.error > 0)) return std::nullopt;
    return log_time_to(method, end.error, skip);
  };
  const auto log_speedup = [&](std::size_t skip) -> std::optional<double> {
    const std::optional<double> own = log_time(skip);
    if (!own) return std::nullopt;
    return std::log(points_of(baseline, skip).back().time_s) - *own;
  };
  auto time_s = jackknife(blocks, confidence, 0, log_time);
  const auto speedup = jackknife(blocks, confidence, 0, log_speedup);
  if (!time_s || !speedup) return std::nullopt;
  time_s->value = std::exp(time_s->value);
  if (time_s->interval) {
    time_s->interval = {std::exp(time_s->interval->lo), std::exp(time_s->interval->hi)};
  }
  return TargetFit{goal.error, *time_s, *speedup};
}

}  // namespace penumbra
