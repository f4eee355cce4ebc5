#include "harness/measured_cells.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

using Attempts = std::map<int, const RunRow*>;  // by number

void check_reference(std::map<std::string, std::string>& references, const RunRow& row) {
  if (row.reference_id.empty()) return;
  const auto [place, added] = references.emplace(row.scene, row.reference_id);
  if (added || place->second == row.reference_id) return;
  throw ReferenceError(
      fmt::format("scene \"{}\": run {} was measured against reference {}, others against {}; "
                  "measure them again",
                  row.scene, row.run_id, row.reference_id, place->second));
}

void add_attempt(Attempts& attempts, const RunRow& run) {
  const auto [place, added] = attempts.emplace(run.attempt, &run);
  if (added) return;
  throw InputError(
      fmt::format("scene \"{}\", \"{}\": attempt {} at block {} was measured twice, as {} and {}",
                  run.scene, run.label, run.attempt, run.block, place->second->run_id, run.run_id));
}

const RunRow* chosen(const Attempts& attempts) {
  for (const auto& [number, run] : attempts) {
    if (run->status == RunStatus::Failed) return run;
  }
  for (const auto& [number, run] : attempts) {
    if (run->contaminated.empty()) return run;
  }
  return attempts.rbegin()->second;
}

MeasuredCell cell_of(const std::map<int, Attempts>& blocks) {
  MeasuredCell cell;
  for (const auto& [block, attempts] : blocks) {
    for (const auto& [number, run] : attempts) cell.n_contaminated += !run->contaminated.empty();
    const RunRow* const run = chosen(attempts);
    cell.contaminated_in_use += !run->contaminated.empty();
    cell.blocks.emplace(block, run);
  }
  return cell;
}

bool is_number(const std::optional<double>& value) { return value && std::isfinite(*value); }

}  // namespace

std::vector<MeasuredCell> measured_cells(std::span<const RunRow> rows) {
  std::map<decltype(cell_key(rows[0])), std::map<int, Attempts>> groups;
  std::map<std::string, std::string> references;
  for (const RunRow& run : rows) {
    check_reference(references, run);
    add_attempt(groups[cell_key(run)][run.block], run);
  }
  std::vector<MeasuredCell> cells;
  for (const auto& [key, blocks] : groups) cells.push_back(cell_of(blocks));
  return cells;
}

std::string time_fault_of(const MeasuredCell& cell) {
  const auto differs = [&](const auto& entry) {
    return !has_comparable_times(*entry.second, cell.first());
  };
  const auto other = std::find_if(cell.blocks.begin(), cell.blocks.end(), differs);
  if (other == cell.blocks.end()) return {};
  const RunRow &a = cell.first(), &b = *other->second;
  if (a.machine == b.machine) {
    return fmt::format("no times: measured on {} and on {} threads", a.threads, b.threads);
  }
  return fmt::format("no times: measured on several machines, \"{}\" and \"{}\"", a.machine,
                     b.machine);
}

std::string fault_of(const RunRow& run) {
  if (run.status == RunStatus::Failed) return run.failure.empty() ? "failed" : run.failure;
  if (run.nonfinite > 0) return fmt::format("{} pixels not finite", run.nonfinite);
  if (!is_number(run.mse) || !is_number(run.mean_error)) return "no finite error";
  if (!is_number(run.time_wall_s) || !is_number(run.time_cpu_s)) return "no time";
  return {};
}

std::string fault_of(const MeasuredCell& cell) {
  int faults = 0;
  std::string first;
  for (const auto& [block, run] : cell.blocks) {
    const std::string fault = fault_of(*run);
    if (fault.empty()) continue;
    if (faults++ == 0) first = fmt::format("run {}: {}", run->run_id, fault);
  }
  if (faults == 0) return {};
  return fmt::format("{} of {} runs failed, {}", faults, cell.blocks.size(), first);
}

}  // namespace penumbra
