#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/gate/gate_config.h"
#include "harness/gate/gate_result.h"
#include "harness/gate/gate_run.h"

/// Whether head lost efficiency against base. Knows numbers only.
/// Source: statistics.md section 4.
namespace penumbra {

/// The runs of one cell in one phase. Of both sides the blocks that both have count.
struct GateCellRuns {
  std::string name;
  GateThresholds thresholds;
  std::string accepted;  ///< why somebody accepted a loss that the thresholds allow; empty: nobody
  std::vector<GateRun> base, head;
};

struct JudgeOptions {
  double level{0.01};       ///< one-sided, of failing and of passing
  bool interleaved{false};  ///< times of both sides can be compared
  GateThresholds suite;     ///< of all cells together
  double suite_instructions{0.005};
};

struct Judgement {
  std::vector<GateCell> cells;  ///< in the order given
  GateSuite suite;
};

/// Cells whose images are the same fail by their work, others by their efficiency 1/(cost error).
/// First all cells together; then single ones, by Holm over cells and currencies. A loss fails when
/// it is certain to exceed the noise threshold and is measured beyond the one of failing; a pass
/// has to exclude the passing one's loss. What is neither is inconclusive. The CPU time of a cell
/// can only fail it; that of all cells has to exclude the passing loss too where instructions are
/// not counted.
///
/// The interval of a cell is that of statistics.h: jackknife over blocks, in which both sides have
/// the same seed, so that errors that go together cancel.
Judgement judge(std::span<const GateCellRuns> cells, const JudgeOptions& options);

/// The base against itself, over pairs of runs with equal cell and block.
/// @param level  two-sided
NullControl judge_null(std::span<const GateRun> base, std::span<const GateRun> null, double level);

/// Where the null control was rejected, a loss of CPU time decides nothing.
void set_times_aside(Judgement& judgement);

/// Whether more blocks would help.
bool undecided(const GateCell& cell) noexcept;
bool undecided(const GateSuite& suite) noexcept;

/// "+4.1 %" of a ratio, "±0" where it is 1.
std::string change_text(double ratio);

}  // namespace penumbra
