#pragma once

#include <filesystem>
#include <vector>

#include "harness/config.h"
#include "harness/efficiency.h"

/// Tables from the raw rows of a result folder. Nothing is measured, and no scene is loaded.
namespace penumbra {

/// What a folder's rows say.
struct Report {
  ExperimentConfig config;
  TableOptions options;
  std::vector<RunRow> rows;          ///< of the cells that the folder's plan has
  std::vector<EfficiencyRow> table;  ///< in the config's order
  std::size_t stale_rows{0};         ///< of other cells: left out
};

/// How an experiment's tables are made.
TableOptions table_options(const ExperimentConfig& config);

/// Reads a result folder: config.resolved.json, plan.lock.json and measurements.csv.
/// @throws InputError when it is not a result folder, or a file in it cannot be read
Report make_report(const std::filesystem::path& folder);

/// Writes all tables into the folder, each whole or not at all.
void write_report(const Report& report, const std::filesystem::path& folder);

}  // namespace penumbra
