#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "harness/exit_codes.h"
#include "harness/gate/gate.h"

namespace penumbra {
namespace {

// The cells with a verdict and, where given, a reason: "scene/MIS/sobol (slower)".
std::vector<std::string> names_with(const GateResult& result, GateVerdict verdict,
                                    std::optional<GateReason> reason = {}) {
  std::vector<std::string> names;
  for (const GateCell& cell : result.cells) {
    if (cell.verdict != verdict || (reason && cell.reason != *reason)) continue;
    names.push_back(fmt::format("{} ({})", cell.name, to_string(cell.reason)));
  }
  return names;
}

void set(GateResult& result, GateVerdict verdict, ExitCode code, std::string sentence) {
  result.verdict = verdict;
  result.exit_code = code;
  result.sentence = std::move(sentence);
}

}  // namespace

void conclude(GateResult& result) {
  const auto failed = names_with(result, GateVerdict::Fail, GateReason::Failed);
  const auto random = names_with(result, GateVerdict::Fail, GateReason::NonDeterministic);
  const auto biased = names_with(result, GateVerdict::Fail, GateReason::Biased);
  const auto losses = names_with(result, GateVerdict::Fail);
  const auto open = names_with(result, GateVerdict::Inconclusive);
  const bool suite_lost = result.suite.verdict == GateVerdict::Fail;
  if (!failed.empty()) {
    set(result, GateVerdict::Fail, kRunFailure,
        fmt::format("head does not run: {}", fmt::join(failed, ", ")));
  } else if (!random.empty() || !biased.empty()) {
    set(result, GateVerdict::Fail, kCorrectness,
        fmt::format("head is wrong: {}", fmt::join(random.empty() ? biased : random, ", ")));
  } else if (suite_lost || !losses.empty()) {
    set(result, GateVerdict::Fail, kRegression,
        losses.empty() ? fmt::format("head lost efficiency over all cells ({}): {}",
                                     to_string(result.suite.reason), result.suite.sentence)
                       : fmt::format("head lost efficiency: {}", fmt::join(losses, ", ")));
  } else if (!open.empty() || result.suite.verdict == GateVerdict::Inconclusive) {
    set(result, GateVerdict::Inconclusive, kInconclusive,
        open.empty() ? "all cells together do not decide"
                     : fmt::format("not decided: {}", fmt::join(open, ", ")));
  } else {
    const bool same = std::all_of(result.cells.begin(), result.cells.end(), [](const GateCell& c) {
      return c.reason == GateReason::Unchanged;
    });
    set(result, GateVerdict::Pass, kSuccess,
        same ? "same images and the same work in all cells" : "no loss that matters");
  }
  for (const GateCell& cell : result.cells) {
    if (cell.reason == GateReason::Improved && !result.base.what.empty() && !result.interleaved) {
      result.notes.push_back(cell.name +
                             ": certainly better than the stored runs, which are stale "
                             "(penumbra baseline update)");
    }
  }
}

}  // namespace penumbra
