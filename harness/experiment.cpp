#include "harness/experiment.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>
#include <random>
#include <set>
#include <sstream>

#include "harness/atomic_file.h"
#include "harness/build_info.h"
#include "harness/csv.h"
#include "harness/keys.h"
#include "harness/metric_columns.h"
#include "harness/metrics.h"
#include "harness/progress.h"
#include "harness/render.h"
#include "harness/replicate_files.h"
#include "harness/shell_words.h"
#include "harness/table_text.h"
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

std::string run_id(const Cell& cell, int block) {
  return hash_id(
      {"run", cell.id, std::to_string(block), std::to_string(cell.spp), cell.srl.text()});
}

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
  if (!options_.only.empty()) {
    std::erase_if(cells_, [&](const Cell& cell) {
      return !matches_glob(options_.only, config_.scenes[cell.scene].name + "/" + cell.label + "/" +
                                              std::string(to_string(cell.sampler)));
    });
    if (cells_.empty()) throw InputError("--only \"" + options_.only + "\" matches no cell");
  }
  references_.resize(scenes_.size());
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
    const Stage stage(stages_, "pictures");
    write_pictures();
  }
  write_tables();
  return outcome;
}

void Experiment::open_folder() {
  std::error_code error;
  std::filesystem::create_directories(options_.out / "images", error);
  if (error) throw RunError(options_.out.string() + ": cannot be created: " + error.message());
  const std::filesystem::path resolved = options_.out / "config.resolved.json";
  if (std::filesystem::exists(resolved)) {
    if (read_text(resolved) != config_.resolved_json) {
      throw InputError(options_.out.string() +
                       ": holds the results of another config (config.resolved.json differs); use "
                       "another --out or remove the folder");
    }
  } else {
    write_file_atomically(resolved, config_.resolved_json);
  }
  write_file_atomically(options_.out / "environment.json",
                        environment_json(threads_, options_.command_line));
}

void Experiment::provide_references() {
  std::set<std::size_t> needed;
  for (const Cell& cell : cells_) needed.insert(cell.scene);
  for (const std::size_t s : needed) {
    references_[s] = provide_reference(scenes_[s], threads_);
    note(describe(scenes_[s].config->name, *references_[s]));
  }
}

void Experiment::provide_plan() {
  const std::filesystem::path file = options_.out / "plan.lock.json";
  if (!std::filesystem::exists(file)) {
    // A plan covers all cells of the config, so that --only can change between calls.
    std::vector<Cell> all = expand_cells(config_, scenes_);
    if (config_.budget) {
      write_plan(file, scenes_, all, run_pilots(config_, scenes_, all));
    } else {
      std::vector<PlannedCell> plan;
      for (const Cell& cell : all) plan.push_back({cell.id, cell.spp, cell.srl, 0.0, 0.0, 0.0});
      write_plan(file, scenes_, all, plan);
    }
  }
  apply_plan(read_plan(file), cells_);
}

// A random order for every pair of blocks, run forwards and then backwards: A B C, C B A.
std::vector<std::size_t> Experiment::block_order(int block) const {
  std::vector<std::size_t> order(cells_.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::mt19937_64 generator(
      hash_texts({"order", std::to_string(config_.seed), std::to_string(block / 2)}));
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[generator() % i]);
  if (block % 2 == 1) std::reverse(order.begin(), order.end());
  return order;
}

void Experiment::run_blocks(RunOutcome& outcome) {
  const std::filesystem::path file = options_.out / "measurements.csv";
  std::set<std::string> done;
  if (std::filesystem::exists(file)) {
    if (truncate_torn_tail(file)) note("a half-written last row was removed; it is measured again");
    for (const RunRow& row : read_run_rows(file).rows) {
      done.insert(row.run_id);
      outcome.rows_failed += row.status == RunStatus::Failed ? 1 : 0;
    }
  }
  CsvWriter writer(file, run_columns());
  const int total = config_.blocks * static_cast<int>(cells_.size());
  Progress progress("blocks", total);
  bool warm = false;
  for (int block = 0; block < config_.blocks && !outcome.interrupted; ++block) {
    const std::vector<std::size_t> order = block_order(block);
    for (std::size_t position = 0; position < order.size(); ++position) {
      if (interrupted()) {
        outcome.interrupted = true;
        break;
      }
      const Cell& cell = cells_[order[position]];
      if (done.count(run_id(cell, block)) != 0) {
        ++outcome.rows_found;
        continue;
      }
      if (!warm) {
        // One discarded run: caches, thread pool, clock frequency.
        render(*scenes_[cell.scene].scene, scenes_[cell.scene].points,
               render_settings(cell, run_seed(config_, cell, -1), threads_));
        warm = true;
      }
      const RunRow row = measure(cell, block, static_cast<int>(position));
      writer.append(run_record(row));
      ++outcome.rows_measured;
      outcome.rows_failed += row.status == RunStatus::Failed ? 1 : 0;
      progress.update(outcome.rows_measured + outcome.rows_found, cell.label);
    }
  }
  if (outcome.rows_measured > 0 && !outcome.interrupted) progress.finish();
}

RunRow Experiment::measure(const Cell& cell, int block, int order) {
  const LoadedScene& scene = scenes_[cell.scene];
  const Reference& reference = *references_[cell.scene];
  RunRow row;
  row.run_id = run_id(cell, block);
  row.scene = scene.config->name;
  row.label = cell.label;
  row.estimator = std::string(cell.estimator->name);
  row.sampler = std::string(to_string(cell.sampler));
  row.spp = cell.spp;
  row.srl = cell.srl.total();
  row.srl_initial = cell.srl.initial;
  row.srl_adaptive = cell.srl.adaptive;
  if (cell.params.values().count("population") != 0)
    row.population = cell.params.integer("population");
  row.budget_s = cell.budget_s;
  row.block = block;
  row.seed = run_seed(config_, cell, block);
  row.geometry = scene.scene->traits().geometry;
  row.width = scene.points.width;
  row.height = scene.points.height;
  row.threads = threads_;
  row.cell = cell.id;
  row.params = cell.params_text;
  row.camera_samples = scene.points.camera_samples;
  row.order = order;
  row.reference_id = reference.id;
  row.reference_spp = reference.spp;

  const RenderResult result =
      render(*scene.scene, scene.points, render_settings(cell, row.seed, threads_));
  row.estimates = result.counters.estimates;
  row.rays = result.counters.rays;
  row.samples = result.counters.samples;
  row.iterations = static_cast<std::int64_t>(result.counters.iterations);
  row.time_wall_s = result.time_wall_s;
  row.time_cpu_s = result.time_cpu_s;
  row.time_prepare_s = result.time_prepare_s;
  if (result.instructions > 0) row.instructions = result.instructions;
  row.nonfinite = result.bad_count;
  row.image_hash = result.radiance_hash();
  const Image image = result.image();
  if (config_.images.runs) write_run_picture(options_.out, row, image);
  if (result.bad_count > 0 || result.counters.uncovered > 0) {
    row.status = RunStatus::Failed;
    row.failure = result.bad_count > 0
                      ? fmt::format("{} estimates not finite or negative", result.bad_count)
                      : fmt::format("{} samples without density", result.counters.uncovered);
    write_events(row, cell, result);
    return row;
  }
  record_metrics(image_metrics(image.pixels, reference.halves(), config_.relmse_epsilon), row);
  return row;
}

void Experiment::write_events(const RunRow& row, const Cell& cell, const RenderResult& result) {
  std::ofstream stream(options_.out / "events.txt", std::ios::app);
  for (const BadEstimate& bad : result.bad) {
    const std::string line = fmt::format(
        "{} {}/{}: pixel {},{} estimate {}: ({}, {}, {}); replay: penumbra replay {} --row {} "
        "--pixel {},{} --estimate {}",
        row.run_id, row.scene, cell.label, bad.x, bad.y, bad.estimate, bad.value.x, bad.value.y,
        bad.value.z, shell_quoted(std::filesystem::absolute(options_.out).string()), row.run_id,
        bad.x, bad.y, bad.estimate);
    stream << line << '\n';
    warn(line);
  }
}

TableOptions Experiment::table_options() const {
  TableOptions options;
  options.baseline = config_.baseline;
  options.tuned_baseline = config_.tuned_baseline;
  options.relmse_epsilon = config_.relmse_epsilon;
  for (const SceneConfig& scene : config_.scenes) options.scenes.push_back(scene.name);
  for (const MethodConfig& method : config_.methods) {
    options.labels.push_back(method.label);
    if (!method.published.empty()) options.published[method.label] = method.published;
  }
  options.published_source = config_.published_source;
  return options;
}

std::vector<EfficiencyRow> Experiment::table() const {
  return efficiency_table(read_run_rows(options_.out / "measurements.csv").rows, table_options());
}

void Experiment::write_tables() const {
  std::vector<EfficiencyRow> rows = table();
  add_replicates_of_runs(rows);
  write_file_atomically(options_.out / "efficiency.csv", to_csv(rows));
  write_file_atomically(options_.out / "efficiency.md", to_markdown(rows, table_options()));
}

void Experiment::add_replicates_of_runs(std::vector<EfficiencyRow>& table) const {
  const std::vector<RunRow> runs = read_run_rows(options_.out / "measurements.csv").rows;
  for (EfficiencyRow& row : table) {
    const std::vector<RunRow> own = rows_of_cell(runs, row);
    const auto cell = std::find_if(cells_.begin(), cells_.end(),
                                   [&](const Cell& c) { return c.id == own.front().cell; });
    if (cell == cells_.end()) continue;
    const Reference& reference = *references_[cell->scene];
    const auto summary = summarise_replicates(options_.out, own, reference);
    if (!summary) continue;
    add_replicates(row, *summary);
    write_replicate_picture(image_file(*cell, "-stddev.exr"), *summary, reference);
  }
}

}  // namespace penumbra
