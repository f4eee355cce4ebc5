// gate, baseline and measure: the regression gate.

#include "harness/gate/gate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "harness/atomic_file.h"
#include "harness/build_info.h"
#include "harness/commands/commands.h"
#include "harness/gate/gate_adapters.h"
#include "harness/gate/gate_json.h"
#include "harness/gate/gate_junit.h"
#include "harness/gate/gate_markdown.h"
#include "harness/gate/gate_text.h"
#include "harness/gate/worker.h"
#include "harness/gate/worker_process.h"
#include "harness/keys.h"
#include "harness/progress.h"
#include "harness/project_root.h"
#include "harness/scratch_folder.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

/// The files of one gate: <stem>.json and, beside it, <stem>.md, .junit.xml, ...
class GateFiles {
 public:
  explicit GateFiles(const fs::path& json) : json_(json) {
    if (json.extension() != ".json") {
      throw InputError(
          fmt::format("--out: expected a name that ends in .json, found {}", json.string()));
    }
    const fs::path folder = fs::absolute(json).parent_path();
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw RunError(folder.string() + ": cannot be created: " + error.message());
  }

  fs::path beside(const std::string& extension) const {
    return fs::path(json_).replace_extension(extension);
  }
  const fs::path& json() const { return json_; }
  fs::path rows() const { return beside(".rows.csv"); }
  fs::path state() const { return beside(".state"); }

  /// Goes on with the rows of an interrupted gate of the same programs and config; removes others.
  void begin(const std::string& id) const {
    std::ifstream stream(state());
    std::string before;
    std::getline(stream, before);
    if (before == id) {
      note("going on with the runs of an interrupted gate");
    } else {
      fs::remove(rows());
    }
    fs::remove(json_);
    write_file_atomically(state(), id + "\n");
  }

  void finish(const GateResult& result) const {
    write_file_atomically(json_, gate_json(result).dump(2) + "\n");
    write_file_atomically(beside(".md"), gate_markdown(result));
    write_file_atomically(beside(".junit.xml"), gate_junit(result));
    write_file_atomically(beside(".benchmark-action.json"),
                          github_benchmark_json(result).dump(2) + "\n");
    write_file_atomically(beside(".bencher.json"), bencher_json(result).dump(2) + "\n");
    fs::remove(state());
  }

 private:
  fs::path json_;
};

std::string hash_of_file(const fs::path& file) {
  if (file.empty()) return "";
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file.string() + ": cannot be opened");
  const std::string bytes((std::istreambuf_iterator<char>(stream)),
                          std::istreambuf_iterator<char>());
  return hash_of_bytes(std::as_bytes(std::span(bytes)));
}

fs::path this_executable() { return fs::read_symlink("/proc/self/exe"); }

// Exactly one of the three ways to say what is compared.
GateSources sources_of(const GateCommandOptions& options) {
  GateSources sources = options.sources;
  const bool programs = !sources.base_exe.empty();
  const bool folders = !sources.base_folder.empty() || !sources.head_folder.empty();
  const bool stored = !sources.baseline.empty();
  if (programs + folders + stored != 1) {
    throw InputError(
        "gate: expected one of --base-exe EXE --head-exe EXE, --base DIR --head DIR, or "
        "--baseline DIR [--head-exe EXE]");
  }
  if (folders && (sources.base_folder.empty() || sources.head_folder.empty())) {
    throw InputError("gate: --base and --head belong together");
  }
  if (folders && !sources.head_exe.empty()) {
    throw InputError("gate: --head-exe has no meaning beside --base and --head");
  }
  if (!folders && sources.head_exe.empty()) sources.head_exe = this_executable();
  for (const fs::path& folder : {sources.base_folder, sources.head_folder}) {
    if (folder.empty() || fs::exists(folder / "measurements.csv")) continue;
    throw ReferenceError((folder / "measurements.csv").string() + ": there is no such file");
  }
  return sources;
}

fs::path config_of(const GateCommandOptions& options, const GateSources& sources) {
  if (!options.config.config.empty()) return options.config.config;
  if (!sources.head_folder.empty()) return sources.head_folder / "config.resolved.json";
  return project_root() / "configs" / "gate.json";
}

// --fail-on says which findings are an exit code; the files say all of them.
int exit_code_of(const GateResult& result, const GateCommandOptions& options) {
  if (options.exit_zero) return kSuccess;
  if (options.fail_on.empty() || result.exit_code == kSuccess) return result.exit_code;
  const char* const name = result.exit_code == kRegression     ? "regression"
                           : result.exit_code == kInconclusive ? "inconclusive"
                           : result.exit_code == kCorrectness  ? "correctness"
                                                               : "failure";
  const bool wanted =
      std::find(options.fail_on.begin(), options.fail_on.end(), name) != options.fail_on.end();
  return wanted ? result.exit_code : kSuccess;
}

GateResult run_gate(const Experiment& experiment, const GateSources& sources,
                    const GateOptions& options) {
  if (!sources.base_folder.empty()) return gate_folders(experiment, sources, options);
  if (!sources.baseline.empty()) return gate_against_baseline(experiment, sources, options);
  return gate_programs(experiment, sources, options);
}

}  // namespace

int gate_command(const GateCommandOptions& options) {
  handle_interrupts();
  const GateSources sources = sources_of(options);
  const fs::path config_file = config_of(options, sources);
  const Experiment experiment(load_config(config_file, options.config.overrides), {});
  const GateFiles files(options.out);
  GateOptions gate;
  gate.overrides = options.config.overrides;
  gate.rows = files.rows();
  gate.times = !options.no_times;
  const GateConfig thresholds = experiment.config().gate.value_or(GateConfig{});
  for (const std::string& text : options.acknowledged) {
    gate.accepted.push_back(parse_acknowledgement(text, thresholds.thresholds));
  }
  files.begin(hash_id({experiment.config().resolved_json, hash_of_file(sources.base_exe),
                       hash_of_file(sources.head_exe), sources.baseline.string(),
                       sources.base_folder.string(), sources.head_folder.string()}));
  try {
    const GateResult result = run_gate(experiment, sources, gate);
    files.finish(result);
    if (options.json) {
      fmt::print("{}\n", gate_json(result).dump(2));
    } else {
      fmt::print("{}\nresult: {}\nsummary: {}\nruns: {}\n", gate_text(result),
                 files.json().string(), files.beside(".md").string(), files.rows().string());
    }
    return exit_code_of(result, options);
  } catch (const GateInterrupted&) {
    note("interrupted; the same command goes on where it ended");
    return kInterrupted;
  }
}

int baseline_update_command(const BaselineCommandOptions& options) {
  handle_interrupts();
  const fs::path config_file = options.config.config.empty()
                                   ? project_root() / "configs" / "gate.json"
                                   : options.config.config;
  const Experiment experiment(load_config(config_file, options.config.overrides), {});
  const fs::path folder = options.folder.empty()
                              ? project_root() / "results" / "baseline" / experiment.config().name
                              : options.folder;
  GateOptions gate;
  gate.overrides = options.config.overrides;
  const ScratchFolder scratch("baseline");
  gate.rows = scratch.path() / "rows.csv";
  try {
    const GateResult result = update_baseline(
        experiment, options.executable.empty() ? this_executable() : options.executable, folder,
        options.reason, gate);
    if (result.exit_code == kSuccess) {
      fmt::print("wrote {}: {} cells, {} blocks\n", folder.string(), result.cells.size(),
                 result.blocks);
    } else {
      fmt::print("{}\nno baseline was written\n", result.sentence);
      for (const GateCell& cell : result.cells) {
        if (cell.verdict == GateVerdict::Fail) fmt::print("{}: {}\n", cell.name, cell.sentence);
      }
    }
    return result.exit_code;
  } catch (const GateInterrupted&) {
    return kInterrupted;
  }
}

int measure_command(const ConfigOptions& options) {
  // An interrupt of the terminal reaches the gate as well, which ends this program by itself.
  std::signal(SIGINT, SIG_IGN);
  serve_gate(load_config(options.config, options.overrides), std::cin, std::cout);
  return kSuccess;
}

}  // namespace penumbra
