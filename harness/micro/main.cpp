// Microbenchmarks: whole estimates, and what their adaptation costs. Options are Google Benchmark's
// (--benchmark_filter=REGEX, --benchmark_format=json, ...).

#include <benchmark/benchmark.h>

#include <cstdio>
#include <exception>

#include "harness/build_info.h"
#include "harness/micro/register.h"

int main(int argc, char** argv) {
  using namespace penumbra;
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  const BuildInfo& build = build_info();
  benchmark::AddCustomContext("penumbra", std::string(build.version));
  benchmark::AddCustomContext("commit", std::string(build.commit));
  benchmark::AddCustomContext("compiler", std::string(build.compiler));
  benchmark::AddCustomContext("flags", std::string(build.flags));
  try {
    const micro::BenchTile tile = micro::make_bench_tile("checkerboard");
    micro::register_estimates(tile);
    micro::register_adaptation(tile);
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "penumbra_micro: error: %s\n", e.what());
    return 4;
  }
  benchmark::Shutdown();
  return 0;
}
