#pragma once

#include <cstdint>
#include <span>

#include "estimators/mixture/mixture.h"
#include "scenes/core/sampler.h"

/// The adaptation step of PMC-HI as free functions, so that tests and microbenchmarks reach each
/// part. Component arrays are ordered as in Mixture: lights, BSDF, cone (last).
namespace penumbra::pmc_hi {

/// How N alpha_k becomes integer counts n_k that sum to N.
enum class Rounding : std::uint8_t {
  LargestRemainder,  ///< deterministic given alpha, ties broken at random
  Systematic,        ///< E[n_k] = N alpha_k, |n_k - N alpha_k| < 1
  Multinomial,       ///< E[n_k] = N alpha_k, noisy
};

/// Size of the cone from the weighted directions.
enum class BetaRule : std::uint8_t {
  RmsAngle,      ///< sqrt(sum w theta^2 / sum w)
  Chord,         ///< sqrt(2 (1 - Rbar))
  SphericalStd,  ///< sqrt(1 - Rbar^2)
  PerAxisStd,    ///< sqrt((1 - Rbar^2)/2)
  CircularStd,   ///< sqrt(-2 ln Rbar)
  MeanAngle,     ///< acos(Rbar)
};

/// @param alpha   mixture weights, >= 0, sum 1
/// @param total   N >= 1
/// @param key     of the iteration; the component is filled in
/// @param counts  result, same length as alpha
void round_counts(Rounding rounding, std::span<const double> alpha, int total, StreamKey key,
                  std::span<int> counts) noexcept;

/// Rounding::LargestRemainder by its rule: each sample left over goes to the component that is owed
/// most, among equals by a random ranking. `round_counts` gives the same, without the square of the
/// number of components that this takes.
void give_one_by_one(std::span<const double> alpha, int total, StreamKey key,
                     std::span<int> counts) noexcept;

/// Raises every component but the last (the cone) to `minimum`, taking each time from the largest
/// count that does not fall below its own minimum (0 for the cone). The sum stays.
/// @param counts  with a sum of at least minimum x (length - 1)
void raise_to_minimum(std::span<int> counts, int minimum) noexcept;

struct ConeRules {
  BetaRule rule{BetaRule::RmsAngle};
  double scale{1.0};
  double min{0.02};  ///< smallest half angle [rad]
  double max{1.5707963267948966};
};

/// Cone about the weighted mean direction of samples [first, mixture.size()).
/// @param weights  of those samples, >= 0, in the mixture's order from `first`
/// @return an inactive cone when the resultant is shorter than 1e-3 (no direction stands out)
Cone fit_cone(const Mixture& mixture, std::size_t first, std::span<const double> weights,
              const ConeRules& rules) noexcept;

/// Eq. 6 of the paper: adds each sample's weight to its own component.
void add_tag_sums(const Mixture& mixture, std::size_t first, std::span<const double> weights,
                  std::span<double> sums) noexcept;

/// Rao-Blackwellised Eq. 6: splits each weight by the components' shares c_k h_k/K of its density.
/// Same expectation. Source: Douc, Guillin, Marin and Robert 2007, "Convergence of adaptive
/// mixtures of importance sampling schemes".
void add_posterior_sums(const Mixture& mixture, std::size_t first, std::span<const double> weights,
                        std::span<const double> coefficients, std::span<double> sums) noexcept;

/// Scales values to sum 1. @return false when the sum is not positive
bool normalise(std::span<double> values) noexcept;

}  // namespace penumbra::pmc_hi
