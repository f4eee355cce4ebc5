#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/table_columns.h"

namespace penumbra {

/// Where the time of a cell's estimates goes, as a line of stages.csv: measured on one thread on a
/// part of the image (stage_shares.h), which the rows of runs are not.
struct StageRow {
  std::string scene, label, estimator, sampler, params;
  int spp{0};  ///< of the cell; the part has as many where its time allows
  int srl{0};  ///< shadow rays per light, both stages
  int srl_initial{0};
  int srl_adaptive{0};
  std::optional<std::int64_t> population;
  std::optional<double> budget_s;
  std::string cell;   ///< id
  double ns{0};       ///< CPU time per estimate
  double rays{0};     ///< traced, per estimate
  double samples{0};  ///< drawn, per estimate
  /// Shares of `ns`, which add up to one. See EstimateStage.
  double trace{0}, sample{0}, weigh{0}, adapt{0}, set_up{0}, outside{0};

  friend bool operator==(const StageRow&, const StageRow&) = default;
};

/// The whole of stages.csv.
std::string to_csv(std::span<const StageRow> rows);

/// The columns with their units, for other forms of the table.
std::span<const Column<StageRow>> stage_table_columns();

/// Reads stages.csv. @throws InputError as read_csv and rows_of, and when the last line is
/// incomplete
std::vector<StageRow> read_stage_rows(const std::filesystem::path& file);

}  // namespace penumbra
