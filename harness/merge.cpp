#include "harness/merge.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "harness/row_parts.h"
#include "scenes/core/error.h"
#include "scenes/core/file_bytes.h"

namespace penumbra {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// What may differ between shards: it says nothing of a row's numbers.
constexpr const char* kFreeKeys[] = {"$schema", "summary", "threads"};

json compared_config(const ExperimentConfig& config) {
  json result = json::parse(config.resolved_json);
  for (const char* key : kFreeKeys) result.erase(key);
  // Where a scene lies is another matter than what it is: the plan has hashes of that.
  for (json& scene : result.at("scenes")) scene.erase("file");
  return result;
}

// Machine and commit of the program that made the plan are compared by the rows.
std::string compared_plan(const fs::path& file) {
  json plan = json::parse(read_bytes(file));
  plan.erase("machine");
  plan.erase("commit");
  return plan.dump();
}

[[noreturn]] void refuse(const ShardFolder& a, const ShardFolder& b, const std::string& what) {
  throw ReferenceError(
      fmt::format("{} and {} cannot be merged: {}", a.folder.string(), b.folder.string(), what));
}

// The first place where two documents differ: "/blocks is 3 and 4".
std::string difference(const json& a, const json& b) {
  const json patch = json::diff(a, b);
  const std::string place = patch.at(0).at("path");
  const auto at = [&](const json& document) {
    const json::json_pointer pointer(place);
    return document.contains(pointer) ? document.at(pointer).dump() : "missing";
  };
  return fmt::format("{} is {} and {}", place, at(a), at(b));
}

/// A value that all rows of all shards must share.
class Shared {
 public:
  explicit Shared(std::string what) : what_(std::move(what)) {}
  void see(const ShardFolder& shard, const std::string& value) {
    if (first_ == nullptr) {
      first_ = &shard;
      value_ = value;
    } else if (value != value_) {
      refuse(*first_, shard, fmt::format("{} \"{}\" and \"{}\"", what_, value_, value));
    }
  }

 private:
  std::string what_;
  const ShardFolder* first_{nullptr};
  std::string value_;
};

// The truth that a row was measured against, to the last digit.
std::string reference_text(const RunRow& row) {
  return fmt::format("{} ({} spp, mean {}, noise {})", row.reference_id,
                     csv_text(row.reference_spp), csv_text(row.reference_mean),
                     csv_text(row.reference_floor));
}

// What depends on time and place alone.
RunRow without_times(RunRow row) {
  row.time_wall_s = row.time_cpu_s = row.time_prepare_s = std::nullopt;
  row.instructions.reset();
  row.threads = row.order = 0;
  row.load_average = row.steal_share = std::nullopt;
  row.switches_voluntary = row.switches_involuntary = std::nullopt;
  row.contaminated.clear();
  row.machine.clear();
  row.host.clear();
  return row;
}

// "block is 1 and 2"
std::string differing_column(const RunRow& a, const RunRow& b) {
  const CsvRecord names = run_columns(), left = run_record(a), right = run_record(b);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (left[i] != right[i]) return fmt::format("{} is {} and {}", names[i], left[i], right[i]);
  }
  return {};
}

}  // namespace

ShardFolder read_shard(const fs::path& folder) {
  ShardFolder shard;
  shard.folder = folder;
  for (const char* name : {"config.resolved.json", "plan.lock.json", "measurements.csv"}) {
    if (fs::exists(folder / name)) continue;
    throw InputError((folder / name).string() +
                     ": is missing; expected the folder of a `penumbra run`");
  }
  shard.config = load_config(folder / "config.resolved.json");
  shard.plan = read_plan_file(folder / "plan.lock.json");
  shard.plan_text = compared_plan(folder / "plan.lock.json");
  join_row_parts(folder);  // of ranks that were stopped
  shard.rows = read_run_rows(row_file(folder)).rows;
  std::set<std::string> planned;
  for (const PlannedCell& cell : shard.plan.cells) planned.insert(cell.id);
  // As in a report, rows of cells that the config no longer has do not count.
  std::erase_if(shard.rows, [&](const RunRow& row) { return planned.count(row.cell) == 0; });
  return shard;
}

void check_compatible(const std::vector<ShardFolder>& shards) {
  const ShardFolder& first = shards.front();
  Shared build("rows are of builds");
  Shared machine("the config has a time budget, and rows were measured on machines");
  Shared threads("the config has a time budget, and rows were measured with numbers of threads");
  std::map<std::string, Shared> references;  // by scene
  for (const ShardFolder& shard : shards) {
    const json config = compared_config(first.config), other = compared_config(shard.config);
    if (config != other) refuse(first, shard, "their configs differ: " + difference(config, other));
    if (shard.plan_text != first.plan_text) {
      refuse(first, shard,
             "their plans differ: " +
                 difference(json::parse(first.plan_text), json::parse(shard.plan_text)));
    }
    for (const RunRow& row : shard.rows) {
      build.see(shard, row.build);
      const auto reference =
          references.try_emplace(row.scene, "scene \"" + row.scene + "\" has the references");
      reference.first->second.see(shard, reference_text(row));
      if (!row.budget_s) continue;
      machine.see(shard, row.machine);
      threads.see(shard, std::to_string(row.threads));
    }
  }
}

std::vector<RunRow> merged_rows(const std::vector<ShardFolder>& shards) {
  std::map<std::string, std::pair<const ShardFolder*, const RunRow*>> seen;  // by run_id
  std::vector<RunRow> rows;
  for (const ShardFolder& shard : shards) {
    for (const RunRow& row : shard.rows) {
      const auto [place, added] = seen.try_emplace(row.run_id, &shard, &row);
      if (added) {
        rows.push_back(row);
        continue;
      }
      const std::string column =
          differing_column(without_times(*place->second.second), without_times(row));
      if (column.empty()) continue;
      refuse(*place->second.first, shard, fmt::format("run {} differs: {}", row.run_id, column));
    }
  }
  sort_rows(rows);
  return rows;
}

std::string missing_blocks(const ShardFolder& any, const std::vector<RunRow>& rows) {
  std::set<std::pair<std::string, int>> done;
  for (const RunRow& row : rows) done.emplace(row.cell, row.block);
  std::map<std::size_t, std::vector<int>> blocks;  // by number of missing runs
  for (int block = 0; block < any.config.blocks; ++block) {
    const auto missing = static_cast<std::size_t>(
        std::count_if(any.plan.cells.begin(), any.plan.cells.end(), [&](const PlannedCell& cell) {
          return done.count({cell.id, block}) == 0;
        }));
    if (missing > 0) blocks[missing].push_back(block);
  }
  std::string text;
  for (const auto& [missing, list] : blocks) {
    std::string numbers;
    for (const int block : list) numbers += fmt::format("{}{}", numbers.empty() ? "" : ", ", block);
    text += fmt::format("{}block{} {}: {} of {} runs", text.empty() ? "" : "; ",
                        list.size() > 1 ? "s" : "", numbers, missing, any.plan.cells.size());
  }
  return text;
}

}  // namespace penumbra
