#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "scenes/core/frame.h"
#include "scenes/core/sampler.h"
#include "scenes/core/vec.h"

/// Statistics of the tests: chi-squared and z tests with stated false-alarm levels, seeds of their
/// own per test, and quadrature over directions. Everything in double and independent of the code
/// under test.
namespace penumbra::test {

/// Hash of the running test's full name, so that no two tests share a stream.
std::uint64_t test_seed(std::uint64_t salt = 0);

/// Random numbers of a test, from a generator that the core does not use.
class TestRandom {
 public:
  explicit TestRandom(std::uint64_t salt = 0) : engine_(test_seed(salt)) {}

  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// In [0, 1), a multiple of 2^-24: what the samplers give.
  float unit_float() { return static_cast<float>(engine_() >> 40) * 0x1p-24f; }
  std::uint32_t bits() { return static_cast<std::uint32_t>(engine_() >> 32); }
  Variates variates() { return {Vec2(unit_float(), unit_float()), unit_float()}; }
  /// Uniform over the sphere.
  Vec3 direction();

 private:
  std::mt19937_64 engine_;
};

/// Level of each of `tests` independent tests such that one or more false alarms have probability
/// `family_level`. Source: Sidak 1967, "Rectangular confidence regions for the means of
/// multivariate normal distributions".
double sidak(double family_level, int tests);

/// Bound on |z| that a standard normal variate exceeds with probability `level`.
double z_bound(double level);

/// p-value of Pearson's chi-squared test. Bins that expect fewer than `min_expected` are pooled,
/// smallest first. A count in a bin that expects exactly 0 gives p = 0.
/// @param observed, expected  [bin] counts, same length and (to quadrature error) the same sum
double chi_square_p(std::span<const double> observed, std::span<const double> expected,
                    double min_expected = 10.0);

/// p-value against equal expectations.
double chi_square_uniform_p(std::span<const double> observed);

/// Running mean and variance.
class Moments {
 public:
  void add(double x);
  double n() const { return n_; }
  double mean() const { return mean_; }
  double standard_error() const;
  /// |z| of the mean against its exact value. `rounding` is a relative error of the terms that no
  /// averaging removes (of float arithmetic); it is added to the standard error.
  double z(double exact, double rounding = 0.0) const;

 private:
  double n_{0}, mean_{0}, sum2_{0};
};

/// Grid over directions: rings in 1 - cos(angle to the axis), sectors in azimuth.
class SphereGrid {
 public:
  /// @param depth_edges  increasing, of 1 - cos, in [0, 2]
  SphereGrid(const Vec3& axis, std::vector<double> depth_edges, std::size_t sectors);
  /// Rings of equal solid angle up to 1 - cos = depth.
  static SphereGrid cap(const Vec3& axis, double depth, std::size_t rings, std::size_t sectors);

  std::size_t size() const { return (edges_.size() - 1) * sectors_; }
  /// Index of a direction's bin; size() outside the grid.
  std::size_t bin(const Vec3& w) const;
  /// Integral of a density over each bin: product midpoint rule with sub x sub nodes.
  std::vector<double> integrate(const std::function<double(const Vec3&)>& pdf_w, int sub) const;

 private:
  Vec3d x_, y_, z_;
  std::vector<double> edges_;
  std::size_t sectors_;
};

/// How well directions fit a density over a grid.
struct DirectionFit {
  double p{0};  ///< of the chi-squared test; draws without a direction are a bin of their own
  double integral{0};  ///< of the density over the grid
  double missing{0};   ///< share of draws without a direction
  double outside{0};   ///< share of draws outside the grid
};

DirectionFit fit_directions(const SphereGrid& grid,
                            const std::function<std::optional<Vec3>()>& sample,
                            const std::function<double(const Vec3&)>& pdf_w, int draws,
                            int sub = 16);

}  // namespace penumbra::test
