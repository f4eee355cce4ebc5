// validate, plan, reference and run: the commands that take a config.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/calibration.h"
#include "harness/commands/commands.h"
#include "harness/curves.h"
#include "harness/experiment.h"
#include "harness/page/page.h"
#include "harness/progress.h"
#include "harness/project_root.h"
#include "harness/reference_job.h"
#include "harness/replicate_files.h"
#include "harness/report.h"
#include "harness/statistics.h"
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

// A picture's files, per pixel: EXR and PNG are compressed on one core.
constexpr double kWriting_s = 1.2e-6;
constexpr double kWritingRun_s = 0.3e-6;

// Of the log ratio of two CPU times in one block, as measured on a shared machine (statistics.md
// 3.3).
constexpr double kTimeSd = 0.05;

// The smallest difference to the baseline that the blocks will show, from the pilots' pixels.
std::string detectable_text(const Experiment& experiment, const std::vector<PlannedCell>& plan,
                            std::size_t index) {
  const Cell& cell = experiment.cells()[index];
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const Cell& other = experiment.cells()[i];
    const bool is_baseline = other.label == experiment.config().baseline &&
                             other.scene == cell.scene && other.sampler == cell.sampler &&
                             other.budget_time == cell.budget_time;
    if (!is_baseline || i == index || !plan[i].p_eff || !plan[index].p_eff) continue;
    const auto effect =
        detectable_effect(*plan[index].p_eff, *plan[i].p_eff, kTimeSd, experiment.config().blocks);
    if (!effect) return "-";
    return *effect < 10.0 ? fmt::format("{:.0f} %", 100.0 * *effect) : "> 1000 %";
  }
  return "-";
}

void print_cells(const Experiment& experiment, const std::vector<PlannedCell>& plan) {
  fmt::print("{:<14} {:<24} {:<12} {:>5} {:>8} {:>10} {:>7} {:>11}\n", "scene", "label", "sampler",
             "spp", "SRL", "CPU s/run", "P_eff", "detectable");
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const Cell& cell = experiment.cells()[i];
    fmt::print("{:<14} {:<24} {:<12} {:>5} {:>8} {:>10.3f} {:>7} {:>11}\n",
               experiment.scenes()[cell.scene].config->name, cell.label, to_string(cell.sampler),
               plan[i].spp, plan[i].srl.text(), plan[i].predicted_s,
               plan[i].p_eff ? fmt::format("{:.0f}", *plan[i].p_eff) : "-",
               detectable_text(experiment, plan, i));
  }
  fmt::print(
      "P_eff: pixels that decide the MSE of one small pilot; detectable: smallest difference of "
      "efficiency to \"{}\"\nthat {} blocks show with 80 % power, for a spread of times of "
      "{:.0f} %\n",
      experiment.config().baseline, experiment.config().blocks, 100.0 * kTimeSd);
}

// Time that the missing samples of a reference take, from one pass of it.
double reference_s(const LoadedScene& scene, int threads) {
  const std::optional<Reference> found = find_reference(scene);
  const bool exact = reference_type(scene) == ReferenceType::ExactSum;
  const RenderSettings settings = reference_settings(scene, threads);
  const int wanted = exact ? 2 * settings.spp : scene.config->reference.spp;
  const int missing = found ? (exact ? 0 : std::max(0, wanted - found->spp)) : wanted;
  if (missing == 0) return 0.0;
  return render(*scene.scene, scene.points, settings).time_wall_s * missing / settings.spp;
}

struct SpentTime {
  double loading_s{0}, pilots_s{0};
};

// Of the whole of `penumbra run`, which loads and pilots again.
void print_prediction(const Experiment& experiment, const std::vector<PlannedCell>& plan,
                      const SpentTime& spent, int hosts) {
  const ExperimentConfig& config = experiment.config();
  const int threads = resolve_threads(config.threads);
  double references = 0.0;
  for (const LoadedScene& scene : experiment.scenes()) references += reference_s(scene, threads);
  double blocks = 0.0, pictures = 0.0, bytes = 0.0, run_bytes = 0.0;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const Cell& cell = experiment.cells()[i];
    const LoadedScene& scene = experiment.scenes()[cell.scene];
    const double run_s = plan[i].predicted_s / threads;
    const double pixels = static_cast<double>(scene.points.width) * scene.points.height;
    blocks += run_s * config.blocks;
    if (config.images.runs) {
      blocks += kWritingRun_s * pixels * config.blocks;
      run_bytes += config.blocks * run_picture_bytes(scene.points.width, scene.points.height);
    }
    if (!has_pictures(config, cell)) continue;
    pictures += run_s + kWriting_s * pixels;
    bytes += picture_bytes(scene, config.images.maps);
  }
  fmt::print("\n{} cells x {} blocks on {} threads\n", plan.size(), config.blocks, threads);
  const auto line = [](const char* what, double time_s) {
    fmt::print("  {:<26} {}\n", what, duration_text(time_s));
  };
  line("scenes and shading points", spent.loading_s);
  line("references", references);
  line("pilots and plan", spent.pilots_s);
  line("blocks", blocks);
  line("pictures", pictures);
  line("together", spent.loading_s + references + spent.pilots_s + blocks + pictures);
  if (hosts > 1) {
    // References and plans are given away by scene, then blocks by pairs of a scene; each of the
    // three calls loads all scenes.
    const int scenes = static_cast<int>(config.scenes.size());
    const int pairs = (config.blocks + 1) / 2 * scenes;
    const auto share = [&](int parts) { return std::ceil(1.0 * parts / hosts) / parts; };
    line(fmt::format("on {} hosts (--shard)", hosts).c_str(),
         3 * spent.loading_s + share(scenes) * (references + spent.pilots_s) +
             share(pairs) * blocks + pictures / hosts);
    if (hosts > pairs) {
      note(fmt::format("{} blocks of {} scenes are {} pairs: more hosts than that measure nothing",
                       config.blocks, config.scenes.size(), pairs));
    }
  }
  fmt::print(
      "  {:<26} {:.0f} MB of pictures, at most {:.0f} MB of those of single runs (images.runs)\n",
      "disk", megabytes(bytes), megabytes(run_bytes));
  for (const LoadedScene& scene : experiment.scenes()) {
    const std::optional<Reference> found = find_reference(scene);
    const bool exact = reference_type(scene) == ReferenceType::ExactSum;
    const std::string wanted =
        exact ? "summed up exactly" : fmt::format("rendered, {} spp", scene.config->reference.spp);
    fmt::print("{}\n", found ? describe(scene.config->name, *found)
                             : "reference of " + scene.config->name + ": to be " + wanted);
  }
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

// Says which cells spread their estimates unevenly over the camera samples, which costs efficiency
// that has nothing to do with the estimator.
void warn_of_uneven_samples(const Experiment& experiment, const std::vector<int>& spp) {
  constexpr double kShown = 0.01;
  for (std::size_t i = 0; i < spp.size(); ++i) {
    const Cell& cell = experiment.cells()[i];
    const SceneConfig& scene = *experiment.scenes()[cell.scene].config;
    const double loss = spp[i] / effective_spp(spp[i], scene.camera_samples) - 1.0;
    if (loss <= kShown) continue;
    warn(fmt::format(
        "{}, {} ({}): SPP {} over {} camera samples has {:.1f} % more variance than if they were "
        "spread evenly; set camera_samples to 1, or a larger budget",
        scene.name, cell.label, to_string(cell.sampler), spp[i], scene.camera_samples,
        100.0 * loss));
  }
}

// What was done, how long its stages took, and where the results are.
void show_outcome(const Experiment& experiment, const RunOutcome& outcome,
                  const std::filesystem::path& out, const std::filesystem::path& page) {
  fmt::print("\n{} runs measured, {} found in {}\n", outcome.rows_measured, outcome.rows_found,
             out.string());
  double total = 0.0;
  for (const StageTime& stage : experiment.stages()) {
    fmt::print("  {:<26} {}\n", stage.name, duration_text(stage.wall_s));
    total += stage.wall_s;
  }
  fmt::print("  {:<26} {}\n", "together", duration_text(total));
  fmt::print("report: {}\ntable: {}\npictures: {}\n", page.string(),
             (out / "efficiency.md").string(), (out / "images").string());
}

// Tables and page of a run, and what is to be said of it. @return the exit code
int report_run(const Experiment& experiment, const RunOutcome& outcome,
               const std::filesystem::path& out, const RunCommandOptions& options) {
  const Report report = make_report(out, ReplicatePictures::Write);
  write_tables(out, report.tables);
  const std::filesystem::path page = write_page(out, report, {});
  show_report(report, options.json);
  warn_of_missed_budgets(experiment.config(), report.tables.efficiency);
  std::vector<int> spp;
  for (const Cell& cell : experiment.cells()) spp.push_back(cell.spp);
  warn_of_uneven_samples(experiment, spp);
  warn_of_reference_shares(experiment, report.tables.efficiency, options.config);
  if (outcome.rows_contaminated > 0) {
    warn(
        fmt::format("{} runs were disturbed by other work on the machine in all {} attempts; the "
                    "column \"contaminated\" of measurements.csv says how",
                    outcome.rows_contaminated, experiment.config().attempts));
  }
  if (!options.json) show_outcome(experiment, outcome, out, page);
  if (outcome.interrupted) {
    note("interrupted; what was measured is kept, the same command goes on from here");
    return kInterrupted;
  }
  return outcome.rows_failed > 0 ? kRunFailure : kSuccess;
}

std::filesystem::path default_folder(const ExperimentConfig& config, const WorkShare& shard) {
  const std::string part =
      shard.is_all() ? "" : fmt::format("-shard-{}-of-{}", shard.index + 1, shard.count);
  return project_root() / "results" / (config.name + part);
}

// What a run of the config would freeze: numbers that nothing solves for are given, not predicted.
std::vector<PlannedCell> frozen(const Experiment& experiment, std::vector<PlannedCell> plan) {
  if (experiment.config().budget) return plan;
  for (PlannedCell& cell : plan) cell.per_unit_s = cell.predicted_s = 0;
  return plan;
}

}  // namespace

ExperimentConfig load_config(const ConfigOptions& options, const Ranks& ranks) {
  if (!ranks.is_root()) ranks.barrier();
  ExperimentConfig config = load_config(options.config, options.overrides);
  if (ranks.is_root()) ranks.barrier();
  return config;
}

int validate_command(const ConfigOptions& options) {
  const ExperimentConfig config = load_config(options.config, options.overrides);
  const Experiment experiment(config, {});
  fmt::print("{}: valid: {} scenes, {} cells, {} blocks\n", options.config.string(),
             config.scenes.size(), experiment.cells().size(), config.blocks);
  return kSuccess;
}

int plan_command(const PlanOptions& options) {
  const Stopwatch loading;
  RunOptions run_options;
  if (!options.shard.empty()) run_options.scenes = parse_shard(options.shard);
  const Experiment experiment(load_config(options.config.config, options.config.overrides),
                              run_options);
  const double loading_s = loading.wall_s();
  const Stopwatch piloting;
  const std::vector<PlannedCell> plan =
      run_pilots(experiment.config(), experiment.scenes(), experiment.cells(), {}, true);
  const double pilots_s = experiment.config().budget ? piloting.wall_s() : 0.0;
  print_cells(experiment, plan);
  if (!options.lock.empty()) {
    write_plan(options.lock, experiment.scenes(), experiment.cells(), frozen(experiment, plan));
  }
  print_prediction(experiment, plan, {loading_s, pilots_s}, options.hosts);
  std::vector<int> spp;
  for (const PlannedCell& cell : plan) spp.push_back(cell.spp);
  warn_of_uneven_samples(experiment, spp);
  return kSuccess;
}

int run_command(const RunCommandOptions& options) {
  handle_interrupts();
  const Ranks& ranks = *options.ranks;
  const WorkShare shard = options.shard.empty() ? WorkShare{} : parse_shard(options.shard);
  ExperimentConfig config = load_config(options.config, ranks);
  if (options.threads) config.threads = *options.threads;
  RunOptions run_options;
  run_options.out = options.out.empty() ? default_folder(config, shard) : options.out;
  run_options.only = options.only;
  run_options.tag = options.tag;
  run_options.command_line = options.command_line;
  run_options.shard = shard;
  run_options.plans = options.plans;
  run_options.ranks = &ranks;
  Experiment experiment(std::move(config), run_options);
  const RunOutcome outcome = experiment.run();
  std::string code;
  if (ranks.is_root()) {
    code = std::to_string(report_run(experiment, outcome, run_options.out, options));
  }
  return std::stoi(ranks.from_root(code));
}

}  // namespace penumbra
