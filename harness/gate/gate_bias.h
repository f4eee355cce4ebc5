#pragma once

#include <span>
#include <string>

#include "harness/gate/gate_result.h"
#include "harness/gate/gate_run.h"
#include "harness/reference.h"

namespace penumbra {

/// Tests the mean of head's runs against the reference (statistics.md 3.5).
/// @param declared  why the estimator is biased; then nothing is tested
GateBias test_gate_bias(std::span<const GateRun> head, const Reference& reference,
                        const std::string& declared);

/// Adjusts the p values of all tests by Holm.
void adjust_bias(std::vector<GateCell>& cells);

}  // namespace penumbra
