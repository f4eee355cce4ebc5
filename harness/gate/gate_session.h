#pragma once

#include <string>
#include <vector>

#include "harness/clocks.h"
#include "harness/gate/gate.h"
#include "harness/gate/judge.h"
#include "harness/gate/measurer.h"

namespace penumbra {

/// One gate that measures, from its first run to its verdict.
class GateSession {
 public:
  /// @param subject, measurer  outlive the session
  GateSession(const GateSubject& subject, const GateOptions& options, GateMeasurer* measurer);

  const GateSubject& subject() const { return subject_; }
  GateResult& result() { return result_; }

  /// Takes a cell out of the comparison, with a note.
  void leave_out(const std::string& cell, const std::string& reason);

  /// All tiers.
  /// @param stored  runs of base, or none where it is measured too
  void compare(const std::vector<GateRun>& stored);

  /// Runs for a new baseline: head alone, checked for failures, randomness and bias.
  std::vector<GateRun> measure_baseline();

 private:
  bool stored() const { return !stored_.empty(); }
  bool check_head();
  void finish();
  std::vector<GateSide> sides() const;
  GateCellRuns cell_runs(std::size_t cell, GatePhase phase) const;
  Judgement judge_cells(std::span<const std::size_t> cells, GatePhase phase) const;
  void look_until_decided();
  void control_times(int blocks);
  void test_bias();
  void confirm_bias();
  void confirm_losses();
  GateCell& cell(std::size_t index);
  double level() const;

  const GateSubject& subject_;
  const GateOptions& options_;
  GateMeasurer* measurer_;
  std::vector<GateRun> stored_;
  std::vector<std::size_t> cells_;  // that are compared
  GateResult result_;
  Stopwatch watch_;
};

}  // namespace penumbra
