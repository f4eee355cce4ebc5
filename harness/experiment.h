#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/config.h"
#include "harness/mpi_ranks.h"
#include "harness/plan.h"
#include "harness/rank_places.h"
#include "harness/reference.h"
#include "harness/run_row.h"
#include "harness/stage_shares.h"
#include "harness/stage_table.h"
#include "harness/work_share.h"

/// Running an experiment: references, plan, blocks of runs with one appended row each, shares of
/// the stages of an estimate, pictures.
/// What the output folder already holds is not done again.
///
/// Work is spread over ranks and shards by whole pairs of blocks of a scene, so that everything
/// whose times are compared was measured on one host, within one block.
namespace penumbra {

struct RunOptions {
  std::filesystem::path out;
  std::string only;          ///< glob on "scene/label/sampler"; empty: all cells
  std::string tag;           ///< of methods; empty: all
  std::string command_line;  ///< for environment.json
  WorkShare shard;           ///< pairs of blocks, by scene, and pictures that are this call's
  WorkShare scenes;          ///< whose cells are kept
  std::vector<std::filesystem::path> plans;  ///< frozen ones (`penumbra plan --lock`)
  const Ranks* ranks{nullptr};               ///< that share the work; none: this process alone
};

/// How a run ended.
struct RunOutcome {
  int rows_measured{0};
  int rows_found{0};         ///< measured before
  int rows_failed{0};        ///< of all
  int rows_contaminated{0};  ///< whose last attempt was disturbed too
  bool interrupted{false};   ///< by SIGINT or SIGTERM, after the run that was under way
};

/// Time of each stage, in the order in which they were done.
struct StageTime {
  std::string name;
  double wall_s{0};
};

class Experiment {
 public:
  /// Loads the scenes; nothing is measured or written yet.
  Experiment(ExperimentConfig config, RunOptions options);

  const std::vector<Cell>& cells() const { return cells_; }
  const std::vector<LoadedScene>& scenes() const { return scenes_; }
  const ExperimentConfig& config() const { return config_; }

  /// References, plan, blocks, stages and pictures; tables are made of the rows (report.h).
  /// @throws InputError when the folder holds the results of another experiment
  RunOutcome run();

  /// By scene, of the scenes of the cells; empty before `run`.
  const std::vector<std::optional<Reference>>& references() const { return references_; }
  const std::vector<StageTime>& stages() const { return stages_; }

 private:
  void select_cells();
  void place_this_rank();
  void open_folder();
  void write_environment() const;
  void check_ranks() const;
  void provide_references();
  void provide_plan();
  void adopt_plans(const std::filesystem::path& file) const;
  void complete_plan(const std::filesystem::path& file) const;
  void check_may_pilot() const;
  void run_blocks(RunOutcome& outcome);
  void measure_blocks(RunOutcome& outcome);
  void sum_over_ranks(RunOutcome& outcome) const;
  bool has_run(const WorkShare& share, const Cell& cell, int block) const;
  WorkShare rank_share() const;
  void warm_up(const Cell& cell);
  RunRow measure(const Cell& cell, int block, int order, int attempt);
  void measure_stages();
  StageRow measure_stages_of(const Cell& cell, const StageWork& work) const;
  void write_pictures();
  void write_cell_pictures(const Cell& cell);
  void write_events(const RunRow& row, const Cell& cell, const RenderResult& result);
  std::filesystem::path image_file(const Cell& cell, const std::string& suffix) const;
  std::vector<std::size_t> block_order(int block) const;

  ExperimentConfig config_;
  RunOptions options_;
  const Ranks& ranks_;
  RankPlaces places_;  // of all ranks, where a launcher started them
  int threads_;
  std::vector<LoadedScene> scenes_;
  std::vector<Cell> cells_;
  std::vector<std::optional<Reference>> references_;  // [scene]
  std::vector<StageRow> stage_rows_;                  // of stages.csv
  std::vector<StageTime> stages_;
  bool warm_{false};
};

/// Whether pictures of a cell are made: of several budgets, for the largest only.
bool has_pictures(const ExperimentConfig& config, const Cell& cell);

/// Makes SIGINT and SIGTERM ask for an orderly end instead of killing the process.
void handle_interrupts();
bool interrupted();

/// Whether a name matches a glob with * and ?.
bool matches_glob(const std::string& glob, const std::string& name);

}  // namespace penumbra
