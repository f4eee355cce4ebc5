#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "estimators/mixture/sums.h"

/// Least squares for the coefficients of control variates. A class of its own, so that tests reach
/// it.
namespace penumbra::optimal_mis {

/// A beta = b per colour channel, with A = sum x x^T and b = sum x y over samples that have
/// regressors x_k = h_k/K and values y = f/K. Size is fixed when it is made.
class NormalEquations {
 public:
  /// @param most  largest number of coefficients
  explicit NormalEquations(std::size_t most);

  /// Forgets all samples; from now on there are `size` coefficients.
  void clear(std::size_t size) noexcept;
  std::size_t size() const noexcept { return size_; }
  double samples() const noexcept { return samples_; }

  /// Adds a sample. @param x  [coefficient]
  void add(std::span<const double> x, const RgbSum& y) noexcept;
  /// Adds `count` samples of value 0 where all regressors but x_k are 0.
  void add_alone(std::size_t k, double x, double count) noexcept;
  /// Adds all samples of another system of the same size.
  void add(const NormalEquations& other) noexcept;

  /// Solves (A + ridge diag(A)) beta = b. A regressor that was always 0 gets the coefficient 0, and
  /// all do where rounding leaves no solution.
  /// @param ridge  > 0, relative to the diagonal
  /// @param beta   result [coefficient], RGB
  void solve(double ridge, std::span<RgbSum> beta) noexcept;

 private:
  // Row i of the lower triangle begins here.
  static std::size_t row(std::size_t i) noexcept { return i * (i + 1) / 2; }

  std::size_t size_{0};
  double samples_{0.0};
  std::vector<double> a_;       // lower triangle, row by row
  std::vector<RgbSum> b_;       // [coefficient]
  std::vector<double> factor_;  // as a_: Cholesky factor of the scaled system
  std::vector<double> scale_;   // [coefficient], 1/sqrt(A_kk)
};

}  // namespace penumbra::optimal_mis
