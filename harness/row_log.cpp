#include "harness/row_log.h"

#include <vector>

#include "harness/keys.h"
#include "harness/progress.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

bool is_final(const RunRow& row) {
  return row.contaminated.empty() || row.status == RunStatus::Failed;
}

}  // namespace

std::string run_id(const Cell& cell, int block, int attempt) {
  const std::string number = std::to_string(block);
  const std::string spp = std::to_string(cell.spp);
  // The first attempt has the id of versions that knew no other.
  if (attempt == 0) return hash_id({"run", cell.id, number, spp, cell.srl.text()});
  return hash_id(
      {"run", cell.id, number, spp, cell.srl.text(), "attempt " + std::to_string(attempt)});
}

RowLog::RowLog(const std::filesystem::path& file, int attempts, const std::filesystem::path& part)
    : attempts_(attempts) {
  if (std::filesystem::exists(file)) {
    // Other ranks read the same file, which is whole then.
    if (part.empty() && truncate_torn_tail(file))
      note("a half-written last row was removed; it is measured again");
    for (RunRow& row : read_run_rows(file).rows) {
      const std::string id = row.run_id;
      rows_.emplace(id, std::move(row));
    }
  }
  writer_.emplace(part.empty() ? file : part, run_columns());
}

const RunRow* RowLog::find(const Cell& cell, int block, int attempt) const {
  const auto found = rows_.find(run_id(cell, block, attempt));
  return found == rows_.end() ? nullptr : &found->second;
}

std::optional<int> RowLog::next_attempt(const Cell& cell, int block) const {
  for (int attempt = 0; attempt < attempts_; ++attempt) {
    const RunRow* const row = find(cell, block, attempt);
    if (row == nullptr) return attempt;
    if (is_final(*row)) return std::nullopt;
  }
  return std::nullopt;
}

const RunRow& RowLog::last_row(const Cell& cell, int block) const {
  const RunRow* last = nullptr;
  for (int attempt = 0; attempt < attempts_; ++attempt) {
    const RunRow* const row = find(cell, block, attempt);
    if (row == nullptr) break;
    last = row;
  }
  PN_CHECK(last != nullptr, "the run is done");
  return *last;
}

void RowLog::append(const RunRow& row) {
  writer_->append(run_record(row));
  rows_.emplace(row.run_id, row);
}

}  // namespace penumbra
