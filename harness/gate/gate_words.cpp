#include "harness/gate/gate_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>

#include "harness/gate/judge.h"
#include "harness/number_text.h"
#include "harness/shell_words.h"

namespace penumbra {
namespace {

int rank_of(GateVerdict verdict) {
  switch (verdict) {
    case GateVerdict::Fail:
      return 0;
    case GateVerdict::Inconclusive:
      return 1;
    case GateVerdict::Pass:
      break;
  }
  return 2;
}

bool is_wrong(const GateCell& cell) {
  return cell.reason == GateReason::Failed || cell.reason == GateReason::NonDeterministic ||
         cell.reason == GateReason::Biased;
}

// Smallest log ratio of efficiency; minus infinity where none is known, NaN included.
double log_ratio_of(const GateCell& cell) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto* effect : {&cell.efficiency, &cell.efficiency_cpu}) {
    if (!*effect) continue;
    const double value = (*effect)->log_ratio;
    if (std::isnan(value)) return -std::numeric_limits<double>::infinity();
    least = std::min(least, value);
  }
  return std::isinf(least) && least > 0 ? -least : least;
}

bool fails_with(const GateResult& result, GateReason reason) {
  return std::any_of(result.cells.begin(), result.cells.end(), [&](const GateCell& cell) {
    return cell.verdict == GateVerdict::Fail && cell.reason == reason;
  });
}

// The worst loss of efficiency that failed, in whole percent rounded up.
std::string acknowledgement(const GateResult& result) {
  for (const GateCell* cell : worst_first(result)) {
    if (cell->verdict != GateVerdict::Fail || is_wrong(*cell)) continue;
    const double loss = -100 * std::expm1(log_ratio_of(*cell));
    if (!std::isfinite(loss) || loss <= 0) continue;
    return fmt::format("Perf-Ack: {} -{:.0f}% <reason>", readable(cell->name), std::ceil(loss));
  }
  return {};
}

}  // namespace

std::vector<const GateCell*> worst_first(const GateResult& result) {
  std::vector<const GateCell*> cells;
  for (const GateCell& cell : result.cells) cells.push_back(&cell);
  const auto key = [](const GateCell& cell) {
    return std::tuple(rank_of(cell.verdict), is_wrong(cell) ? 0 : 1, log_ratio_of(cell));
  };
  std::stable_sort(cells.begin(), cells.end(),
                   [&](const GateCell* a, const GateCell* b) { return key(*a) < key(*b); });
  return cells;
}

std::string effect_text(const std::optional<GateEffect>& effect) {
  if (!effect) return "-";
  return fmt::format("{:+.2f} % [{:+.2f}, {:+.2f}]", 100 * std::expm1(effect->log_ratio),
                     100 * std::expm1(effect->interval.lo), 100 * std::expm1(effect->interval.hi));
}

std::string ratio_change_text(const std::optional<double>& ratio) {
  return ratio ? change_text(*ratio) : "-";
}

std::string counters_text(const GateCell& cell) {
  std::string text;
  for (const CounterChange& counter : cell.counters) {
    text += fmt::format("{}{} {:.10g} -> {:.10g}", text.empty() ? "" : ", ", counter.name,
                        counter.base, counter.head);
    if (counter.base != 0)
      text += fmt::format(" ({})", ratio_change_text(counter.head / counter.base));
  }
  return text;
}

std::string bias_skipped(const GateBias& bias) {
  return bias.skipped.empty() && bias.blocks == 0 ? "no blocks" : bias.skipped;
}

std::string bias_text(const GateBias& bias) {
  if (std::string why = bias_skipped(bias); !why.empty()) return why;
  return fmt::format("p = {} ({} over all cells)", number_text(bias.p),
                     number_text(bias.adjusted_p));
}

std::string null_control_text(const NullControl& control) {
  if (!control.cpu_time) {
    return fmt::format("Base against itself: no times to compare in {} pairs.", control.pairs);
  }
  return fmt::format("Base against itself, {} pairs: efficiency in CPU time {}, {}.", control.pairs,
                     effect_text(control.cpu_time),
                     control.rejected ? "REJECTED: times differ here without a cause, so losses of "
                                        "time decide nothing"
                                      : "as it should be");
}

std::string repeat_command(const GateResult& result) {
  const char* base = "--base-exe";
  const char* head = "--head-exe";
  if (!result.interleaved) {
    const auto build = nlohmann::json::parse(result.head.build, nullptr, false);
    const bool is_program = build.is_object() && !build.empty();
    base = is_program ? "--baseline" : "--base";
    head = is_program ? "--head-exe" : "--head";
  }
  return fmt::format("penumbra gate {} {} {} {} --config {}", base, shell_quoted(result.base.what),
                     head, shell_quoted(result.head.what), shell_quoted(result.config_file));
}

std::vector<std::string> next_steps(const GateResult& result) {
  std::vector<std::string> steps;
  if (fails_with(result, GateReason::Failed)) {
    steps.push_back("A cell did not run to its end. The same cells without a gate: penumbra run " +
                    shell_quoted(result.config_file));
  }
  if (fails_with(result, GateReason::NonDeterministic)) {
    steps.emplace_back(
        "The same seed has to give the same bits on any number of threads: look for random numbers "
        "or sums that depend on the order of tiles.");
  }
  if (fails_with(result, GateReason::Biased)) {
    steps.emplace_back("A bias is not accepted by a trailer: the mean has to be the reference's.");
  }
  if (const std::string trailer = acknowledgement(result); !trailer.empty()) {
    steps.emplace_back(
        "The sentence says whether error, rays or work moved. A loss that is meant is accepted "
        "by a trailer in the commit message: " +
        trailer);
  }
  if (result.verdict == GateVerdict::Inconclusive) {
    steps.emplace_back(
        "Not decided: run it again on a quieter machine, or with more blocks (gate.looks).");
  }
  return steps;
}

std::string readable(std::string_view text) {
  using nlohmann::json;
  const std::string valid = json(text).dump(-1, ' ', false, json::error_handler_t::replace);
  return json::parse(valid).get<std::string>();
}

}  // namespace penumbra
