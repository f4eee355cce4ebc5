#include "harness/report.h"

#include <fmt/format.h>

#include "harness/commands/commands.h"
#include "harness/progress.h"

namespace penumbra {

void show_report(const Report& report) {
  fmt::print("{}", to_terminal(report.tables));
  if (report.stale_rows > 0) {
    note(
        fmt::format("{} rows are of cells that the config no longer has; they stay in "
                    "measurements.csv and are left out of the tables",
                    report.stale_rows));
  }
}

int report_command(const std::filesystem::path& folder) {
  const Report report = make_report(folder);
  write_tables(folder, report.tables);
  show_report(report);
  fmt::print("table: {}\n", (folder / "efficiency.md").string());
  return kSuccess;
}

}  // namespace penumbra
