#pragma once

#include <cstddef>
#include <span>

#include "estimators/mixture/mixture.h"
#include "estimators/pmc_hi/settings.h"

/// How the iterations of PMC-HI become one estimate.
namespace penumbra::pmc_hi {

struct Iteration {
  int n{0};              ///< samples drawn
  std::size_t first{0};  ///< of its samples in the mixture
  RgbSum sum{0.0};       ///< of the weights f/K
  double square_sum{0};  ///< of their squared luminances, for the inverse variance only
  Cone cone;             ///< it drew from
};

/// The estimate from all iterations; completes the recorded weights, which are 1/K before.
/// @param iterations    in order
/// @param coefficients  [iteration][component] c_k, rows of `stride`; for Combine::Pooled only
RgbSum combine(Combine rule, Mixture& mixture, std::span<const Iteration> iterations,
               std::span<const double> coefficients, std::size_t stride) noexcept;

}  // namespace penumbra::pmc_hi
