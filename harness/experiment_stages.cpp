#include <algorithm>

#include "harness/atomic_file.h"
#include "harness/cell_row.h"
#include "harness/experiment.h"
#include "harness/progress.h"

/// The part of Experiment that measures where the time of estimates goes: once per cell, apart from
/// the blocks, because the clock that tells it costs time.
namespace penumbra {
namespace {

// Many short ones: some are over before the thread has to wait for another program.
constexpr int kRounds = 16;

// A plan that was made again may have given the cell other numbers.
bool is_of(const StageRow& row, const Cell& cell) {
  return row.cell == cell.id && row.spp == cell.spp && row.srl_initial == cell.srl.initial &&
         row.srl_adaptive == cell.srl.adaptive;
}

double samples_per_estimate(const Scene& scene, const Cell& cell) {
  const auto lights = static_cast<double>(std::max<std::size_t>(1, scene.lights().size()));
  return lights * cell.srl.total();
}

}  // namespace

// The file is written after every cell, as a whole, so that a run that was stopped goes on. One
// process measures all cells, because they are compared; of shards it is the first.
void Experiment::measure_stages() {
  if (!ranks_.is_root() || options_.shard.index > 0) return;
  std::vector<const Cell*> missing;
  for (const Cell& cell : cells_) {
    const auto same = [&](const StageRow& row) { return is_of(row, cell); };
    if (std::none_of(stage_rows_.begin(), stage_rows_.end(), same)) missing.push_back(&cell);
  }
  Progress progress("where the time goes", static_cast<double>(missing.size()));
  double done = 0;
  for (const Cell* const cell : missing) {
    if (interrupted()) return;
    const LoadedScene& scene = scenes_[cell->scene];
    const StageWork work =
        stage_work(scene.points, cell->spp, samples_per_estimate(*scene.scene, *cell));
    if (work.points.valid_count > 0) {  // otherwise there is no estimate
      std::erase_if(stage_rows_, [&](const StageRow& row) { return row.cell == cell->id; });
      stage_rows_.push_back(measure_stages_of(*cell, work));
    }
    write_file_atomically(options_.out / "stages.csv", to_csv(stage_rows_));
    progress.update(++done, cell->label);
  }
  if (!missing.empty()) progress.finish();
}

StageRow Experiment::measure_stages_of(const Cell& cell, const StageWork& work) const {
  RenderSettings settings = render_settings(cell, run_seed(config_, cell, 0), 1);
  settings.spp = work.spp;
  StageTimer times(*scenes_[cell.scene].scene, work.points, settings);
  for (int round = 0; round < kRounds; ++round) times.render_both();
  const StageShares shares = times.result();
  StageRow row;
  put_cell(cell, scenes_[cell.scene].config->name, row);
  row.ns = shares.total_ns;
  row.rays = shares.rays;
  row.samples = shares.samples;
  row.trace = shares.share(EstimateStage::Trace);
  row.sample = shares.share(EstimateStage::Sample);
  row.weigh = shares.share(EstimateStage::Weigh);
  row.adapt = shares.share(EstimateStage::Adapt);
  row.set_up = shares.share(EstimateStage::SetUp);
  row.outside = shares.share(EstimateStage::Outside);
  return row;
}

}  // namespace penumbra
