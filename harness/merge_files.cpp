#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <string>

#include "harness/atomic_file.h"
#include "harness/build_info.h"
#include "harness/merge.h"
#include "harness/row_parts.h"
#include "harness/shell_words.h"
#include "harness/stage_table.h"
#include "scenes/core/error.h"
#include "scenes/core/file_bytes.h"

/// The files of a merged folder.
namespace penumbra {
namespace {

namespace fs = std::filesystem;

// A folder that vanishes unless it is given its final name.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(fs::path final_name) : final_name_(std::move(final_name)) {
    path_ = fmt::format("{}.tmp-{}", final_name_.string(), ::getpid());
    std::error_code error;
    fs::create_directories(path_, error);
    if (error) throw RunError(path_.string() + ": cannot be created: " + error.message());
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }

  const fs::path& path() const { return path_; }

  void publish() {
    fs::rename(path_, final_name_);
    path_.clear();
  }

 private:
  fs::path final_name_, path_;
};

std::string optional_bytes(const fs::path& file) {
  return fs::exists(file) ? read_bytes(file) : std::string();
}

// Pictures of a shard's own runs together; the report makes them again of all runs.
bool is_of_the_shard(const fs::path& file) {
  return file.filename().string().ends_with("-stddev.exr");
}

// Of files that several shards have, all must have the same bytes.
void join_pictures(const std::vector<ShardFolder>& shards, const char* name, const fs::path& out) {
  std::map<std::string, fs::path> sources;  // by name
  for (const ShardFolder& shard : shards) {
    if (!fs::is_directory(shard.folder / name)) continue;
    for (const fs::directory_entry& entry : fs::directory_iterator(shard.folder / name)) {
      const fs::path& file = entry.path();
      if (!entry.is_regular_file() || is_of_the_shard(file)) continue;
      const auto [place, added] = sources.try_emplace(file.filename().string(), file);
      if (!added && read_bytes(place->second) != read_bytes(file)) {
        throw ReferenceError(fmt::format("{} and {} differ: one of them is of another run",
                                         place->second.string(), file.string()));
      }
    }
  }
  if (sources.empty()) return;
  fs::create_directories(out / name);
  for (const auto& [file_name, source] : sources) {
    fs::copy_file(source, out / name / file_name);
  }
}

// Commands in them name the folder.
std::string joined_events(const std::vector<ShardFolder>& shards, const fs::path& out) {
  std::string events;
  for (const ShardFolder& shard : shards) {
    std::string text = optional_bytes(shard.folder / "events.txt");
    const std::string begin = "penumbra replay ", end = " --row ";
    for (auto at = text.find(begin); at != std::string::npos; at = text.find(begin, at + 1)) {
      const auto from = at + begin.size();
      const auto to = text.find(end, from);
      if (to == std::string::npos) break;
      text.replace(from, to - from, shell_quoted(fs::absolute(out).string()));
    }
    events += text;
  }
  return events;
}

// Of each cell that the plan has, in its order. Of several measurements the first.
std::string joined_stages(const std::vector<ShardFolder>& shards) {
  std::vector<StageRow> all, rows;
  for (const ShardFolder& shard : shards) {
    const fs::path file = shard.folder / "stages.csv";
    if (!fs::exists(file)) continue;
    for (StageRow& row : read_stage_rows(file)) all.push_back(std::move(row));
  }
  for (const PlannedCell& cell : shards.front().plan.cells) {
    const auto found = std::find_if(all.begin(), all.end(),
                                    [&](const StageRow& row) { return row.cell == cell.id; });
    if (found != all.end()) rows.push_back(*found);
  }
  return rows.empty() ? std::string() : to_csv(rows);
}

std::string environment_of(const std::vector<ShardFolder>& shards, const std::vector<RunRow>& rows,
                           const std::string& command_line) {
  std::vector<std::string> parts;
  parts.reserve(shards.size());
  for (const ShardFolder& shard : shards) {
    parts.push_back(optional_bytes(shard.folder / "environment.json"));
  }
  const int threads = rows.empty() ? 0 : rows.front().threads;
  return joined_environment(
      parts, {threads, command_line, shards.front().config.resolved_json, {}, {}, {}});
}

}  // namespace

void write_merged(const std::vector<ShardFolder>& shards, const std::vector<RunRow>& rows,
                  const fs::path& out, const std::string& command_line) {
  TemporaryFolder folder(out);
  const ShardFolder& first = shards.front();
  try {
    fs::create_directories(folder.path() / "images");
    fs::copy_file(first.folder / "config.resolved.json", folder.path() / "config.resolved.json");
    fs::copy_file(first.folder / "plan.lock.json", folder.path() / "plan.lock.json");
    std::string table = csv_line(run_columns());
    for (const RunRow& row : rows) table += csv_line(run_record(row));
    write_file_atomically(row_file(folder.path()), table);
    const std::string stages = joined_stages(shards);
    if (!stages.empty()) write_file_atomically(folder.path() / "stages.csv", stages);
    const std::string events = joined_events(shards, out);
    if (!events.empty()) write_file_atomically(folder.path() / "events.txt", events);
    write_file_atomically(folder.path() / "environment.json",
                          environment_of(shards, rows, command_line));
    join_pictures(shards, "images", folder.path());
    join_pictures(shards, "runs", folder.path());
    folder.publish();
  } catch (const fs::filesystem_error& error) {
    throw RunError(out.string() + ": cannot be written: " + error.what());
  }
}

}  // namespace penumbra
