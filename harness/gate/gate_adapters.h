#pragma once

#include <nlohmann/json_fwd.hpp>

#include "harness/gate/gate_result.h"

/// Efficiency of head over base, of every cell and of all together, for services that draw trends.
/// They want a number, so what has no efficiency, or one that is not finite, is left out; gate.json
/// has it with its reason.
namespace penumbra {

/// For the tool "customBiggerIsBetter" of github-action-benchmark: name, unit, value, range (95 %),
/// extra (verdict and sentence). An empty list is an error to that action.
/// Source: https://github.com/benchmark-action/github-action-benchmark, README.md and
/// extractCustomBenchmarkResult in src/extract.ts.
nlohmann::ordered_json github_benchmark_json(const GateResult& result);

/// Bencher Metric Format: value, lower_value and upper_value (95 %) of the measure
/// "efficiency-ratio" by name of the benchmark.
/// Source: https://bencher.dev/docs/reference/bencher-metric-format
nlohmann::ordered_json bencher_json(const GateResult& result);

}  // namespace penumbra
