#pragma once

#include <span>

#include "estimators/estimator.h"
#include "estimators/pmc_hi_plus/allocation.h"
#include "estimators/pmc_hi_plus/samples.h"

namespace penumbra::pmc_hi_plus {

/// The estimator's parameters as declared in `specs()`, with names resolved.
struct Settings {
  LightSampling light_sampling{LightSampling::Area};
  Heuristic heuristic{Heuristic::Power2};
  bool glossy_lobes_only{true};
  bool continue_sequence{true};
  AllocationRules allocation;
};

std::span<const ParamSpec> specs();
Settings read_settings(const ParamSet& params, const Budget& budget);

}  // namespace penumbra::pmc_hi_plus
