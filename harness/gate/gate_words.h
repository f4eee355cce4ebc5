#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/gate/gate_result.h"

/// What the files of a gate have in common: order, numbers and advice for people.
namespace penumbra {

/// What the row of all cells together is called.
inline constexpr std::string_view kSuiteName = "all cells";

/// Cells with the worst first: failures, then inconclusive ones, then passes. Among failures, those
/// whose images are wrong or missing come before losses; then by the size of the loss in the worse
/// of both currencies, an unknown one first. Equals stay in the order of the config.
std::vector<const GateCell*> worst_first(const GateResult& result);

/// "-4.90 % [-7.00, -2.80]": the change of an efficiency with its 95 % interval; "-" for none.
std::string effect_text(const std::optional<GateEffect>& effect);

/// change_text of a ratio (judge.h); "-" for none.
std::string ratio_change_text(const std::optional<double>& ratio);

/// "rays 100 -> 120 (+20.0 %)", for every counter that moved; empty where none did.
std::string counters_text(const GateCell& cell);

/// Why there was no test of bias; empty: there was.
std::string bias_skipped(const GateBias& bias);

/// "p = 0.013 (0.026 over all cells)", or why there was no test.
std::string bias_text(const GateBias& bias);

/// What the null control found, in one sentence.
std::string null_control_text(const NullControl& control);

/// Both sides and config as a command that compares them again. A head that names no build is a
/// folder of results.
std::string repeat_command(const GateResult& result);

/// What somebody who reads the verdict can do; empty after a plain pass.
std::vector<std::string> next_steps(const GateResult& result);

/// The text with U+FFFD for bytes that are not UTF-8: paths may hold any.
std::string readable(std::string_view text);

}  // namespace penumbra
