#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/experiment.h"
#include "harness/gate/gate_config.h"
#include "harness/gate/gate_result.h"
#include "harness/gate/measurer.h"

/// The regression gate: is head noisier, slower, wrong or random, compared with base?
/// Source: statistics.md section 4.
///
/// Tiers, in this order: head makes one run of every cell with the fewest samples (G0); head has
/// the same bits twice and on several threads, and its images are those of base or not (G1); work
/// and CPU time where they are (G2), efficiency where they are not (G3), at more and more blocks
/// until it is decided; bias of the cells whose images changed (G4); the base against itself (NC).
/// What fails has to fail again with fresh seeds.
namespace penumbra {

/// What is compared with what: one of the three groups.
struct GateSources {
  std::filesystem::path base_exe;  ///< measured interleaved with head_exe
  std::filesystem::path head_exe;  ///< also measured against `baseline`

  std::filesystem::path baseline;  ///< folder of stored baselines

  std::filesystem::path base_folder;  ///< of `penumbra run`
  std::filesystem::path head_folder;
};

struct GateOptions {
  std::vector<std::string> overrides;  ///< "key.path=value" of the config, for the programs
  std::vector<GateOverride> accepted;  ///< losses that somebody acknowledged
  std::filesystem::path rows;          ///< gate.rows.csv
  bool times{true};                    ///< of CPU, decide too, if the base against itself allows it
};

/// Measures base_exe and head_exe interleaved and judges.
/// @param experiment  without a time budget
/// @throws GateInterrupted; WorkerFailure when the base does not work; InputError and
///         ReferenceError as gate_subject and WorkerProcess
GateResult gate_programs(const Experiment& experiment, const GateSources& sources,
                         const GateOptions& options);

/// Measures head_exe against a stored baseline: no times, no instructions.
/// @throws likewise, ReferenceError as read_baseline
GateResult gate_against_baseline(const Experiment& experiment, const GateSources& sources,
                                 const GateOptions& options);

/// Compares two result folders, block by block. Their times were not measured in turns, so that
/// only work and errors decide.
/// @throws InputError, ReferenceError when the folders do not hold the same cells and truth
GateResult gate_folders(const Experiment& experiment, const GateSources& sources,
                        const GateOptions& options);

/// Measures a new baseline by `executable` and writes it.
/// @return what keeps it from being one: head's runs that failed, are random or biased; then
///         nothing is written. A pass otherwise.
GateResult update_baseline(const Experiment& experiment, const std::filesystem::path& executable,
                           const std::filesystem::path& folder, const std::string& reason,
                           const GateOptions& options);

/// "CELLS -4% reason": a loss that somebody accepts, with its thresholds.
/// @throws InputError naming the text and its form
GateOverride parse_acknowledgement(const std::string& text, const GateThresholds& usual);

/// Verdict, exit code and sentence of the whole from its parts.
void conclude(GateResult& result);

}  // namespace penumbra
