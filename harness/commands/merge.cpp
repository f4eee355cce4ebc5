// merge: from the folders of shards to one.

#include "harness/merge.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/commands/commands.h"
#include "harness/page/page.h"
#include "harness/progress.h"
#include "harness/report.h"
#include "scenes/core/error.h"

namespace penumbra {

int merge_command(const MergeOptions& options) {
  if (std::filesystem::exists(options.out)) {
    throw InputError(options.out.string() + ": exists; merge makes a new folder");
  }
  std::vector<ShardFolder> shards;
  for (const std::filesystem::path& folder : options.folders) shards.push_back(read_shard(folder));
  check_compatible(shards);
  const std::vector<RunRow> rows = merged_rows(shards);
  const std::string missing = missing_blocks(shards.front(), rows);
  if (!missing.empty() && !options.partial) {
    throw ReferenceError("missing are " + missing +
                         "; give the folders of all shards, each run to its end, or merge what "
                         "there is with --partial");
  }
  if (!missing.empty()) warn("missing are " + missing);
  write_merged(shards, rows, options.out, options.command_line);

  const Report report = make_report(options.out, ReplicatePictures::Write);
  write_tables(options.out, report.tables);
  const std::filesystem::path page = write_page(options.out, report, {});
  show_report(report, options.json);
  if (!options.json) {
    fmt::print("\n{} runs of {} folders in {}\nreport: {}\ntable: {}\n", rows.size(), shards.size(),
               options.out.string(), page.string(), (options.out / "efficiency.md").string());
  }
  const bool failed = std::any_of(
      rows.begin(), rows.end(), [](const RunRow& row) { return row.status == RunStatus::Failed; });
  return failed ? kRunFailure : kSuccess;
}

}  // namespace penumbra
