#pragma once

#include <filesystem>
#include <vector>

#include "harness/config.h"
#include "harness/report_tables.h"
#include "harness/stage_table.h"

/// A report from the raw rows of a result folder. Nothing is measured, and no scene is loaded.
namespace penumbra {

/// What a folder's rows say.
struct Report {
  ExperimentConfig config;
  std::vector<RunRow> rows;  ///< of the cells that the folder's plan has
  ReportTables tables;
  std::vector<StageRow> stages;      ///< where the time of the cells' estimates goes
  std::size_t stale_rows{0};         ///< of other cells: left out
  bool is_run{true};                 ///< otherwise a folder of the stability suite alone
  std::vector<std::string> missing;  ///< files that are not there or cannot be read, and what that
                                     ///< means, in words
};

/// How an experiment's tables are made.
TableOptions table_options(const ExperimentConfig& config);

/// What becomes of the standard deviation and bias of pictures of single runs.
enum class ReplicatePictures {
  Write,  ///< as images/...-stddev.exr: they are at hand here, and large
  Leave,  ///< nothing is written
};

/// Reads a result folder: config.resolved.json, plan.lock.json, measurements.csv, stages.csv and,
/// where they are, the pictures of single runs. A file that is missing or malformed is named in
/// Report::missing, and the rest is reported.
/// @throws InputError when the folder has none of the files
Report make_report(const std::filesystem::path& folder, ReplicatePictures pictures);

}  // namespace penumbra
