#include <CLI/CLI.hpp>
#include <cstdio>
#include <new>
#include <string>

#include "harness/build_info.h"
#include "harness/clocks.h"
#include "harness/commands/commands.h"
#include "harness/mpi_ranks.h"
#include "harness/progress.h"
#include "harness/rank_places.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

void add_config(CLI::App& command, ConfigOptions& options) {
  command.add_option("CONFIG", options.config, "Experiment, JSON (configs/README.md)")->required();
  command
      .add_option("--set", options.overrides, "key.path=value, overrides the config; repeatable")
      ->take_all()
      ->allow_extra_args(false);
}

// Ends all ranks, of which none can go on without this one.
int fail(const Ranks& ranks, const std::string& what, int code) {
  const std::string who =
      ranks.count() > 1 ? "rank " + std::to_string(ranks.rank()) + " on host " + host_name() + ": "
                        : "";
  std::fprintf(stderr, "penumbra: error: %s%s\n", who.c_str(), what.c_str());
  if (ranks.count() > 1) ranks.abort(code);
  return code;
}

// All options of one call; the subcommand that was given decides which are used.
struct Options {
  ListOptions list;
  ConfigOptions validate;
  PlanOptions plan;
  ReferenceOptions reference;
  RunCommandOptions run;
  MergeOptions merge;
  RenderOptions render;
  InspectOptions inspect;
  ReplayOptions replay;
  ReportOptions report;
  FigureCommandOptions figure;
  SelfTestCommandOptions selftest;
  StabilityCommandOptions stability;
  GateCommandOptions gate;
  BaselineCommandOptions baseline;
  ConfigOptions measure;
};

void add_list(CLI::App& app, Options& o) {
  CLI::App* c = app.add_subcommand("list", "Lists estimators, scenes, metrics and stability cases");
  c->add_option("WHAT", o.list.what, "estimators, scenes, metrics or stability; all when left out")
      ->check(CLI::IsMember({"all", "estimators", "scenes", "metrics", "stability"}));
  c->add_flag("--json", o.list.json, "For machines");
}

void add_config_commands(CLI::App& app, Options& o) {
  add_config(
      *app.add_subcommand("validate", "Checks a config: all errors at once, with their places"),
      o.validate);
  CLI::App* plan =
      app.add_subcommand("plan", "Shows the cells of a config and predicts time and disk");
  add_config(*plan, o.plan.config);
  plan->add_option("--lock", o.plan.lock, "File to freeze the plan in, for shards (run --plan)");
  plan->add_option("--shard", o.plan.shard, "I/N: only every N-th scene, from the I-th on");
  plan->add_option("--hosts", o.plan.hosts, "Predicts for this many hosts")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();

  CLI::App* reference =
      app.add_subcommand("reference", "Renders or extends the references of a config");
  add_config(*reference, o.reference.config);
  reference->add_option("--scene", o.reference.scene, "Only this scene");
  reference->add_option("--add-spp", o.reference.add_spp, "Adds this many estimates per pixel");
  reference->add_flag("--small", o.reference.small,
                      "Also puts it into references/small/ and references/manifest.json");
  reference->add_option("--shard", o.reference.shard,
                        "I/N: only every N-th scene, from the I-th on");
  reference->add_option("--threads", o.reference.threads, "0: all cores");

  CLI::App* run =
      app.add_subcommand("run", "Runs an experiment; goes on where an earlier run of it ended");
  add_config(*run, o.run.config);
  run->add_option("--out", o.run.out, "Folder of the results [results/<name of the config>]");
  run->add_option("--only", o.run.only, "Glob on scene/label/sampler: only these cells");
  run->add_option("--tag", o.run.tag, "Only methods with this tag");
  run->add_option("--threads", o.run.threads, "0: all cores");
  run->add_flag("--json", o.run.json, "Prints efficiency.json in place of the tables");
  run->add_option("--shard", o.run.shard,
                  "I/N: only every N-th pair of blocks of a scene, from the I-th on");
  run->add_option(
         "--plan", o.run.plans,
         "Frozen plan of `penumbra plan --lock`; repeatable, where plans are of some scenes")
      ->take_all()
      ->allow_extra_args(false);

  CLI::App* merge = app.add_subcommand("merge", "Puts the folders of `run --shard` together");
  merge->add_option("DIR", o.merge.folders, "Folders of the shards")->required();
  merge->add_option("--out", o.merge.out, "Folder of the result; must not exist")->required();
  merge->add_flag("--partial", o.merge.partial, "Although blocks are missing");
  merge->add_flag("--json", o.merge.json, "Prints efficiency.json in place of the tables");

  CLI::App* report = app.add_subcommand(
      "report", "Makes all tables and the page (report.html) of a result folder again");
  report->add_option("DIR", o.report.folder, "Folder of a run's results")->required();
  report->add_flag("--embed", o.report.embed,
                   "Pictures into the page itself, in place of a folder beside it");
  report->add_flag("--json", o.report.json, "Prints efficiency.json in place of the tables");
}

void add_figure(CLI::App& app, Options& o) {
  CLI::App* c = app.add_subcommand(
      "figure", "Draws the methods of a scene side by side, with their errors, for a paper");
  FigureOptions& f = o.figure.figure;
  c->add_option("DIR", o.figure.folder, "Folder of a run's results")->required();
  c->add_option("--scene", f.scene)->required();
  c->add_option("--crop", f.crops,
                "Name of a crop of the config, or X,Y,WIDTH,HEIGHT; repeatable [all of the config]")
      ->take_all()
      ->allow_extra_args(false);
  c->add_option("--method", f.labels, "Label, from left to right; repeatable [all]")
      ->take_all()
      ->allow_extra_args(false);
  c->add_option("--exposure", f.exposure, "Stops")->capture_default_str();
  c->add_option("-o,--out", f.out, ".png, .svg or .pdf")->required();
}

void add_render(CLI::App& app, Options& o) {
  CLI::App* c = app.add_subcommand("render", "Renders one picture");
  c->add_option("SCENE", o.render.scene, "Name of a scene (penumbra list scenes) or a scene file")
      ->required();
  c->add_option("--estimator", o.render.estimator, "Name (penumbra list estimators)")
      ->capture_default_str();
  c->add_option("--spp", o.render.spp, "Estimates and camera samples per pixel")
      ->capture_default_str();
  c->add_option("--srl", o.render.srl, "Shadow rays per light: A, or A-B (initial-adaptive)")
      ->capture_default_str();
  c->add_option("--sampler", o.render.sampler, "independent, stratified or sobol")
      ->capture_default_str();
  c->add_option("--quantity", o.render.quantity, "radiance or irradiance")->capture_default_str();
  c->add_option("--set", o.render.params, "name=value of an estimator's parameter; repeatable")
      ->take_all()
      ->allow_extra_args(false);
  c->add_option("--resolution", o.render.resolution, "WIDTH HEIGHT")->expected(2);
  c->add_option("--seed", o.render.seed)->capture_default_str();
  c->add_option("--exposure", o.render.exposure, "Stops, for PNG")->capture_default_str();
  c->add_option("--threads", o.render.threads, "0: all cores")->capture_default_str();
  c->add_flag("--keep-all", o.render.keep_all,
              "Builds and samples also what the scene does not need");
  c->add_option("-o,--out", o.render.out, ".exr (all layers) or .png")->required();
  c->add_option("--maps", o.render.maps, "Also the estimator's maps, as a PNG");
  c->add_flag("--json", o.render.json, "Prints work, times and build, for machines");
}

void add_inspect(CLI::App& app, Options& o) {
  CLI::App* c = app.add_subcommand("inspect",
                                   "Shows what a scene has, what it does not need and what that "
                                   "saves, and where an estimate's time goes");
  c->add_option("SCENE", o.inspect.scene)->required();
  c->add_flag("--keep-all", o.inspect.keep_all,
              "Builds and samples also what the scene does not need");
  c->add_flag("--json", o.inspect.json, "For machines");
  InspectOptions& inspect = o.inspect;
  c->add_option("--estimator", inspect.estimator, "Only where the time of this one goes");
  c->add_option("--srl", inspect.srl, "Of --estimator: A, or A-B (initial-adaptive)")
      ->capture_default_str();
  c->add_option("--sampler", inspect.sampler, "Of --estimator: independent, stratified or sobol")
      ->capture_default_str();
  c->add_option("--spp", inspect.spp, "Of --estimator: estimates per pixel")->capture_default_str();
  c->add_option("--set", inspect.params, "Of --estimator: name=value of a parameter; repeatable")
      ->take_all()
      ->allow_extra_args(false);
}

void add_replay(CLI::App& app, Options& o) {
  CLI::App* c = app.add_subcommand(
      "replay", "Runs one pixel of a measured row again and prints every sample of it");
  c->add_option("DIR", o.replay.folder, "Folder of a run's results")->required();
  c->add_option("--row", o.replay.row, "run_id of measurements.csv, or the beginning of one")
      ->required();
  c->add_option("--pixel", o.replay.pixel, "X,Y, from 0,0 at the upper left")->required();
  c->add_option("--estimate", o.replay.estimate, "Only this estimate of the pixel");
  c->add_flag("--json", o.replay.json, "For machines, with every digit");
  c->add_flag("--verify", o.replay.verify, "Also renders the whole row and compares all bits");
  c->add_option("--threads", o.replay.threads, "Of --verify; 0: all cores")->capture_default_str();
}

void add_selftest(CLI::App& app, Options& o) {
  CLI::App* c = app.add_subcommand(
      "selftest", "Checks the statistics: coverage of intervals, false alarms and power of tests");
  c->add_flag("--quick", o.selftest.quick, "Fewer trials, and wider allowed ranges");
  c->add_flag("--json", o.selftest.json, "For machines");
}

void add_stability(CLI::App& app, Options& o) {
  CLI::App* c = app.add_subcommand(
      "stability", "Runs every estimator on stiff and extreme cases with known answers");
  c->add_option("--estimator", o.stability.estimator, "Only this one (penumbra list estimators)");
  c->add_option("--case", o.stability.case_name,
                "Only this case (penumbra list stability), with all its statistics");
  c->add_option("--out", o.stability.out,
                "Folder for stability.csv, stability.json and stability.png");
  c->add_flag("--quick", o.stability.quick, "Fewer steps and estimates");
  c->add_flag("--json", o.stability.json, "For machines");
  c->add_option("--threads", o.stability.threads, "0: all cores")->capture_default_str();
}

void add_gate(CLI::App& app, Options& o) {
  CLI::App* gate =
      app.add_subcommand("gate", "Whether a program is noisier, slower or wrong than another one");
  GateCommandOptions& g = o.gate;
  const auto add_inputs = [](CLI::App& command, ConfigOptions& config) {
    command.add_option("--config", config.config, "Experiment [configs/gate.json]");
    command.add_option("--set", config.overrides, "key.path=value; repeatable")
        ->take_all()
        ->allow_extra_args(false);
  };
  add_inputs(*gate, g.config);
  gate->add_option("--base-exe", g.sources.base_exe, "Program of the base, measured in turns");
  gate->add_option("--head-exe", g.sources.head_exe, "Program of the head [this one]");
  gate->add_option("--base", g.sources.base_folder, "Result folder of the base");
  gate->add_option("--head", g.sources.head_folder, "Result folder of the head");
  gate->add_option("--baseline", g.sources.baseline,
                   "Stored baseline in place of a base: hashes, counts and errors only");
  gate->add_option("--out", g.out, "Result; a summary and other forms are written beside it")
      ->capture_default_str();
  gate->add_option("--ack", g.acknowledged, "\"CELLS -4% reason\": accepts a loss; repeatable")
      ->take_all()
      ->allow_extra_args(false);
  gate->add_option("--fail-on", g.fail_on,
                   "Findings that are an exit code [all]: regression, inconclusive, correctness, "
                   "failure; repeatable")
      ->check(CLI::IsMember({"regression", "inconclusive", "correctness", "failure"}))
      ->delimiter(',');
  gate->add_flag("--exit-zero", g.exit_zero, "Exit code 0 whatever was found");
  gate->add_flag("--no-times", g.no_times,
                 "CPU time decides nothing: for machines too noisy for it");
  gate->add_flag("--json", g.json, "Prints gate.json");

  CLI::App* baseline = app.add_subcommand("baseline", "Stored baselines of the gate");
  baseline->require_subcommand(1);
  CLI::App* update = baseline->add_subcommand(
      "update", "Measures anew what a gate compares without times, and writes it");
  add_inputs(*update, o.baseline.config);
  update->add_option("--exe", o.baseline.executable, "Program to measure [this one]");
  update->add_option("--baseline", o.baseline.folder, "Folder [results/baseline/<config>]");
  update->add_option("--reason", o.baseline.reason, "Why it changes; kept in the files")
      ->required();

  // For the gate itself, which starts it.
  add_config(
      *app.add_subcommand("measure", "Makes the runs that a gate asks for on stdin")->group(""),
      o.measure);
}

int dispatch(const CLI::App& app, Options& o) {
  if (app.got_subcommand("list")) return list_command(o.list);
  if (app.got_subcommand("validate")) return validate_command(o.validate);
  if (app.got_subcommand("plan")) return plan_command(o.plan);
  if (app.got_subcommand("reference")) return reference_command(o.reference);
  if (app.got_subcommand("run")) return run_command(o.run);
  if (app.got_subcommand("merge")) return merge_command(o.merge);
  if (app.got_subcommand("report")) return report_command(o.report);
  if (app.got_subcommand("figure")) return figure_command(o.figure);
  if (app.got_subcommand("render")) return render_command(o.render);
  if (app.got_subcommand("selftest")) return selftest_command(o.selftest);
  if (app.got_subcommand("stability")) return stability_command(o.stability);
  if (app.got_subcommand("replay")) return replay_command(o.replay);
  if (app.got_subcommand("gate")) return gate_command(o.gate);
  if (app.got_subcommand("baseline")) return baseline_update_command(o.baseline);
  if (app.got_subcommand("measure")) return measure_command(o.measure);
  return inspect_command(o.inspect);
}

int call(const CLI::App& app, Options& options, const Ranks& ranks) {
  options.run.ranks = options.reference.ranks = &ranks;
  if (!ranks.is_root()) silence_progress();
  try {
    return dispatch(app, options);
  } catch (const InputError& e) {
    return fail(ranks, e.what(), kInputFault);
  } catch (const ReferenceError& e) {
    return fail(ranks, e.what(), kReferenceFault);
  } catch (const std::bad_alloc&) {
    return fail(ranks, "out of memory", kRunFailure);
  } catch (const std::exception& e) {
    return fail(ranks, e.what(), kRunFailure);
  }
}

int run_main(int argc, char** argv) {
  CLI::App app("Penumbra: benchmark and evaluation harness for direct-lighting estimators",
               "penumbra");
  app.set_version_flag("--version", std::string(build_info().version) + " (" +
                                        std::string(build_info().commit) + ")");
  app.require_subcommand(1);
  Options options;
  add_list(app, options);
  add_config_commands(app, options);
  add_figure(app, options);
  add_render(app, options);
  add_inspect(app, options);
  add_replay(app, options);
  add_selftest(app, options);
  add_stability(app, options);
  add_gate(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const int code = app.exit(e);
    return code == 0 ? kSuccess : kInputFault;
  }
  for (int i = 0; i < argc; ++i) {
    options.run.command_line += (i > 0 ? " " : "") + std::string(argv[i]);
  }
  options.merge.command_line = options.run.command_line;
  if (!app.got_subcommand("run") && !app.got_subcommand("reference")) {
    return call(app, options, single_rank());
  }
  try {
    return call(app, options, Ranks::launched());
  } catch (const InputError& e) {
    return fail(single_rank(), e.what(), kInputFault);
  }
}

}  // namespace
}  // namespace penumbra

int main(int argc, char** argv) {
  penumbra::InstructionCounter::open();
  return penumbra::run_main(argc, argv);
}
