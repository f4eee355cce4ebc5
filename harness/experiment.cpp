#include "harness/experiment.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <csignal>
#include <set>

#include "harness/build_info.h"
#include "harness/calibration.h"
#include "harness/progress.h"
#include "harness/render.h"
#include "harness/shell_words.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int) { stop_requested = 1; }

// Times a stage from construction to destruction.
class Stage {
 public:
  Stage(std::vector<StageTime>& stages, std::string name)
      : stages_(stages), name_(std::move(name)) {}
  ~Stage() { stages_.push_back({name_, watch_.wall_s()}); }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

 private:
  std::vector<StageTime>& stages_;
  std::string name_;
  Stopwatch watch_;
};

}  // namespace

void handle_interrupts() {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
}

bool interrupted() { return stop_requested != 0; }

bool matches_glob(const std::string& glob, const std::string& name) {
  return fnmatch(glob.c_str(), name.c_str(), 0) == 0;
}

Experiment::Experiment(ExperimentConfig config, RunOptions options)
    : config_(std::move(config)),
      options_(std::move(options)),
      ranks_(options_.ranks != nullptr ? *options_.ranks : single_rank()),
      threads_(resolve_threads(config_.threads)) {
  place_this_rank();
  {
    const Stage stage(stages_, "scenes and shading points");
    for (const SceneConfig& scene : config_.scenes)
      scenes_.push_back(load_scene(scene, config_.tile, config_.quantity));
  }
  cells_ = expand_cells(config_, scenes_);
  select_cells();
  references_.resize(scenes_.size());
}

// Before there are threads, which take over the cores that the process is bound to.
void Experiment::place_this_rank() {
  if (!ranks_.is_launched()) return;
  places_ = place_ranks(ranks_, config_.threads == 0);
  if (config_.threads == 0) threads_ = places_.threads;
}

void Experiment::select_cells() {
  std::erase_if(cells_, [&](const Cell& cell) { return !options_.scenes.has(cell.scene); });
  if (!options_.only.empty()) {
    std::erase_if(cells_, [&](const Cell& cell) {
      return !matches_glob(options_.only, config_.scenes[cell.scene].name + "/" + cell.label + "/" +
                                              std::string(to_string(cell.sampler)));
    });
    if (cells_.empty()) throw InputError("--only \"" + options_.only + "\" matches no cell");
  }
  if (!options_.tag.empty()) {
    std::erase_if(cells_, [&](const Cell& cell) {
      return std::find(cell.tags.begin(), cell.tags.end(), options_.tag) == cell.tags.end();
    });
    if (cells_.empty()) throw InputError("--tag \"" + options_.tag + "\" matches no cell");
  }
}

RunOutcome Experiment::run() {
  RunOutcome outcome;
  if (build_info().asserts && ranks_.is_root()) warn("debug assertions are on: times mean nothing");
  open_folder();
  {
    const Stage stage(stages_, "references");
    provide_references();
  }
  {
    const Stage stage(stages_, "pilots and plan");
    provide_plan();
  }
  {
    const Stage stage(stages_, "blocks");
    run_blocks(outcome);
  }
  if (!outcome.interrupted) {
    const Stage stage(stages_, "where the time goes");
    measure_stages();
    ranks_.barrier();  // pictures of other ranks would disturb its times
  }
  if (!outcome.interrupted) {
    const Stage stage(stages_, "pictures");
    write_pictures();
    ranks_.barrier();
  }
  return outcome;
}

void Experiment::provide_references() {
  std::set<std::size_t> needed;
  for (const Cell& cell : cells_) needed.insert(cell.scene);
  for (const std::size_t s : needed) {
    references_[s] = provide_reference(scenes_[s], threads_, 0, ranks_);
    note(describe(scenes_[s].config->name, *references_[s]));
  }
}

// Puts the given plans together.
void Experiment::adopt_plans(const std::filesystem::path& file) const {
  if (options_.plans.empty()) return;
  std::map<std::string, PlannedCell> given;
  for (const std::filesystem::path& part : options_.plans) {
    for (PlannedCell& cell : read_plan(part)) given.emplace(cell.id, std::move(cell));
  }
  std::vector<Cell> cells;
  std::vector<PlannedCell> plan;
  for (const Cell& cell : expand_cells(config_, scenes_)) {
    const auto found = given.find(cell.id);
    if (found == given.end()) {
      throw ReferenceError(fmt::format(
          "{}: no cell \"{}\" of scene \"{}\" ({}): of another config, or not the plans "
          "of all scenes",
          options_.plans.front().string(), cell.label, config_.scenes[cell.scene].name, cell.id));
    }
    plan.push_back(found->second);
    cells.push_back(cell);
  }
  if (std::filesystem::exists(file) && read_plan(file) != plan) {
    throw ReferenceError(file.string() + ": is another plan than " +
                         options_.plans.front().string() + "; use another --out");
  }
  write_plan(file, scenes_, cells, plan);
}

// A plan covers all cells of the config, so that --only can change between calls. Cells that it
// has keep their numbers; those that are new are measured, by the root. Shards must not pilot for
// themselves: their cells would have other numbers.
void Experiment::provide_plan() {
  const std::filesystem::path file = options_.out / "plan.lock.json";
  if (ranks_.is_root()) {
    adopt_plans(file);
    complete_plan(file);
  }
  ranks_.barrier();
  apply_plan(read_plan(file), cells_);
}

void Experiment::complete_plan(const std::filesystem::path& file) const {
  const std::vector<Cell> all = expand_cells(config_, scenes_);
  std::map<std::string, PlannedCell> known;
  if (std::filesystem::exists(file)) {
    for (PlannedCell& cell : read_plan(file)) known.emplace(cell.id, std::move(cell));
  }
  std::vector<Cell> missing;
  std::map<std::size_t, double> matched_s;  // as the cells that are planned have it
  for (const Cell& cell : all) {
    const auto planned = known.find(cell.id);
    if (planned == known.end()) {
      missing.push_back(cell);
    } else if (planned->second.budget_s) {
      matched_s[cell.scene] = *planned->second.budget_s / *cell.budget_time;
    }
  }
  if (!missing.empty() || known.size() != all.size()) {
    std::vector<PlannedCell> found;
    if (config_.budget && !missing.empty()) {
      check_may_pilot();
      found = run_pilots(config_, scenes_, missing, matched_s);
    } else {
      for (const Cell& cell : missing)
        found.push_back({cell.id, cell.spp, cell.srl, 0, 0, 0, {}, {}});
    }
    for (PlannedCell& cell : found) known.emplace(cell.id, std::move(cell));
    std::vector<PlannedCell> plan;
    for (const Cell& cell : all) plan.push_back(known.at(cell.id));
    write_plan(file, scenes_, all, plan);
  }
}

void Experiment::check_may_pilot() const {
  if (options_.shard.is_all()) return;
  const std::string config = shell_quoted(config_.file.string());
  throw ReferenceError(fmt::format(
      "shards of a config with a time budget need one plan: make it with \"penumbra plan {} --lock "
      "plan.lock.json\" (and the same --set) and give it to every shard as --plan plan.lock.json",
      config));
}

}  // namespace penumbra
