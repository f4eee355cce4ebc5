#include "harness/report.h"

#include <fmt/format.h>

#include "harness/commands/commands.h"
#include "harness/page/page.h"
#include "harness/progress.h"
#include "harness/table_json.h"

namespace penumbra {

void show_report(const Report& report, bool json) {
  fmt::print("{}", json ? to_json(report.tables.efficiency, report.tables.options)
                        : to_terminal(report.tables));
  for (const std::string& missing : report.missing) warn(missing);
  if (report.stale_rows > 0) {
    note(
        fmt::format("{} rows are of cells that the config no longer has; they stay in "
                    "measurements.csv and are left out of the tables",
                    report.stale_rows));
  }
}

int report_command(const ReportOptions& options) {
  const std::filesystem::path& folder = options.folder;
  const Report report = make_report(folder, ReplicatePictures::Write);
  if (report.is_run) write_tables(folder, report.tables);  // the page names their sizes
  const std::filesystem::path page = write_page(folder, report, {options.embed});
  if (!report.is_run) {
    fmt::print("report: {}\n", page.string());
    return kSuccess;
  }
  show_report(report, options.json);
  if (options.json) return kSuccess;
  fmt::print("table: {}\nreport: {}\n", (folder / "efficiency.md").string(), page.string());
  return kSuccess;
}

}  // namespace penumbra
