#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "harness/gate/gate_run.h"
#include "harness/gate/measurer.h"
#include "harness/gate/protocol.h"

/// Stored baselines: what does not depend on the machine (hashes, counts of work, errors) of the
/// runs that a gate makes, as one JSON file per scene that is kept in git and reviewed as a diff.
namespace penumbra {

struct Baseline {
  std::vector<GateRun> runs;  ///< of GateSide::Base, without times and instructions
  std::string build;          ///< JSON, of the program that made it
  std::string machine;
  std::vector<std::string> missing;  ///< cells of the config that it does not have
};

/// Reads the baseline of a subject's scenes.
/// @throws ReferenceError naming file and fault when one is missing, is of another version, or is
///         of other cells, metric or truth than the subject's
Baseline read_baseline(const std::filesystem::path& folder, const GateSubject& subject);

/// Writes it, each file whole or not at all. Reasons of earlier updates are kept.
/// @param runs      of all cells, as measured
/// @param greeting  of the program that made them
/// @throws RunError
void write_baseline(const std::filesystem::path& folder, const GateSubject& subject,
                    const std::vector<GateRun>& runs, const WorkerGreeting& greeting,
                    const std::string& reason);

}  // namespace penumbra
