// validate, plan, reference and run: the commands that take a config.

#include <fmt/format.h>

#include <cmath>

#include "harness/commands/commands.h"
#include "harness/experiment.h"
#include "harness/progress.h"
#include "harness/project_root.h"
#include "harness/replicate_files.h"
#include "harness/table_text.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

double megabytes(double bytes) { return bytes / (1024.0 * 1024.0); }

// Bytes that one cell leaves in the folder: its EXR layers (float, hardly compressible) and PNG.
double picture_bytes(const LoadedScene& scene, bool maps) {
  const double pixels = static_cast<double>(scene.points.width) * scene.points.height;
  return pixels * (9.0 + (maps ? static_cast<double>(scene.scene->lights().size()) + 2.0 : 0.0)) *
         4.0;
}

// Says which cells did not take the time they were given: their errors are not at equal time, their
// efficiencies are.
void warn_of_missed_budgets(const ExperimentConfig& config,
                            const std::vector<EfficiencyRow>& rows) {
  for (const EfficiencyRow& row : rows) {
    if (!config.budget || !row.budget_s || !row.time_cpu_s) continue;
    const double miss = *row.time_cpu_s / *row.budget_s - 1.0;
    if (std::abs(miss) <= config.budget->tolerance) continue;
    warn(fmt::format("{}, {} {} ({}): realised CPU time is {:+.0f} % off its budget of {} s",
                     row.scene, row.label, row.params, row.sampler, 100.0 * miss, *row.budget_s));
  }
}

}  // namespace

int validate_command(const ConfigOptions& options) {
  const ExperimentConfig config = load_config(options.config, options.overrides);
  const Experiment experiment(config, {});
  fmt::print("{}: valid: {} scenes, {} cells, {} blocks\n", options.config.string(),
             config.scenes.size(), experiment.cells().size(), config.blocks);
  return kSuccess;
}

int plan_command(const ConfigOptions& options) {
  const Experiment experiment(load_config(options.config, options.overrides), {});
  const ExperimentConfig& config = experiment.config();
  const std::vector<Cell>& cells = experiment.cells();
  const std::vector<PlannedCell> plan = run_pilots(config, experiment.scenes(), cells);
  const double threads = resolve_threads(config.threads);
  fmt::print("{:<14} {:<24} {:<12} {:>5} {:>8} {:>10}\n", "scene", "label", "sampler", "spp", "SRL",
             "CPU s/run");
  double total = 0.0;
  double bytes = 0.0;
  double run_bytes = 0.0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const LoadedScene& scene = experiment.scenes()[cells[i].scene];
    fmt::print("{:<14} {:<24} {:<12} {:>5} {:>8} {:>10.3f}\n", scene.config->name, cells[i].label,
               to_string(cells[i].sampler), plan[i].spp, plan[i].srl.text(), plan[i].predicted_s);
    total += plan[i].predicted_s * config.blocks / threads;
    bytes += picture_bytes(scene, config.images.maps);
    if (!config.images.runs) continue;
    run_bytes += config.blocks * run_picture_bytes(scene.points.width, scene.points.height);
  }
  fmt::print(
      "\n{} cells x {} blocks: {} for the blocks on {} threads, {:.0f} MB of pictures, at most "
      "{:.0f} MB of those of single runs (images.runs)\n",
      cells.size(), config.blocks, duration_text(total), threads, megabytes(bytes),
      megabytes(run_bytes));
  for (const LoadedScene& scene : experiment.scenes()) {
    if (const std::optional<Reference> reference = find_reference(scene)) {
      fmt::print("{}\n", describe(scene.config->name, *reference));
    } else if (reference_type(scene) == ReferenceType::ExactSum) {
      fmt::print("reference of {}: to be summed up exactly\n", scene.config->name);
    } else {
      fmt::print("reference of {}: to be rendered, {} spp\n", scene.config->name,
                 scene.config->reference.spp);
    }
  }
  return kSuccess;
}

int run_command(const RunCommandOptions& options) {
  handle_interrupts();
  ExperimentConfig config = load_config(options.config.config, options.config.overrides);
  if (options.threads) config.threads = *options.threads;
  RunOptions run_options;
  run_options.out = options.out.empty() ? project_root() / "results" / config.name : options.out;
  run_options.only = options.only;
  run_options.command_line = options.command_line;
  Experiment experiment(std::move(config), run_options);
  const RunOutcome outcome = experiment.run();

  const std::vector<EfficiencyRow> table = experiment.table();
  fmt::print("{}", to_terminal(table, experiment.table_options()));
  warn_of_missed_budgets(experiment.config(), table);
  warn_of_reference_shares(experiment, table, options.config);
  fmt::print("\n{} runs measured, {} found in {}\n", outcome.rows_measured, outcome.rows_found,
             run_options.out.string());
  double total = 0.0;
  for (const StageTime& stage : experiment.stages()) {
    fmt::print("  {:<26} {}\n", stage.name, duration_text(stage.wall_s));
    total += stage.wall_s;
  }
  fmt::print("  {:<26} {}\n", "together", duration_text(total));
  fmt::print("table: {}\npictures: {}\n", (run_options.out / "efficiency.md").string(),
             (run_options.out / "images").string());
  if (outcome.interrupted) {
    note("interrupted; what was measured is kept, the same command goes on from here");
    return kInterrupted;
  }
  return outcome.rows_failed > 0 ? kRunFailure : kSuccess;
}

}  // namespace penumbra
