#include "harness/experiment.h"

#include <fnmatch.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "harness/atomic_file.h"
#include "harness/build_info.h"
#include "harness/calibration.h"
#include "harness/progress.h"
#include "harness/render.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int) { stop_requested = 1; }

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

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
      threads_(resolve_threads(config_.threads)) {
  {
    const Stage stage(stages_, "scenes and shading points");
    for (const SceneConfig& scene : config_.scenes)
      scenes_.push_back(load_scene(scene, config_.tile, config_.quantity));
  }
  cells_ = expand_cells(config_, scenes_);
  select_cells();
  references_.resize(scenes_.size());
}

void Experiment::select_cells() {
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
  if (build_info().asserts) warn("debug assertions are on: times mean nothing");
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
  }
  if (!outcome.interrupted) {
    const Stage stage(stages_, "pictures");
    write_pictures();
  }
  return outcome;
}

// A folder may go on with a changed config: cells that are still in it keep their rows. Another
// experiment's results stay as they are.
void Experiment::open_folder() {
  std::error_code error;
  std::filesystem::create_directories(options_.out / "images", error);
  if (error) throw RunError(options_.out.string() + ": cannot be created: " + error.message());
  const std::filesystem::path resolved = options_.out / "config.resolved.json";
  const std::string before = read_text(resolved);
  if (!before.empty()) {
    const nlohmann::json config = nlohmann::json::parse(before, nullptr, false);
    const auto name_at = config.is_object() ? config.find("name") : config.end();
    if (name_at == config.end() || !name_at->is_string()) {
      throw InputError(resolved.string() +
                       ": is not the config of a run; use another --out or remove the folder");
    }
    const std::string name = name_at->get<std::string>();
    if (name != config_.name) {
      throw InputError(options_.out.string() + ": holds the results of another experiment, \"" +
                       name + "\" (config.resolved.json); use another --out or remove the folder");
    }
  }
  if (before != config_.resolved_json) write_file_atomically(resolved, config_.resolved_json);
  const std::filesystem::path stage_table = options_.out / "stages.csv";
  if (std::filesystem::exists(stage_table)) stage_rows_ = read_stage_rows(stage_table);
  const std::filesystem::path environment = options_.out / "environment.json";
  write_file_atomically(environment,
                        environment_json({threads_, options_.command_line, config_.resolved_json},
                                         read_text(environment)));
}

void Experiment::provide_references() {
  std::set<std::size_t> needed;
  for (const Cell& cell : cells_) needed.insert(cell.scene);
  for (const std::size_t s : needed) {
    references_[s] = provide_reference(scenes_[s], threads_);
    note(describe(scenes_[s].config->name, *references_[s]));
  }
}

// A plan covers all cells of the config, so that --only can change between calls. Cells that it
// has keep their numbers; those that are new are measured.
void Experiment::provide_plan() {
  const std::filesystem::path file = options_.out / "plan.lock.json";
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
    if (config_.budget) {
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
  apply_plan(read_plan(file), cells_);
}

}  // namespace penumbra
