#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <sstream>

#include "harness/build_info.h"
#include "harness/cell_row.h"
#include "harness/experiment.h"
#include "harness/keys.h"
#include "harness/metric_columns.h"
#include "harness/metrics.h"
#include "harness/pixel_record.h"
#include "harness/progress.h"
#include "harness/render.h"
#include "harness/replicate_files.h"
#include "harness/row_log.h"
#include "harness/row_parts.h"
#include "harness/run_conditions.h"
#include "harness/shell_words.h"
#include "scenes/core/error.h"

/// The part of Experiment that measures: blocks of runs, one appended row each.
namespace penumbra {
namespace {

// In a unit that is proportional to time.
double work_of(const Cell& cell) { return cell.budget_s.value_or(1.0); }

}  // namespace

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

// Both blocks of a pair, which balance each other's drift, and all cells of a scene, which are
// compared.
bool Experiment::has_run(const WorkShare& share, const Cell& cell, int block) const {
  return share.has(static_cast<std::size_t>(block / 2) * scenes_.size() + cell.scene);
}

WorkShare Experiment::rank_share() const {
  return options_.shard.part(ranks_.rank(), ranks_.count());
}

void Experiment::run_blocks(RunOutcome& outcome) {
  measure_blocks(outcome);
  sum_over_ranks(outcome);
  if (!ranks_.is_root()) return;
  join_row_parts(options_.out);
  if (outcome.interrupted) return;
  const RowLog log(row_file(options_.out), config_.attempts);
  for (const Cell& cell : cells_) {
    for (int block = 0; block < config_.blocks; ++block) {
      if (!has_run(options_.shard, cell, block)) continue;
      const RunRow& row = log.last_row(cell, block);
      outcome.rows_failed += row.status == RunStatus::Failed ? 1 : 0;
      outcome.rows_contaminated += row.contaminated.empty() ? 0 : 1;
    }
  }
}

// What all ranks did, on all of them; those that are through wait here.
void Experiment::sum_over_ranks(RunOutcome& outcome) const {
  if (ranks_.count() == 1) return;
  const std::string own = fmt::format("{} {} {}", outcome.rows_measured, outcome.rows_found,
                                      outcome.interrupted ? 1 : 0);
  outcome = {};
  for (const std::string& text : ranks_.gather(own)) {
    std::istringstream numbers(text);
    int measured = 0, found = 0, was_interrupted = 0;
    numbers >> measured >> found >> was_interrupted;
    outcome.rows_measured += measured;
    outcome.rows_found += found;
    outcome.interrupted = outcome.interrupted || was_interrupted != 0;
  }
}

// The blocks of this rank.
void Experiment::measure_blocks(RunOutcome& outcome) {
  const WorkShare share = rank_share();
  RowLog log(row_file(options_.out), config_.attempts,
             ranks_.count() > 1 ? row_part(options_.out, ranks_.rank()) : std::filesystem::path());
  double work = 0;
  for (const Cell& cell : cells_) {
    for (int block = 0; block < config_.blocks; ++block) {
      if (!has_run(share, cell, block)) continue;
      const bool done = !log.next_attempt(cell, block);
      outcome.rows_found += done ? 1 : 0;
      work += done ? 0 : work_of(cell);
    }
  }
  Progress progress("blocks", work);
  double done = 0;
  for (int block = 0; block < config_.blocks && !outcome.interrupted; ++block) {
    // Those whose time was disturbed are tried again when the block is through.
    for (int attempt = 0; attempt < config_.attempts; ++attempt) {
      int order = attempt * static_cast<int>(cells_.size()) - 1;
      for (const std::size_t c : block_order(block)) {
        const Cell& cell = cells_[c];
        ++order;
        if (!has_run(share, cell, block) || log.next_attempt(cell, block) != attempt) continue;
        if (interrupted()) {
          outcome.interrupted = true;
          return;
        }
        warm_up(cell);
        log.append(measure(cell, block, order, attempt));
        ++outcome.rows_measured;
        if (attempt == 0) done += work_of(cell);
        progress.update(done, cell.label);
      }
    }
  }
  if (outcome.rows_measured > 0) progress.finish();
}

// One discarded run: caches, thread pool, clock frequency.
void Experiment::warm_up(const Cell& cell) {
  if (warm_) return;
  render(*scenes_[cell.scene].scene, scenes_[cell.scene].points,
         render_settings(cell, run_seed(config_, cell, -1), threads_));
  warm_ = true;
}

RunRow Experiment::measure(const Cell& cell, int block, int order, int attempt) {
  const LoadedScene& scene = scenes_[cell.scene];
  const Reference& reference = *references_[cell.scene];
  RunRow row;
  row.run_id = run_id(cell, block, attempt);
  row.attempt = attempt;
  put_cell(cell, scene.config->name, row);
  row.block = block;
  row.seed = run_seed(config_, cell, block);
  row.geometry = scene.scene->traits().geometry;
  row.width = scene.points.width;
  row.height = scene.points.height;
  row.threads = threads_;
  row.camera_samples = scene.points.camera_samples;
  row.order = order;
  row.reference_id = reference.id;
  row.reference_spp = reference.spp;
  row.build = build_id();
  row.machine = machine_text();
  row.host = host_name();

  const ConditionsWatch watch;
  RenderResult result =
      render(*scene.scene, scene.points, render_settings(cell, row.seed, threads_));
  const RunConditions conditions = watch.since();
  row.contaminated = contamination(conditions, result.time_wall_s, result.time_cpu_s, threads_);
  row.load_average = conditions.load_average;
  row.steal_share = conditions.steal_share;
  row.switches_voluntary = conditions.switches_voluntary;
  row.switches_involuntary = conditions.switches_involuntary;
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
  const EstimateCounters& counters = result.counters;
  if (result.bad_count > 0 || counters.uncovered > 0 || counters.untraced > 0) {
    row.status = RunStatus::Failed;
    row.failure = result.bad_count > 0
                      ? fmt::format("{} estimates not finite or negative", result.bad_count)
                  : counters.uncovered > 0
                      ? fmt::format("{} samples without density", counters.uncovered)
                      : fmt::format("{} rays not finite or without a direction", counters.untraced);
    find_causes(*scene.scene, scene.points, render_settings(cell, row.seed, threads_), result);
    write_events(row, cell, result);
    return row;
  }
  record_metrics(image_metrics(image.pixels, reference.halves(), config_.relmse_epsilon), row);
  return row;
}

void Experiment::write_events(const RunRow& row, const Cell& cell, const RenderResult& result) {
  const std::filesystem::path file = options_.out / "events.txt";
  std::string lines;
  for (const BadEstimate& bad : result.bad) {
    const std::string line =
        fmt::format("{} {}/{}: {}; replay: penumbra replay {} --row {} --pixel {},{} --estimate {}",
                    row.run_id, row.scene, cell.label, describe(bad),
                    shell_quoted(std::filesystem::absolute(options_.out).string()), row.run_id,
                    bad.x, bad.y, bad.estimate);
    lines += line + "\n";
    warn(line);
  }
  // In one go, so that those of other ranks do not come in between.
  std::ofstream stream(file, std::ios::app);
  stream << lines;
  stream.close();
  if (!stream) throw RunError(file.string() + ": cannot be written");
}

}  // namespace penumbra
