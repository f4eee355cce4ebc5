#include "tests/support/statistics_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <string_view>

namespace penumbra::test {

std::uint64_t test_seed(std::uint64_t salt) {
  const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
  const std::string name =
      test == nullptr ? "no test" : std::string(test->test_suite_name()) + "." + test->name();
  std::uint64_t h = 14695981039346656037ULL;  // FNV-1a
  for (const char c : name) h = (h ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return h ^ (salt * 0x9e3779b97f4a7c15ULL);
}

Vec3 TestRandom::direction() {
  const double z = uniform(-1.0, 1.0);
  const double phi = uniform(0.0, 2.0 * std::numbers::pi);
  const double r = std::sqrt(1.0 - z * z);
  return Vec3(Vec3d(r * std::cos(phi), r * std::sin(phi), z));
}

double sidak(double family_level, int tests) {
  return -std::expm1(std::log1p(-family_level) / tests);
}

double z_bound(double level) {
  return boost::math::quantile(boost::math::complement(boost::math::normal(), 0.5 * level));
}

double chi_square_p(std::span<const double> observed, std::span<const double> expected,
                    double min_expected) {
  std::vector<std::size_t> order(expected.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });
  double statistic = 0.0;
  double pooled_observed = 0.0;
  double pooled_expected = 0.0;
  int bins = 0;
  const auto close_pool = [&] {
    const double difference = pooled_observed - pooled_expected;
    statistic += difference * difference / pooled_expected;
    pooled_observed = pooled_expected = 0.0;
    ++bins;
  };
  for (const std::size_t i : order) {
    if (!(expected[i] > 0.0)) {
      if (observed[i] > 0.0) return 0.0;
      continue;
    }
    pooled_observed += observed[i];
    pooled_expected += expected[i];
    if (pooled_expected >= min_expected) close_pool();
  }
  // What is left is less than one bin; on its own it would be too light for the approximation.
  if (pooled_expected > 0.0 && pooled_observed > 5.0 * min_expected) return 0.0;
  if (bins < 2) return 1.0;
  return boost::math::cdf(
      boost::math::complement(boost::math::chi_squared(static_cast<double>(bins - 1)), statistic));
}

double chi_square_uniform_p(std::span<const double> observed) {
  const double sum = std::accumulate(observed.begin(), observed.end(), 0.0);
  const std::vector<double> expected(observed.size(), sum / static_cast<double>(observed.size()));
  return chi_square_p(observed, expected);
}

void Moments::add(double x) {
  n_ += 1.0;
  const double delta = x - mean_;
  mean_ += delta / n_;
  sum2_ += delta * (x - mean_);
}

double Moments::standard_error() const { return std::sqrt(sum2_ / (n_ - 1.0) / n_); }

double Moments::z(double exact, double rounding) const {
  const double scale = standard_error() + rounding * std::abs(exact);
  const double error = std::abs(mean_ - exact);
  return error == 0.0 ? 0.0 : error / scale;
}

SphereGrid::SphereGrid(const Vec3& axis, std::vector<double> depth_edges, std::size_t sectors)
    : edges_(std::move(depth_edges)), sectors_(sectors) {
  z_ = Vec3d(axis).normalized();
  x_ = (std::abs(z_.x) < 0.5 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0)).cross(z_).normalized();
  y_ = z_.cross(x_);
}

SphereGrid SphereGrid::cap(const Vec3& axis, double depth, std::size_t rings, std::size_t sectors) {
  std::vector<double> edges;
  for (std::size_t i = 0; i <= rings; ++i) {
    edges.push_back(depth * static_cast<double>(i) / static_cast<double>(rings));
  }
  return SphereGrid(axis, std::move(edges), sectors);
}

std::size_t SphereGrid::bin(const Vec3& w) const {
  const Vec3d unit = Vec3d(w).normalized();
  const double depth = 0.5 * (unit - z_).length2();  // keeps its digits near the axis
  const auto above = std::upper_bound(edges_.begin(), edges_.end(), depth);
  if (above == edges_.begin() || above == edges_.end()) return size();
  const auto ring = static_cast<std::size_t>(above - edges_.begin()) - 1;
  const double phi = std::atan2(unit.dot(y_), unit.dot(x_)) / (2.0 * std::numbers::pi);
  const double turns = phi < 0.0 ? phi + 1.0 : phi;
  const auto sector = static_cast<std::size_t>(turns * static_cast<double>(sectors_));
  return ring * sectors_ + std::min(sector, sectors_ - 1);
}

std::vector<double> SphereGrid::integrate(const std::function<double(const Vec3&)>& pdf_w,
                                          int sub) const {
  std::vector<double> integrals(size(), 0.0);
  const double sector_angle = 2.0 * std::numbers::pi / static_cast<double>(sectors_);
  for (std::size_t i = 0; i < integrals.size(); ++i) {
    const std::size_t ring = i / sectors_;
    const double height = edges_[ring + 1] - edges_[ring];
    for (int a = 0; a < sub; ++a) {
      const double depth = edges_[ring] + height * (a + 0.5) / sub;
      const double r = std::sqrt(depth * (2.0 - depth));
      for (int b = 0; b < sub; ++b) {
        const double phi = sector_angle * (static_cast<double>(i % sectors_) + (b + 0.5) / sub);
        const Vec3d w = z_ * (1.0 - depth) + x_ * (r * std::cos(phi)) + y_ * (r * std::sin(phi));
        integrals[i] += pdf_w(Vec3(w));
      }
    }
    integrals[i] *= height * sector_angle / sub / sub;
  }
  return integrals;
}

DirectionFit fit_directions(const SphereGrid& grid,
                            const std::function<std::optional<Vec3>()>& sample,
                            const std::function<double(const Vec3&)>& pdf_w, int draws, int sub) {
  std::vector<double> observed(grid.size() + 1, 0.0);
  DirectionFit fit;
  for (int i = 0; i < draws; ++i) {
    const std::optional<Vec3> w = sample();
    const std::size_t bin = w ? grid.bin(*w) : grid.size();
    observed[bin] += 1.0;
    if (!w) {
      fit.missing += 1.0 / draws;
    } else if (bin == grid.size()) {
      fit.outside += 1.0 / draws;
    }
  }
  std::vector<double> expected = grid.integrate(pdf_w, sub);
  fit.integral = std::accumulate(expected.begin(), expected.end(), 0.0);
  for (double& value : expected) value *= draws;
  expected.push_back(std::max(0.0, 1.0 - fit.integral) * draws);
  // Quadrature error of a density whose whole mass lies in the grid is no bin.
  if (observed.back() == 0.0 && expected.back() < 1e-3 * draws) {
    observed.pop_back();
    expected.pop_back();
  }
  fit.p = chi_square_p(observed, expected);
  return fit;
}

}  // namespace penumbra::test
