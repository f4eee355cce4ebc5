// validate, plan, reference and run: the commands that take a config.

#include <fmt/format.h>

#include <cmath>

#include "harness/commands/commands.h"
#include "harness/experiment.h"
#include "harness/progress.h"
#include "harness/project_root.h"
#include "harness/report_tables.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

ExperimentConfig load(const ConfigOptions& options) {
  return load_config(options.config, options.overrides);
}

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
  const ExperimentConfig config = load(options);
  const Experiment experiment(config, {});
  fmt::print("{}: valid: {} scenes, {} cells, {} blocks\n", options.config.string(),
             config.scenes.size(), experiment.cells().size(), config.blocks);
  return kSuccess;
}

int plan_command(const ConfigOptions& options) {
  const Experiment experiment(load(options), {});
  const ExperimentConfig& config = experiment.config();
  const std::vector<Cell>& cells = experiment.cells();
  const std::vector<PlannedCell> plan = run_pilots(config, experiment.scenes(), cells);
  const double threads = resolve_threads(config.threads);
  fmt::print("{:<14} {:<24} {:<12} {:>5} {:>8} {:>10}\n", "scene", "label", "sampler", "spp", "SRL",
             "CPU s/run");
  double total = 0.0;
  double bytes = 0.0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const LoadedScene& scene = experiment.scenes()[cells[i].scene];
    fmt::print("{:<14} {:<24} {:<12} {:>5} {:>8} {:>10.3f}\n", scene.config->name, cells[i].label,
               to_string(cells[i].sampler), plan[i].spp, plan[i].srl.text(), plan[i].predicted_s);
    total += plan[i].predicted_s * config.blocks / threads;
    bytes += picture_bytes(scene, config.images.maps);
  }
  fmt::print("\n{} cells x {} blocks: {} for the blocks on {} threads, {:.0f} MB of pictures\n",
             cells.size(), config.blocks, duration_text(total), threads, megabytes(bytes));
  for (const LoadedScene& scene : experiment.scenes()) {
    const std::string id = reference_id(scene);
    const auto file = find_reference_file(scene.scene->name(), id);
    fmt::print("reference of {}: {}\n", scene.config->name,
               file ? file->string()
                    : "to be rendered, " + std::to_string(scene.config->reference.spp) + " spp");
  }
  return kSuccess;
}

int reference_command(const ReferenceOptions& options) {
  ExperimentConfig config = load(options.config);
  const int threads = resolve_threads(options.threads.value_or(config.threads));
  bool found = options.scene.empty();
  for (const SceneConfig& scene_config : config.scenes) {
    if (!options.scene.empty() && scene_config.name != options.scene) continue;
    found = true;
    const LoadedScene scene = load_scene(scene_config, config.tile, config.quantity);
    const Reference reference = provide_reference(scene, threads, options.add_spp);
    const ReferenceNoise noise = reference_noise(reference.halves());
    fmt::print("{}: {} spp, mean {:.6g}, standard error per pixel {:.3g}\n",
               reference.file.string(), reference.spp, noise.mean, std::sqrt(noise.variance));
  }
  if (!found) throw InputError("the config has no scene \"" + options.scene + "\"");
  return kSuccess;
}

int run_command(const RunCommandOptions& options) {
  handle_interrupts();
  ExperimentConfig config = load(options.config);
  if (options.threads) config.threads = *options.threads;
  RunOptions run_options;
  run_options.out = options.out.empty() ? project_root() / "results" / config.name : options.out;
  run_options.only = options.only;
  run_options.command_line = options.command_line;
  Experiment experiment(std::move(config), run_options);
  const RunOutcome outcome = experiment.run();

  const ReportTables tables = experiment.tables();
  fmt::print("{}", to_terminal(tables));
  warn_of_missed_budgets(experiment.config(), tables.efficiency);
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
