#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scenes/core/vec.h"

/// Tabulated distributions; sums in double.
namespace penumbra {

/// Probabilities over [0, size()) in proportion to given weights.
class DiscreteDistribution {
 public:
  DiscreteDistribution() = default;
  /// @param weights  finite, >= 0, not all zero (PN_CHECK)
  explicit DiscreteDistribution(std::span<const double> weights);

  struct Choice {
    std::uint32_t index;
    double pmf;
    float remapped_u;  ///< uniform in [0, 1) given the index
  };

  /// @param u  uniform in [0, 1)
  Choice sample(float u) const noexcept;
  double pmf(std::uint32_t index) const noexcept;
  std::size_t size() const noexcept { return cdf_.empty() ? 0 : cdf_.size() - 1; }
  double total_weight() const noexcept { return total_; }

 private:
  std::vector<double> cdf_;  // size() + 1 values from 0 to 1
  double total_{0};
};

/// Piecewise-constant density over [0, 1) with equal cells.
class PiecewiseConstant1D {
 public:
  PiecewiseConstant1D() = default;
  explicit PiecewiseConstant1D(std::span<const double> values) : cells_(values) {}

  struct Sample {
    float x;     ///< in [0, 1)
    double pdf;  ///< per unit length
    std::uint32_t cell;
  };

  Sample sample(float u) const noexcept;
  double pdf(float x) const noexcept;
  /// The u that `sample` maps to x; x in a cell of density 0 has none, and gives that cell's edge.
  float invert(float x) const noexcept;
  /// Mean of the values: the integral of the function over [0, 1).
  double integral() const noexcept {
    return cells_.total_weight() / static_cast<double>(cells_.size());
  }
  std::size_t size() const noexcept { return cells_.size(); }

 private:
  DiscreteDistribution cells_;
};

/// Piecewise-constant density over [0, 1)^2 on a regular grid: a marginal over rows, then a
/// conditional per row.
class PiecewiseConstant2D {
 public:
  PiecewiseConstant2D() = default;
  /// @param values  row-major, rows x columns, finite, >= 0, not all zero
  PiecewiseConstant2D(std::span<const double> values, std::uint32_t columns, std::uint32_t rows);

  struct Sample {
    Vec2 uv;     ///< x along columns, y along rows, in [0, 1)^2
    double pdf;  ///< per unit area of the square
  };

  Sample sample(const Vec2& u) const noexcept;
  double pdf(const Vec2& uv) const noexcept;
  Vec2 invert(const Vec2& uv) const noexcept;

 private:
  std::vector<PiecewiseConstant1D> conditional_;  // empty for a row of zeros, which is never chosen
  PiecewiseConstant1D marginal_;
};

}  // namespace penumbra
