#include "harness/report_tables.h"

#include "harness/atomic_file.h"
#include "harness/table_text.h"

namespace penumbra {

ReportTables make_tables(std::span<const RunRow> rows, const TableOptions& options) {
  ReportTables tables;
  tables.options = options;
  tables.efficiency = efficiency_table(rows, options);
  return tables;
}

void write_tables(const std::filesystem::path& folder, const ReportTables& tables) {
  write_file_atomically(folder / "efficiency.csv", to_csv(tables.efficiency));
  write_file_atomically(folder / "efficiency.md", to_markdown(tables));
}

std::string to_markdown(const ReportTables& tables) {
  return to_markdown(tables.efficiency, tables.options);
}

std::string to_terminal(const ReportTables& tables) {
  return to_terminal(tables.efficiency, tables.options);
}

}  // namespace penumbra
