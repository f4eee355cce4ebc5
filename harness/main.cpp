#include <CLI/CLI.hpp>
#include <cstdio>
#include <new>
#include <string>

#include "harness/build_info.h"
#include "harness/clocks.h"
#include "harness/commands/commands.h"
#include "scenes/core/error.h"

#ifdef __FAST_MATH__
#error "fast-math deletes the checks for NaN; build without -ffast-math"
#endif

namespace penumbra {
namespace {

void add_config(CLI::App& command, ConfigOptions& options) {
  command.add_option("CONFIG", options.config, "Experiment, JSON (configs/README.md)")->required();
  command
      .add_option("--set", options.overrides, "key.path=value, overrides the config; repeatable")
      ->take_all()
      ->allow_extra_args(false);
}

int fail(const char* what, int code) {
  std::fprintf(stderr, "penumbra: error: %s\n", what);
  return code;
}

// All options of one call; the subcommand that was given decides which are used.
struct Options {
  ListOptions list;
  ConfigOptions validate, plan;
  ReferenceOptions reference;
  RunCommandOptions run;
  RenderOptions render;
  InspectOptions inspect;
  ReplayOptions replay;
  std::filesystem::path report;
  SelfTestCommandOptions selftest;
};

void add_list(CLI::App& app, Options& o) {
  CLI::App* c = app.add_subcommand("list", "Lists estimators, scenes and metrics");
  c->add_option("WHAT", o.list.what, "estimators, scenes or metrics; all when left out")
      ->check(CLI::IsMember({"all", "estimators", "scenes", "metrics"}));
  c->add_flag("--json", o.list.json, "For machines");
}

void add_config_commands(CLI::App& app, Options& o) {
  add_config(
      *app.add_subcommand("validate", "Checks a config: all errors at once, with their places"),
      o.validate);
  add_config(*app.add_subcommand("plan", "Shows the cells of a config and predicts time and disk"),
             o.plan);

  CLI::App* reference =
      app.add_subcommand("reference", "Renders or extends the references of a config");
  add_config(*reference, o.reference.config);
  reference->add_option("--scene", o.reference.scene, "Only this scene");
  reference->add_option("--add-spp", o.reference.add_spp, "Adds this many estimates per pixel");
  reference->add_flag("--small", o.reference.small,
                      "Also puts it into references/small/ and references/manifest.json");
  reference->add_option("--threads", o.reference.threads, "0: all cores");

  CLI::App* run =
      app.add_subcommand("run", "Runs an experiment; goes on where an earlier run of it ended");
  add_config(*run, o.run.config);
  run->add_option("--out", o.run.out, "Folder of the results [results/<name of the config>]");
  run->add_option("--only", o.run.only, "Glob on scene/label/sampler: only these cells");
  run->add_option("--tag", o.run.tag, "Only methods with this tag");
  run->add_option("--threads", o.run.threads, "0: all cores");

  CLI::App* report = app.add_subcommand("report", "Makes all tables of a result folder again");
  report->add_option("DIR", o.report, "Folder of a run's results")->required();
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
}

void add_inspect(CLI::App& app, Options& o) {
  CLI::App* c = app.add_subcommand("inspect",
                                   "Shows what a scene has, what it does not need and what that "
                                   "saves, and where an estimate's time goes");
  c->add_option("SCENE", o.inspect.scene)->required();
  c->add_flag("--keep-all", o.inspect.keep_all,
              "Builds and samples also what the scene does not need");
  c->add_flag("--json", o.inspect.json, "For machines");
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

int dispatch(const CLI::App& app, Options& o) {
  if (app.got_subcommand("list")) return list_command(o.list);
  if (app.got_subcommand("validate")) return validate_command(o.validate);
  if (app.got_subcommand("plan")) return plan_command(o.plan);
  if (app.got_subcommand("reference")) return reference_command(o.reference);
  if (app.got_subcommand("run")) return run_command(o.run);
  if (app.got_subcommand("report")) return report_command(o.report);
  if (app.got_subcommand("render")) return render_command(o.render);
  if (app.got_subcommand("selftest")) return selftest_command(o.selftest);
  if (app.got_subcommand("replay")) return replay_command(o.replay);
  return inspect_command(o.inspect);
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
  add_render(app, options);
  add_inspect(app, options);
  add_replay(app, options);
  add_selftest(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const int code = app.exit(e);
    return code == 0 ? kSuccess : kInputFault;
  }
  for (int i = 0; i < argc; ++i) {
    options.run.command_line += (i > 0 ? " " : "") + std::string(argv[i]);
  }
  try {
    return dispatch(app, options);
  } catch (const InputError& e) {
    return fail(e.what(), kInputFault);
  } catch (const ReferenceError& e) {
    return fail(e.what(), kReferenceFault);
  } catch (const std::bad_alloc&) {
    return fail("out of memory", kRunFailure);
  } catch (const std::exception& e) {
    return fail(e.what(), kRunFailure);
  }
}

}  // namespace
}  // namespace penumbra

int main(int argc, char** argv) {
  penumbra::InstructionCounter::open();
  return penumbra::run_main(argc, argv);
}
