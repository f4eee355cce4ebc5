#include "harness/report_tables.h"

#include "harness/atomic_file.h"
#include "harness/report_text.h"
#include "harness/table_json.h"
#include "harness/table_latex.h"
#include "harness/table_text.h"

namespace penumbra {
namespace {

/// A blank line before what is there.
std::string section(const std::string& text) { return text.empty() ? text : "\n" + text; }

}  // namespace

ReportTables make_tables(std::span<const RunRow> rows, const TableOptions& options) {
  ReportTables tables;
  tables.options = options;
  tables.efficiency = efficiency_table(rows, options);
  tables.curves = error_curves(rows, options);
  tables.ecdf = time_to_target_ecdf(tables.curves, options);
  tables.aggregate = aggregate_over_scenes(tables.efficiency, tables.ecdf, options);
  return tables;
}

void write_tables(const std::filesystem::path& folder, const ReportTables& tables) {
  const auto write = [&](const char* name, const std::string& text) {
    write_file_atomically(folder / name, text);
  };
  write("efficiency.csv", to_csv(tables.efficiency));
  write("efficiency.md", to_markdown(tables));
  write("efficiency.tex", to_latex(tables.efficiency, tables.options));
  write("efficiency.json", to_json(tables.efficiency, tables.options));
  write("curves.csv", to_csv(tables.curves.rows));
  write("curve_points.csv", to_csv(tables.curves.points));
  write("aggregate.csv", to_csv(tables.aggregate));
  write("ecdf.csv", to_csv(tables.ecdf));
}

std::string to_markdown(const ReportTables& tables) {
  const TableOptions& options = tables.options;
  return to_markdown(tables.efficiency, options) +
         section(aggregate_markdown(tables.aggregate, options)) +
         section(curves_markdown(tables.curves.rows, options));
}

std::string to_terminal(const ReportTables& tables) {
  const TableOptions& options = tables.options;
  return to_terminal(tables.efficiency, options) +
         section(aggregate_terminal(tables.aggregate, options)) +
         section(curves_terminal(tables.curves.rows, options));
}

}  // namespace penumbra
