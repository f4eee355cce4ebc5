#include "estimators/mdhi/reconstruction.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace penumbra::mdhi {
namespace {

constexpr std::size_t kFewestNeighbours = 3;
constexpr double kMostStretch = 4.0;
constexpr double kFlat = 1e-3;  // gradients below this share of the mean value count as none
constexpr std::size_t kSmallestGrid = 16;
// A fixed grid would keep an error of its own however many samples there are.
constexpr std::size_t kCellsPerSample = 4;
// Smallest determinant over squared trace at which neighbours do not lie on a line.
constexpr double kOnALine = 1e-10;

std::array<double, 2> difference(const Vec2& a, const Vec2& b) noexcept {
  return {static_cast<double>(a.x) - static_cast<double>(b.x),
          static_cast<double>(a.y) - static_cast<double>(b.y)};
}

}  // namespace

AnisotropicCells::AnisotropicCells(std::size_t max_samples)
    : neighbours_(max_samples), gradients_(max_samples), metrics_(max_samples) {}

void AnisotropicCells::shares(std::span<const Vec2> positions, std::span<const double> values,
                              std::span<double> shares) noexcept {
  const std::size_t n = positions.size();
  const std::size_t count = std::min(kNeighbours, n - 1);
  double mean = 0.0;
  for (const double value : values) mean += value;
  mean /= static_cast<double>(n);
  const bool has_metric = count >= kFewestNeighbours && mean > 0.0;
  if (has_metric) {
    find_neighbours(positions, count);
    fit_gradients(positions, values, count);
  }
  const double floor = kFlat * mean * kFlat * mean;
  for (std::size_t i = 0; i < n; ++i) {
    metrics_[i] = has_metric ? metric(i, count, floor) : Tensor{1.0, 0.0, 1.0};
  }

  std::fill(shares.begin(), shares.end(), 0.0);
  std::size_t side = kSmallestGrid;
  while (side * side < kCellsPerSample * n) ++side;
  const double cell = 1.0 / static_cast<double>(side);
  for (std::size_t row = 0; row < side; ++row) {
    for (std::size_t column = 0; column < side; ++column) {
      const double x = (static_cast<double>(column) + 0.5) * cell;
      const double y = (static_cast<double>(row) + 0.5) * cell;
      shares[nearest(positions, x, y)] += cell * cell;
    }
  }
}

// The sample whose metric makes a place nearest; the first of equals.
std::size_t AnisotropicCells::nearest(std::span<const Vec2> positions, double x,
                                      double y) const noexcept {
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double dx = x - static_cast<double>(positions[i].x);
    const double dy = y - static_cast<double>(positions[i].y);
    const Tensor& m = metrics_[i];
    const double distance2 = m.xx * dx * dx + 2.0 * m.xy * dx * dy + m.yy * dy * dy;
    if (distance2 < least) {
      least = distance2;
      nearest = i;
    }
  }
  return nearest;
}

void AnisotropicCells::find_neighbours(std::span<const Vec2> positions,
                                       std::size_t count) noexcept {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    std::array<float, kNeighbours> distances{};
    std::size_t found = 0;
    for (std::size_t j = 0; j < positions.size(); ++j) {
      if (j == i) continue;
      const float distance = (positions[j] - positions[i]).length2();
      if (found == count && distance >= distances[found - 1]) continue;
      std::size_t place = found < count ? found++ : count - 1;
      for (; place > 0 && distances[place - 1] > distance; --place) {
        distances[place] = distances[place - 1];
        neighbours_[i][place] = neighbours_[i][place - 1];
      }
      distances[place] = distance;
      neighbours_[i][place] = static_cast<std::uint32_t>(j);
    }
  }
}

// Least squares through the sample itself: the normal equations of v_j - v_i = grad . (u_j - u_i).
void AnisotropicCells::fit_gradients(std::span<const Vec2> positions,
                                     std::span<const double> values, std::size_t count) noexcept {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    double xx = 0.0, xy = 0.0, yy = 0.0, xv = 0.0, yv = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t j = neighbours_[i][k];
      const auto [dx, dy] = difference(positions[j], positions[i]);
      const double dv = values[j] - values[i];
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
      xv += dx * dv;
      yv += dy * dv;
    }
    const double determinant = xx * yy - xy * xy;
    const double trace = xx + yy;
    gradients_[i] = {0.0, 0.0};
    if (!(determinant > kOnALine * trace * trace)) continue;
    gradients_[i] = {(yy * xv - xy * yv) / determinant, (xx * yv - xy * xv) / determinant};
  }
}

AnisotropicCells::Tensor AnisotropicCells::metric(std::size_t sample, std::size_t count,
                                                  double floor) const noexcept {
  double xx = 0.0, xy = 0.0, yy = 0.0;
  const auto add = [&](const std::array<double, 2>& g) {
    xx += g[0] * g[0];
    xy += g[0] * g[1];
    yy += g[1] * g[1];
  };
  add(gradients_[sample]);
  for (std::size_t k = 0; k < count; ++k) add(gradients_[neighbours_[sample][k]]);
  const double scale = 1.0 / static_cast<double>(count + 1);
  const double middle = 0.5 * scale * (xx + yy);
  const double half = 0.5 * scale * (xx - yy);
  const double spread = std::sqrt(half * half + scale * xy * scale * xy);
  if (!(spread > 0.0)) return {1.0, 0.0, 1.0};
  // The smaller eigenvalue of a positive semidefinite matrix; rounding can make it negative.
  const double smaller = std::max(middle - spread, 0.0);
  const double r = std::min(kMostStretch, std::sqrt((middle + spread + floor) / (smaller + floor)));
  // a a^T = (1 + D/spread)/2 with D the traceless part of G.
  const double c = half / spread;
  const double s = scale * xy / spread;
  const double mean = 0.5 * (r + 1.0 / r);
  const double stretch = 0.5 * (r - 1.0 / r);
  return {mean + stretch * c, stretch * s, mean - stretch * c};
}

}  // namespace penumbra::mdhi
