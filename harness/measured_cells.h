#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "harness/run_row.h"
#include "harness/statistics.h"

/// The rows of runs, put together to cells. Everything that is worked out of rows starts here.
namespace penumbra {

/// One (scene, label, estimator, parameters, SPP, SRL, population, sampler, budget) with one run
/// per block. Not empty; points into the rows.
struct MeasuredCell {
  std::map<int, const RunRow*> blocks;
  int n_contaminated{0};       ///< of all attempts
  int contaminated_in_use{0};  ///< of `blocks`, where no attempt was clean

  /// Any run of it: what a cell's runs have in common.
  const RunRow& first() const { return *blocks.begin()->second; }

  /// Mean of a column over blocks. @return empty when a block lacks it
  template <class T>
  std::optional<double> mean_of(std::optional<T> RunRow::*member) const {
    Welford values;
    for (const auto& [block, run] : blocks) {
      if (!(run->*member)) return std::nullopt;
      values.add(static_cast<double>(*(run->*member)));
    }
    return values.mean();
  }
};

/// What tells cells apart, in the order in which they are listed.
inline auto cell_key(const RunRow& r) {
  return std::tie(r.scene, r.budget_s, r.sampler, r.label, r.estimator, r.srl, r.srl_initial,
                  r.srl_adaptive, r.population, r.spp, r.params);
}

/// Groups rows, whatever their order. Of several attempts at a block the first that failed counts
/// (a contamination explains a time, not a failure), else the first clean one, else the last.
/// @return in the order of cell_key
/// @throws InputError when an attempt at a block of a cell occurs twice
/// @throws ReferenceError when runs of one scene were measured against different references
std::vector<MeasuredCell> measured_cells(std::span<const RunRow> rows);

/// Whether times of two runs may be put together: same machine, same number of threads.
inline bool has_comparable_times(const RunRow& a, const RunRow& b) {
  return a.machine == b.machine && a.threads == b.threads;
}

/// @return why the times of the cell's runs say nothing together, in words; empty when they do
std::string time_fault_of(const MeasuredCell& cell);

/// @return why the run cannot be used; empty when it can
std::string fault_of(const RunRow& run);

/// @return "2 of 10 runs failed, run x: why"; empty when all can be used
std::string fault_of(const MeasuredCell& cell);

/// The time that decides: on a shared machine that of the CPU (efficiency.h).
enum class PrimaryTime { Cpu, Wall };

inline double primary_time(const RunRow& run, PrimaryTime primary) {
  return primary == PrimaryTime::Cpu ? *run.time_cpu_s : *run.time_wall_s;
}

}  // namespace penumbra
