#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "harness/build_info.h"
#include "harness/clocks.h"
#include "harness/exr.h"
#include "harness/gate/gate.h"
#include "harness/gate/gate_bias.h"
#include "harness/gate/gate_cells.h"
#include "harness/gate/judge.h"
#include "harness/measured_cells.h"
#include "harness/replicate_files.h"
#include "harness/replicates.h"
#include "harness/run_row.h"
#include "scenes/core/error.h"

/// The gate over two result folders of `penumbra run`: nothing is measured.
namespace penumbra {
namespace {

namespace fs = std::filesystem;

GateRun gate_run_of(const RunRow& row, const std::string& name, const std::string& metric) {
  GateRun run;
  run.cell = name;
  run.block = row.block;
  run.seed = row.seed;
  run.threads = row.threads;
  run.image_hash = row.image_hash;
  run.estimates = row.estimates;
  run.samples = row.samples;
  run.rays = row.rays;
  run.iterations = static_cast<std::uint64_t>(row.iterations.value_or(0));
  // Work that waits for other threads is counted as well, so that only runs on one are exact.
  if (row.threads == 1) run.instructions = row.instructions;
  run.error = metric == "mse" ? row.mse : row.relmse;
  run.p_eff = row.p_eff;
  run.failure = fault_of(row);
  return run;
}

// Runs of one folder by the id of their cell; of several attempts that which counts.
std::map<std::string, std::vector<RunRow>> rows_by_cell(const fs::path& folder) {
  const std::vector<RunRow> rows = read_run_rows(folder / "measurements.csv").rows;
  std::map<std::string, std::vector<RunRow>> result;
  for (const MeasuredCell& cell : measured_cells(rows)) {
    for (const auto& [block, row] : cell.blocks) result[row->cell].push_back(*row);
  }
  return result;
}

void put_tiles(const fs::path& folder, const RunRow& row, GateRun& run) {
  const fs::path picture = run_picture(folder, row.run_id);
  if (!run.failure.empty() || !fs::exists(picture)) return;
  run.tiles = tile_means_of(read_exr(picture).image());
}

}  // namespace

GateResult gate_folders(const Experiment& experiment, const GateSources& sources,
                        const GateOptions& options) {
  const Stopwatch watch;
  const GateSubject subject = gate_subject(experiment);
  const auto base = rows_by_cell(sources.base_folder);
  const auto head = rows_by_cell(sources.head_folder);
  GateResult result;
  result.config_name = subject.config().name;
  result.config_file = subject.config().file.string();
  result.metric = subject.gate.metric;
  result.confidence = subject.gate.confidence;
  result.base = {sources.base_folder.string(), "{}", ""};
  result.head = {sources.head_folder.string(), "{}", ""};

  std::vector<GateCellRuns> cells;
  std::vector<std::size_t> indices;
  for (std::size_t c = 0; c < subject.names.size(); ++c) {
    const std::string& id = experiment.cells()[c].id;
    const auto of_base = base.find(id);
    const auto of_head = head.find(id);
    if (of_base == base.end() || of_head == head.end()) {
      result.notes.push_back(fmt::format(
          "{}: not in {}", subject.names[c],
          of_base == base.end() ? sources.base_folder.string() : sources.head_folder.string()));
      continue;
    }
    if (of_base->second[0].reference_id != of_head->second[0].reference_id) {
      throw ReferenceError(
          fmt::format("{}: {} was measured against reference {}, {} against {}", subject.names[c],
                      sources.base_folder.string(), of_base->second[0].reference_id,
                      sources.head_folder.string(), of_head->second[0].reference_id));
    }
    GateCellRuns& runs = cells.emplace_back();
    runs.name = subject.names[c];
    set_thresholds(subject.gate, options.accepted, runs);
    for (const RunRow& row : of_base->second) {
      runs.base.push_back(gate_run_of(row, runs.name, subject.gate.metric));
    }
    for (const RunRow& row : of_head->second) {
      runs.head.push_back(gate_run_of(row, runs.name, subject.gate.metric));
      put_tiles(sources.head_folder, row, runs.head.back());
    }
    indices.push_back(c);
  }
  if (cells.empty()) throw ReferenceError("the folders have no cell of the config in common");

  JudgeOptions judging;
  judging.level = 1.0 - subject.gate.confidence;
  judging.suite = subject.gate.thresholds;
  judging.suite_instructions = subject.gate.suite_instructions;
  Judgement judgement = judge(cells, judging);
  result.cells = std::move(judgement.cells);
  result.suite = std::move(judgement.suite);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    GateCell& cell = result.cells[i];
    result.blocks = std::max(result.blocks, cell.blocks);
    if (cell.same_images) {
      cell.bias.skipped = "same images as base";
      continue;
    }
    const Cell& of_config = experiment.cells()[indices[i]];
    cell.bias = test_gate_bias(cells[i].head, subject.reference_of(indices[i]),
                               of_config.estimator->bias_reason(of_config.params));
  }
  adjust_bias(result.cells);
  for (GateCell& cell : result.cells) {
    if (!cell.bias.skipped.empty() || cell.bias.adjusted_p > subject.gate.bias_level) continue;
    // There are no fresh seeds here to confirm it.
    cell.verdict = GateVerdict::Inconclusive;
    cell.reason = GateReason::NotRepeated;
    cell.sentence += fmt::format(
        "; the mean differs from the reference's (p {:.2g}), which only "
        "--base-exe and --head-exe can confirm",
        cell.bias.adjusted_p);
  }
  result.notes.emplace_back(
      "times were not measured in turns, so that only work and errors decide");
  result.looks = {result.blocks};
  result.wall_s = watch.wall_s();
  conclude(result);
  return result;
}

}  // namespace penumbra
