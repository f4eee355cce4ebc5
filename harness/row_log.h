#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "harness/csv.h"
#include "harness/plan.h"
#include "harness/run_row.h"

namespace penumbra {

/// Id of a run: the same for the same cell, block, frozen numbers and attempt.
std::string run_id(const Cell& cell, int block, int attempt);

/// measurements.csv as it grows: which runs are done, and which are to be tried again because
/// something disturbed their time.
class RowLog {
 public:
  /// Opens or creates the file; a half-written last line is removed and reported.
  /// @param attempts  at one run, at most
  /// @param part  what is appended to in place of `file`, which is only read; empty: `file` itself
  /// @throws InputError, RunError as CsvWriter
  RowLog(const std::filesystem::path& file, int attempts, const std::filesystem::path& part = {});

  /// The attempt to make next.
  /// @return nullopt when the run is done
  std::optional<int> next_attempt(const Cell& cell, int block) const;

  /// The last row of a run that is done.
  const RunRow& last_row(const Cell& cell, int block) const;

  /// Returns when the row is on disk.
  void append(const RunRow& row);

 private:
  const RunRow* find(const Cell& cell, int block, int attempt) const;

  int attempts_;
  std::map<std::string, RunRow> rows_;  // by run_id
  std::optional<CsvWriter> writer_;
};

}  // namespace penumbra
