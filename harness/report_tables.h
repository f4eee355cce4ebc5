#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "harness/efficiency.h"

/// Everything that is worked out of the rows of runs, and its files. Knows rows only, so that a
/// report is made again without the experiment.
namespace penumbra {

struct ReportTables {
  TableOptions options;
  std::vector<EfficiencyRow> efficiency;
};

/// @throws InputError, ReferenceError as measured_cells
ReportTables make_tables(std::span<const RunRow> rows, const TableOptions& options);

/// Writes efficiency.csv and efficiency.md, each as a whole.
/// @param folder  exists
/// @throws RunError when a file cannot be written
void write_tables(const std::filesystem::path& folder, const ReportTables& tables);

/// All tables as one Markdown document, and for a terminal.
std::string to_markdown(const ReportTables& tables);
std::string to_terminal(const ReportTables& tables);

}  // namespace penumbra
