#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "harness/csv.h"
#include "harness/run_row.h"

namespace penumbra {

/// A row without what depends on the clock, the load and the machine's cores.
inline RunRow timeless(RunRow row) {
  row.time_wall_s.reset();
  row.time_cpu_s.reset();
  row.time_prepare_s.reset();
  row.instructions.reset();
  row.threads = 0;
  row.load_average.reset();
  row.steal_share.reset();
  row.switches_voluntary.reset();
  row.switches_involuntary.reset();
  row.contaminated.clear();
  return row;
}

/// First attempts by run_id as `timeless`, as text. Other load on the machine flags a run, which is
/// then tried again.
inline std::map<std::string, std::string> timeless_rows(const std::filesystem::path& file) {
  std::map<std::string, std::string> result;
  for (const RunRow& row : read_run_rows(file).rows) {
    if (row.attempt == 0) result[row.run_id] = csv_line(run_record(timeless(row)));
  }
  return result;
}

}  // namespace penumbra
