#pragma once

#include "scenes/core/sampler.h"

/// What the statistical tests of PMC-HI's parts share.
namespace penumbra::pmc_hi {

inline constexpr double kErrors = 5.0;  ///< standard errors that a mean may be off
inline constexpr int kKeys = 20'000;    ///< independent repetitions

inline StreamKey key_of(int i) {
  StreamKey key;
  key.seed = 77;
  key.estimate = static_cast<std::uint32_t>(i);
  return key;
}

}  // namespace penumbra::pmc_hi
