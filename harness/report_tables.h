#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "harness/aggregate.h"
#include "harness/curves.h"
#include "harness/efficiency.h"

/// Everything that is worked out of the rows of runs, and its files. Knows rows only, so that a
/// report is made again without the experiment.
namespace penumbra {

struct ReportTables {
  TableOptions options;
  std::vector<EfficiencyRow> efficiency;
  Curves curves;                        ///< empty without several budgets
  std::vector<AggregateRow> aggregate;  ///< empty where there is nothing but the baseline
  std::vector<EcdfRow> ecdf;
};

/// @throws InputError, ReferenceError as measured_cells
ReportTables make_tables(std::span<const RunRow> rows, const TableOptions& options);

/// Writes efficiency.csv, .md, .tex and .json, curves.csv, curve_points.csv, aggregate.csv and
/// ecdf.csv, each as a whole. Tables without rows have their header line, so that an older file
/// never stays behind.
/// @param folder  exists
/// @throws RunError when a file cannot be written
void write_tables(const std::filesystem::path& folder, const ReportTables& tables);

/// All tables as one Markdown document, and for a terminal.
std::string to_markdown(const ReportTables& tables);
std::string to_terminal(const ReportTables& tables);

}  // namespace penumbra
