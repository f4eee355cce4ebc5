#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "harness/gate/gate_result.h"

/// Results of gates for the tests of what writes them.
namespace penumbra {

/// All that a reason fails with.
inline const std::vector<GateReason> kFailingReasons = {
    GateReason::Noisier, GateReason::MoreRays,         GateReason::Slower,
    GateReason::Biased,  GateReason::NonDeterministic, GateReason::Failed};

/// A name with every character that some format gives a meaning.
inline const std::string kAwkwardName = "a|b*<i>`c`</i>&amp;_d_[e](f)\\g\"h'~~/i";

/// An effect with a ratio and a standard error of its logarithm; limits are round numbers of it.
inline GateEffect effect_of(double ratio, double standard_error) {
  GateEffect effect;
  effect.log_ratio = std::log(ratio);
  effect.standard_error = standard_error;
  effect.interval = {effect.log_ratio - 2 * standard_error, effect.log_ratio + 2 * standard_error};
  effect.lower = effect.log_ratio - 3 * standard_error;
  effect.upper = effect.log_ratio + 3 * standard_error;
  effect.p_loss = ratio < 1 ? 0.001 : 0.9;
  return effect;
}

/// A cell with everything measured, of changed images.
inline GateCell gate_cell(const std::string& name, double ratio, GateVerdict verdict,
                          GateReason reason) {
  GateCell cell;
  cell.name = name;
  cell.blocks = 16;
  cell.counters = {{"rays", 1000, 1200}};
  cell.efficiency = effect_of(ratio, 0.01);
  cell.efficiency_cpu = effect_of(ratio, 0.02);
  cell.error_ratio = 1 / ratio;
  cell.instructions_ratio = 1.0;
  cell.rays_ratio = 1.2;
  cell.cpu_ratio = 1.01;
  cell.p_eff = 4000.0;
  cell.detectable = 0.031;
  cell.bias.p = 0.4;
  cell.bias.adjusted_p = 0.8;
  cell.bias.relative = 0.001;
  cell.bias.relative_interval = Interval{-0.002, 0.004};
  cell.bias.blocks = 16;
  cell.confirmed = verdict == GateVerdict::Fail;
  cell.verdict = verdict;
  cell.reason = reason;
  cell.sentence = "sentence of " + name;
  return cell;
}

inline GateCell unchanged_cell(const std::string& name) {
  GateCell cell = gate_cell(name, 1.0, GateVerdict::Pass, GateReason::Unchanged);
  cell.same_images = cell.same_half_images = true;
  cell.counters.clear();
  cell.rays_ratio = 1.0;
  cell.bias = {};
  cell.bias.skipped = "the images are those of base";
  return cell;
}

/// A cell whose program crashed has no numbers at all.
inline GateCell crashed_cell(const std::string& name) {
  GateCell cell;
  cell.name = name;
  cell.verdict = GateVerdict::Fail;
  cell.reason = GateReason::Failed;
  cell.sentence = "block 3: ended by signal 11";
  return cell;
}

/// Two builds in turns, with the cells given.
inline GateResult gate_result(std::vector<GateCell> cells, GateVerdict verdict, int exit_code) {
  GateResult result;
  result.verdict = verdict;
  result.exit_code = exit_code;
  result.sentence = "the sentence of the gate";
  result.config_name = "quick gate";
  result.config_file = "configs/gate.json";
  result.metric = "relmse";
  result.looks = {8, 16, 32};
  result.blocks = 16;
  result.interleaved = true;
  result.suite.cells = static_cast<int>(cells.size());
  result.suite.blocks = 16;
  result.suite.efficiency = effect_of(0.99, 0.005);
  result.suite.instructions_ratio = 1.001;
  result.suite.verdict = verdict;
  result.suite.reason = GateReason::WithinLimits;
  result.suite.sentence = "sentence of the suite";
  result.cells = std::move(cells);
  result.null_control = NullControl{16, effect_of(1.002, 0.004), false};
  result.notes = {"first note", "second note"};
  result.base = {"build/base/penumbra", R"({"commit": "aaa", "compiler": "GNU 12"})", "CPU A"};
  result.head = {"build/head/penumbra", R"({"commit": "bbb", "compiler": "GNU 12"})", "CPU A"};
  result.wall_s = 61.5;
  result.runs = 96;
  return result;
}

inline GateResult passing_result() {
  return gate_result({unchanged_cell("s/A/sobol"),
                      gate_cell("s/B/sobol", 0.98, GateVerdict::Pass, GateReason::WithinLimits)},
                     GateVerdict::Pass, 0);
}

inline GateResult failing_result(GateReason reason) {
  const GateCell cell = reason == GateReason::Failed
                            ? crashed_cell("s/B/sobol")
                            : gate_cell("s/B/sobol", 0.902, GateVerdict::Fail, reason);
  return gate_result({unchanged_cell("s/A/sobol"), cell}, GateVerdict::Fail, 1);
}

inline GateResult inconclusive_result() {
  return gate_result(
      {gate_cell("s/B/sobol", 0.96, GateVerdict::Inconclusive, GateReason::TooNoisy)},
      GateVerdict::Inconclusive, 3);
}

/// Against stored values: no times, no second program, no null control.
inline GateResult stored_result() {
  GateCell cell = gate_cell("s/B/sobol", 1.1, GateVerdict::Pass, GateReason::Improved);
  cell.efficiency_cpu.reset();
  cell.cpu_ratio.reset();
  GateResult result = gate_result({cell}, GateVerdict::Pass, 0);
  result.interleaved = false;
  result.null_control.reset();
  result.base = {"baselines/quick gate", "", ""};
  return result;
}

}  // namespace penumbra
