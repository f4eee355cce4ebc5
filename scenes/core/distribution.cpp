#include "scenes/core/distribution.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr float kOneMinusEpsilon = 1.0f - 0x1p-24f;

float below_one(double x) noexcept { return std::min(static_cast<float>(x), kOneMinusEpsilon); }

// In double, where the product is exact: in float it can round up to the next cell's edge.
std::uint32_t cell_of(float x, std::size_t cells) noexcept {
  const auto cell = static_cast<std::uint32_t>(static_cast<double>(x) * static_cast<double>(cells));
  return std::min(cell, static_cast<std::uint32_t>(cells - 1));
}

}  // namespace

DiscreteDistribution::DiscreteDistribution(std::span<const double> weights) {
  cdf_.reserve(weights.size() + 1);
  cdf_.push_back(0.0);
  for (const double weight : weights) {
    PN_CHECK(std::isfinite(weight) && weight >= 0.0, "weights must be finite and >= 0");
    total_ += weight;
    cdf_.push_back(total_);
  }
  PN_CHECK(total_ > 0.0 && std::isfinite(total_), "a distribution needs a positive finite sum");
  for (double& value : cdf_) value /= total_;
  // Exactly 1 from the last positive weight on, so that no u can fall behind it.
  for (std::size_t i = weights.size(); i > 0; --i) {
    cdf_[i] = 1.0;
    if (weights[i - 1] > 0.0) break;
  }
}

DiscreteDistribution::Choice DiscreteDistribution::sample(float u) const noexcept {
  // The first entry above u: entries of zero width are passed over.
  const double target = static_cast<double>(u);
  const auto above = std::upper_bound(cdf_.begin() + 1, cdf_.end(), target);
  const auto index = static_cast<std::size_t>(above - cdf_.begin()) - 1;
  const double probability = cdf_[index + 1] - cdf_[index];
  return {static_cast<std::uint32_t>(index), probability,
          below_one((target - cdf_[index]) / probability)};
}

double DiscreteDistribution::pmf(std::uint32_t index) const noexcept {
  return cdf_[index + 1] - cdf_[index];
}

PiecewiseConstant1D::Sample PiecewiseConstant1D::sample(float u) const noexcept {
  const auto n = static_cast<double>(cells_.size());
  const DiscreteDistribution::Choice choice = cells_.sample(u);
  float x = below_one((choice.index + static_cast<double>(choice.remapped_u)) / n);
  // Rounding may step over an edge, into a cell of another density.
  const std::uint32_t cell = cell_of(x, size());
  if (cell != choice.index) x = std::nextafter(x, cell > choice.index ? 0.0f : 1.0f);
  return {x, choice.pmf * n, choice.index};
}

double PiecewiseConstant1D::pdf(float x) const noexcept {
  return cells_.pmf(cell_of(x, size())) * static_cast<double>(cells_.size());
}

float PiecewiseConstant1D::invert(float x) const noexcept {
  const std::uint32_t cell = cell_of(x, size());
  double below = 0.0;
  for (std::uint32_t i = 0; i < cell; ++i) below += cells_.pmf(i);
  const double within = static_cast<double>(x) * static_cast<double>(cells_.size()) - cell;
  return below_one(below + within * cells_.pmf(cell));
}

PiecewiseConstant2D::PiecewiseConstant2D(std::span<const double> values, std::uint32_t columns,
                                         std::uint32_t rows) {
  PN_CHECK(values.size() == std::size_t{columns} * rows && columns > 0, "grid size mismatch");
  std::vector<double> row_sums(rows, 0.0);
  conditional_.reserve(rows);
  for (std::uint32_t row = 0; row < rows; ++row) {
    const auto line = values.subspan(std::size_t{row} * columns, columns);
    for (const double value : line) row_sums[row] += value;
    conditional_.push_back(row_sums[row] > 0.0 ? PiecewiseConstant1D(line) : PiecewiseConstant1D());
  }
  marginal_ = PiecewiseConstant1D(row_sums);
}

PiecewiseConstant2D::Sample PiecewiseConstant2D::sample(const Vec2& u) const noexcept {
  const PiecewiseConstant1D::Sample row = marginal_.sample(u.y);
  const PiecewiseConstant1D::Sample column = conditional_[row.cell].sample(u.x);
  return {Vec2(column.x, row.x), row.pdf * column.pdf};
}

double PiecewiseConstant2D::pdf(const Vec2& uv) const noexcept {
  const std::uint32_t row = cell_of(uv.y, conditional_.size());
  if (conditional_[row].size() == 0) return 0.0;
  return marginal_.pdf(uv.y) * conditional_[row].pdf(uv.x);
}

Vec2 PiecewiseConstant2D::invert(const Vec2& uv) const noexcept {
  const std::uint32_t row = cell_of(uv.y, conditional_.size());
  const float x = conditional_[row].size() == 0 ? 0.0f : conditional_[row].invert(uv.x);
  return {x, marginal_.invert(uv.y)};
}

}  // namespace penumbra
