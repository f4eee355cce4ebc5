#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "estimators/estimator.h"
#include "harness/config.h"
#include "harness/render.h"
#include "harness/scene_store.h"

/// From sweeps to cells, and the frozen sample counts of each.
namespace penumbra {

/// One (scene, method, parameters, sampler, budget): a row of the table, measured once in every
/// block.
struct Cell {
  std::string id;        ///< hash of all below but the numbers that a budget solves for
  std::size_t scene{0};  ///< index in ExperimentConfig::scenes
  std::string label;
  const EstimatorEntry* estimator{nullptr};
  ParamSet params;
  std::string params_text;  ///< parameters other than their defaults
  SamplerKind sampler{SamplerKind::Independent};
  Srl srl;  ///< with the split that is used
  int spp{1};
  std::optional<double> budget_time;  ///< of BudgetConfig::times: seconds or a multiple
  std::optional<double> budget_s;     ///< CPU time to meet; of a matched time once it is measured
  std::vector<std::string> tags;

  Budget budget() const { return {sampler, srl.initial, srl.adaptive}; }
};

/// The split of a total for an estimator: unchanged where nothing adapts, otherwise 1:3 with at
/// least two initial rays, the paper's 4-12.
Srl split_srl(int total, bool adaptive);

/// Another total, split as the given one.
Srl scaled_srl(const Srl& srl, int total);

/// All cells of an experiment in the order of the config: scenes, methods, their combinations
/// (sweep.h), budgets.
/// @throws InputError when an estimator refuses its parameters for a scene
std::vector<Cell> expand_cells(const ExperimentConfig& config,
                               const std::vector<LoadedScene>& scenes);

/// Runs one cell once.
RenderSettings render_settings(const Cell& cell, std::uint64_t seed, int threads);

/// Seed of a run: independent for every cell and block.
std::uint64_t run_seed(const ExperimentConfig& config, const Cell& cell, int block);

/// What the pilots found for one cell; kept in plan.lock.json.
struct PlannedCell {
  std::string id;
  int spp{1};
  Srl srl;
  double fixed_s{0};  ///< T(n) = fixed_s + per_unit_s n, CPU time, n the number solved for
  double per_unit_s{0};
  double predicted_s{0};  ///< CPU time of one run
  std::optional<double> budget_s;
  std::optional<double> p_eff;  ///< effective pixels of one pilot, from the difference of two; only
                                ///< in memory

  friend bool operator==(const PlannedCell&, const PlannedCell&) = default;
};

/// The content of plan.lock.json.
struct PlanFile {
  std::string machine;              ///< that the pilots ran on
  std::optional<int> core_version;  ///< kCoreVersion of the plan's build; files of older versions
                                    ///< lack it, and the hashes
  std::map<std::string, std::string> scene_hashes;  ///< Scene::content_hash by scene name
  std::vector<PlannedCell> cells;
};

/// Writes plan.lock.json, whole or not at all.
/// @param cells  the plan's, in its order
void write_plan(const std::filesystem::path& file, const std::vector<LoadedScene>& scenes,
                const std::vector<Cell>& cells, const std::vector<PlannedCell>& plan);

/// Reads plan.lock.json, of any machine.
/// @throws InputError when it can not be read
PlanFile read_plan_file(const std::filesystem::path& file);

/// The planned cells of a file, to measure more of them.
/// @throws ReferenceError when cells have a time budget and the file was made on another machine: a
///         calibration is not portable
/// @throws InputError when it can not be read
std::vector<PlannedCell> read_plan(const std::filesystem::path& file);

/// Puts the frozen numbers into the cells.
/// @throws InputError when a cell is not in the plan
void apply_plan(const std::vector<PlannedCell>& plan, std::vector<Cell>& cells);

}  // namespace penumbra
