#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/measured_cells.h"
#include "harness/run_row.h"

/// From the rows of runs to the efficiency table: cells, ratios, verdicts.
/// Source: statistics.md 3.1 and 3.2.
namespace penumbra {

struct TableOptions {
  std::string baseline;                       ///< label; within scene, sampler and budget
  std::optional<std::string> tuned_baseline;  ///< label; within scene and budget
  double confidence{0.95};
  /// Decides `ratio` and the verdict. CPU time is the default because on a shared machine the wall
  /// time is unusable whatever the statistics: for one workload against itself, in interleaved
  /// blocks, the log ratio of wall times spread by 0.14 to 0.21, that of CPU times by 0.03
  /// (statistics.md 3.3).
  PrimaryTime primary{PrimaryTime::Cpu};
  double relmse_epsilon{0.01};      ///< of the raw rows' relmse; printed
  std::vector<std::string> scenes;  ///< order of the table; others follow by name
  std::vector<std::string> labels;
  /// A publication's efficiencies, [label][scene], in any unit that is the same for all labels.
  std::map<std::string, std::map<std::string, double>> published;
  std::string published_source;  ///< printed below the table
};

/// A cell whose adjusted bias_p is this small is called biased.
inline constexpr double kBiasLevel = 0.01;

inline bool is_biased(const EfficiencyRow& row) {
  return row.bias_p_holm.has_value() && *row.bias_p_holm <= kBiasLevel;
}

/// One row per cell (measured_cells.h). Where several cells carry the baseline's label, the one
/// with the same SRL and SPP is meant; where that is not one cell, there is no ratio and the note
/// says so. A failed or non-finite run fails its cell.
/// @throws InputError, ReferenceError as measured_cells
std::vector<EfficiencyRow> efficiency_table(std::span<const RunRow> rows,
                                            const TableOptions& options);

}  // namespace penumbra
