#include "estimators/optimal_mis/normal_equations.h"

#include <algorithm>
#include <cmath>

namespace penumbra::optimal_mis {

NormalEquations::NormalEquations(std::size_t most)
    : a_(row(most)), b_(most), factor_(row(most)), scale_(most) {}

void NormalEquations::clear(std::size_t size) noexcept {
  size_ = size;
  samples_ = 0.0;
  std::fill_n(a_.begin(), row(size), 0.0);
  std::fill_n(b_.begin(), size, RgbSum(0.0));
}

void NormalEquations::add(std::span<const double> x, const RgbSum& y) noexcept {
  samples_ += 1.0;
  double* a = a_.data();
  for (std::size_t i = 0; i < size_; ++i) {
    for (std::size_t j = 0; j <= i; ++j) *a++ += x[i] * x[j];
    b_[i] += y * x[i];
  }
}

void NormalEquations::add_alone(std::size_t k, double x, double count) noexcept {
  samples_ += count;
  a_[row(k) + k] += count * x * x;
}

void NormalEquations::add(const NormalEquations& other) noexcept {
  samples_ += other.samples_;
  for (std::size_t i = 0; i < row(size_); ++i) a_[i] += other.a_[i];
  for (std::size_t i = 0; i < size_; ++i) b_[i] += other.b_[i];
}

// Cholesky of the system scaled to a diagonal of 1 + ridge.
void NormalEquations::solve(double ridge, std::span<RgbSum> beta) noexcept {
  std::fill_n(beta.begin(), size_, RgbSum(0.0));
  for (std::size_t i = 0; i < size_; ++i) {
    const double diagonal = a_[row(i) + i];
    scale_[i] = diagonal > 0.0 ? 1.0 / std::sqrt(diagonal) : 0.0;
  }
  for (std::size_t i = 0; i < size_; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = i == j ? 1.0 + ridge : a_[row(i) + j] * scale_[i] * scale_[j];
      for (std::size_t k = 0; k < j; ++k) sum -= factor_[row(i) + k] * factor_[row(j) + k];
      if (i > j) {
        factor_[row(i) + j] = sum / factor_[row(j) + j];
      } else {
        if (!(sum > 0.0)) return;
        factor_[row(i) + i] = std::sqrt(sum);
      }
    }
  }
  for (std::size_t i = 0; i < size_; ++i) {
    RgbSum sum = b_[i] * scale_[i];
    for (std::size_t k = 0; k < i; ++k) sum -= beta[k] * factor_[row(i) + k];
    beta[i] = sum / factor_[row(i) + i];
  }
  for (std::size_t i = size_; i-- > 0;) {
    RgbSum sum = beta[i];
    for (std::size_t k = i + 1; k < size_; ++k) sum -= beta[k] * factor_[row(k) + i];
    beta[i] = sum / factor_[row(i) + i];
  }
  for (std::size_t i = 0; i < size_; ++i) beta[i] *= scale_[i];
}

}  // namespace penumbra::optimal_mis
