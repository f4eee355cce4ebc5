#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/config.h"
#include "harness/plan.h"
#include "harness/run_row.h"

/// From the folders of shards (`run --shard`) to one folder, as a single run would have made it.
namespace penumbra {

/// What a shard's folder says of itself.
struct ShardFolder {
  std::filesystem::path folder;
  ExperimentConfig config;
  PlanFile plan;
  std::string plan_text;  ///< what has to be the same in all shards
  std::vector<RunRow> rows;
};

/// @throws InputError naming the file that is missing or malformed
ShardFolder read_shard(const std::filesystem::path& folder);

/// Whether results can be put together: config, plan, builds, references and, with a time budget,
/// machines and threads must be the same. Summary and threads of the config may differ, and the
/// place of a scene's file.
/// @param shards  at least one
/// @throws ReferenceError naming two folders and what differs between them
void check_compatible(const std::vector<ShardFolder>& shards);

/// The rows of all shards in the order of a single run. A run that several have must be the same
/// but for what depends on time and place, and is taken once.
/// @throws ReferenceError naming two folders and the column that differs
std::vector<RunRow> merged_rows(const std::vector<ShardFolder>& shards);

/// The blocks that lack the run of a cell: "blocks 2, 3: 8 of 8 runs; block 6: 1 of 4 runs".
/// @return empty when there are none
std::string missing_blocks(const ShardFolder& any, const std::vector<RunRow>& rows);

/// Writes the merged folder, whole or not at all, without tables.
/// @param out   must not exist
/// @throws ReferenceError when a picture differs between shards; RunError when it cannot be written
void write_merged(const std::vector<ShardFolder>& shards, const std::vector<RunRow>& rows,
                  const std::filesystem::path& out, const std::string& command_line);

}  // namespace penumbra
