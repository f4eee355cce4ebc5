// Microbenchmarks of the kernels: each is checked, then timed. Options of Google Benchmark
// (--benchmark_filter=REGEX, --benchmark_out=FILE, ...) pass through.

#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <string_view>

#include "harness/build_info.h"
#include "harness/clocks.h"
#include "harness/commands/commands.h"
#include "harness/micro/register.h"
#include "harness/micro/shares.h"
#include "scenes/core/error.h"

namespace penumbra::micro {
namespace {

struct Options {
  std::string config;
  bool shares{false};
  std::string shares_csv;
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("CONFIG", options.config,
                 "Sizes and scenes (configs/README.md) [configs/micro.json]");
  app.add_flag("--shares", options.shares,
               "In place of the benchmarks: what share of an estimate each kernel takes");
  app.add_option("--shares-csv", options.shares_csv, "The same, also into a CSV file");
  app.footer("Options of Google Benchmark, such as --benchmark_filter=REGEX, are passed on.");
}

// Says why where there is none.
std::string open_instruction_counter() {
  errno = 0;
  InstructionCounter::open();
  const int reason = errno;
  return InstructionCounter::read().valid
             ? "counted"
             : std::string("not counted: perf_event_open: ") + std::strerror(reason);
}

void add_context(const MicroConfig& config, const std::string& instructions) {
  const BuildInfo& build = build_info();
  benchmark::AddCustomContext("penumbra", std::string(build.version));
  benchmark::AddCustomContext("commit", std::string(build.commit));
  benchmark::AddCustomContext("compiler", std::string(build.compiler));
  benchmark::AddCustomContext("flags", std::string(build.flags));
  benchmark::AddCustomContext("build_type", std::string(build.build_type));
  benchmark::AddCustomContext("asserts", build.asserts ? "on: times mean nothing" : "off");
  benchmark::AddCustomContext("ray_tracing", RayScene::version());
  benchmark::AddCustomContext("cpu", machine_text());
  benchmark::AddCustomContext("config", config.file.string());
  benchmark::AddCustomContext("config_hash", config.hash);
  benchmark::AddCustomContext("instructions", instructions);
}

int run_benchmarks(Suite& suite) {
  register_adaptation_kernels(suite);
  register_adaptation_shares(suite);
  register_alsd_kernels(suite);
  register_mdhi_kernels(suite);
  register_sampler_kernels(suite);
  register_light_kernels(suite);
  register_delta_light_kernels(suite);
  register_bsdf_kernels(suite);
  register_ray_kernels(suite);
  register_estimates(suite);
  if (benchmark::RunSpecifiedBenchmarks() == 0) {
    throw InputError(
        "--benchmark_filter: no benchmark has such a name; --benchmark_list_tests "
        "lists them");
  }
  benchmark::Shutdown();
  if (suite.failures() == 0) return kSuccess;
  std::fprintf(stderr, "penumbra_micro: error: the checks of %d kernels found faults\n",
               suite.failures());
  return kRunFailure;
}

int run_main(int argc, char** argv) {
  Options options;
  CLI::App app("Microbenchmarks of Penumbra's kernels", "penumbra_micro");
  add_options(app, options);
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument != "--help" && argument != "-h") continue;
    std::fputs(app.help().c_str(), stdout);  // Google Benchmark would answer with its own alone
    return kSuccess;
  }
  const std::string instructions = open_instruction_counter();
  benchmark::Initialize(&argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    app.exit(e);
    return kInputFault;
  }
  try {
    Suite suite(load_micro_config(options.config.empty() ? default_micro_config()
                                                         : std::filesystem::path(options.config)));
    add_context(suite.config(), instructions);
    if (!options.shares && options.shares_csv.empty()) return run_benchmarks(suite);
    return print_shares(suite, options.shares_csv);
  } catch (const InputError& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return kInputFault;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "penumbra_micro: error: %s\n", e.what());
    return kRunFailure;
  }
}

}  // namespace
}  // namespace penumbra::micro

int main(int argc, char** argv) { return penumbra::micro::run_main(argc, argv); }
