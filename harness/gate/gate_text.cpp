#include "harness/gate/gate_text.h"

#include <fmt/format.h>

#include "harness/gate/gate_words.h"
#include "harness/text_grid.h"

namespace penumbra {
namespace {

std::string outcome(GateVerdict verdict, GateReason reason) {
  return fmt::format("{} {}", to_string(verdict), to_string(reason));
}

TextGrid grid_of(const GateResult& result) {
  TextGrid grid;
  grid.columns = {{"Cell", true},  {"Verdict", true}, {"Efficiency", false}, {"Error", false},
                  {"Rays", false}, {"Work", false},   {"CPU time", false},   {"Blocks", false}};
  const GateSuite& suite = result.suite;
  grid.lines.push_back(
      {std::string(kSuiteName), outcome(suite.verdict, suite.reason), effect_text(suite.efficiency),
       "", "", ratio_change_text(suite.instructions_ratio), "", std::to_string(suite.blocks)});
  for (const GateCell* cell : worst_first(result)) {
    grid.lines.push_back({cell->name, outcome(cell->verdict, cell->reason),
                          effect_text(cell->efficiency), ratio_change_text(cell->error_ratio),
                          ratio_change_text(cell->rays_ratio),
                          ratio_change_text(cell->instructions_ratio),
                          ratio_change_text(cell->cpu_ratio), std::to_string(cell->blocks)});
  }
  return grid;
}

std::vector<std::string> notes_of(const GateResult& result) {
  std::vector<std::string> notes = {
      "Changes of head against base, with 95 % intervals. Work is counted in instructions; CPU "
      "time can fail a cell but not pass it."};
  for (const GateCell* cell : worst_first(result)) {
    if (cell->reason == GateReason::Unchanged) continue;
    notes.push_back(cell->name + ": " + cell->sentence + ".");
    if (!cell->counters.empty()) notes.push_back("  counters: " + counters_text(*cell) + ".");
  }
  if (result.null_control) notes.push_back(null_control_text(*result.null_control));
  notes.insert(notes.end(), result.notes.begin(), result.notes.end());
  for (const std::string& step : next_steps(result)) notes.push_back("Next: " + step);
  return notes;
}

}  // namespace

std::string gate_text(const GateResult& result) {
  const std::string verdict = fmt::format("{}: {}", to_string(result.verdict), result.sentence);
  return terminal_grid(grid_of(result), 1) + terminal_notes(notes_of(result)) + "\n" +
         wrapped(verdict, kTerminalWidth);
}

}  // namespace penumbra
