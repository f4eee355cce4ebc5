#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimators/estimator.h"
#include "tests/support/fixtures.h"

/// Correlation between the errors of estimates of one point, which all pixels of a tile see.
namespace penumbra::fixtures {

inline constexpr int kCorrelationSide = 16;  ///< of the tile [pixels]
inline constexpr int kCorrelationSpp = 64;

/// First channel of the estimates less their mean: [pixel][estimate].
std::vector<double> errors_of_a_tile(const EstimatorEntry& entry, const ParamSet& params,
                                     const Budget& budget, const PlacedPoint& placed,
                                     std::uint64_t seed);

/// Correlation between every error and the one `step` behind it, in units of its standard deviation
/// for independent errors.
double correlation_z(const std::vector<double>& errors, std::size_t step);

}  // namespace penumbra::fixtures
