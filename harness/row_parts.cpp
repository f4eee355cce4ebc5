#include "harness/row_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include "harness/csv.h"
#include "harness/progress.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPartPrefix = "measurements.rank-";

std::vector<fs::path> parts_of(const fs::path& folder) {
  std::vector<fs::path> parts;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(kPartPrefix) && name.ends_with(".csv")) parts.push_back(entry.path());
  }
  std::sort(parts.begin(), parts.end());
  return parts;
}

}  // namespace

fs::path row_file(const fs::path& folder) { return folder / "measurements.csv"; }

fs::path row_part(const fs::path& folder, int rank) {
  return folder / fmt::format("{}{}.csv", kPartPrefix, rank);
}

void sort_rows(std::vector<RunRow>& rows) {
  const auto place = [](const RunRow& row) {
    return std::tie(row.block, row.order, row.attempt, row.run_id);
  };
  std::sort(rows.begin(), rows.end(),
            [&](const RunRow& a, const RunRow& b) { return place(a) < place(b); });
}

std::size_t join_row_parts(const fs::path& folder) {
  const std::vector<fs::path> parts = parts_of(folder);
  if (parts.empty()) return 0;
  const fs::path file = row_file(folder);
  std::set<std::string> known;
  if (fs::exists(file)) {
    truncate_torn_tail(file);
    for (const RunRow& row : read_run_rows(file).rows) known.insert(row.run_id);
  }
  CsvWriter writer(file, run_columns());
  std::vector<RunRow> rows;
  for (const fs::path& part : parts) {
    if (truncate_torn_tail(part)) {
      note(part.filename().string() + ": a half-written last row was removed");
    }
    const CsvWriter lock(part, run_columns());  // fails where a rank still writes
    for (RunRow& row : read_run_rows(part).rows) {
      if (known.insert(row.run_id).second) rows.push_back(std::move(row));
    }
  }
  sort_rows(rows);
  for (const RunRow& row : rows) writer.append(run_record(row));
  for (const fs::path& part : parts) fs::remove(part);
  return rows.size();
}

}  // namespace penumbra
