#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/config.h"
#include "harness/gate/judge.h"
#include "harness/plan.h"

namespace penumbra {

/// A name per cell that people can read and two versions of the program agree on:
/// scene/label/sampler, and SPP, SRL and parameters where that is not unique.
std::vector<std::string> gate_cell_names(const ExperimentConfig& config,
                                         std::span<const Cell> cells);

/// Seed of a run: independent for every cell and block.
std::uint64_t gate_seed(const ExperimentConfig& config, const std::string& cell, int block);

/// The thresholds of a cell: those of the config, or of a loss that was accepted.
void set_thresholds(const GateConfig& config, std::span<const GateOverride> accepted,
                    GateCellRuns& runs);

}  // namespace penumbra
