#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>

#include "harness/micro/register.h"

namespace penumbra::micro {
namespace {

constexpr int kSpp = 4;
constexpr int kCheckRuns = 32;
constexpr int kCheckSpp = 16;
// Of |z| between an estimator's mean and that of the check: false alarms once in 10^7 runs.
constexpr double kCheckLimit = 5.5;

Budget budget_of(const EstimatorEntry& entry, int srl) {
  const int initial = srl / 4;
  return entry.adaptive ? Budget{SamplerKind::Independent, initial, srl - initial}
                        : Budget{SamplerKind::Independent, srl, 0};
}

// Whether the mean over the tile is the one that another estimator finds. A biased estimator must
// be finite; how far off it is is printed.
std::string fault_of(const BenchTile& tile, const EstimatorEntry& entry, const Budget& budget,
                     double& mean_error) {
  const std::string other = entry.name == "mis" ? "light" : "mis";
  const MeanEstimate expected =
      mean_over_tile(tile, *find_estimator(other), {SamplerKind::Independent, 32, 0}, kCheckSpp,
                     2 * kCheckRuns, 0x1000);
  const MeanEstimate found = mean_over_tile(tile, entry, budget, kCheckSpp, kCheckRuns, 0x2000);
  mean_error = found.mean / expected.mean - 1.0;
  if (!found.finite) return "estimates are not finite";
  const double z =
      (found.mean - expected.mean) / std::hypot(found.standard_error, expected.standard_error);
  if (!entry.bias_reason(default_params(entry)).empty() || std::abs(z) < kCheckLimit) return {};
  return fmt::format("mean {} differs from {} by {} ({:+.1f} standard errors)", found.mean,
                     expected.mean, other, z);
}

void estimate(benchmark::State& state, const BenchTile& tile, const EstimatorEntry& entry,
              const Budget& budget) {
  double mean_error = 0.0;
  const std::string fault = fault_of(tile, entry, budget, mean_error);
  if (!fault.empty()) {
    state.SkipWithError(fault.c_str());
    return;
  }
  const std::unique_ptr<Estimator> estimator =
      entry.create(*tile.scene, default_params(entry), budget);
  const Tile job = tile.tile(kSpp);
  std::vector<Rgb> radiance(job.estimate_count());
  EstimateCounters counters;
  std::uint64_t seed = 1;
  for (auto _ : state) {
    TileOutput out;
    out.radiance = radiance;
    estimator->estimate(job, seed++, out);
    counters += out.counters;
    benchmark::DoNotOptimize(radiance.data());
  }
  const auto estimates = static_cast<double>(counters.estimates);
  using benchmark::Counter;
  state.counters["per_estimate"] = Counter(estimates, Counter::kIsRate | Counter::kInvert);
  state.counters["per_ray"] =
      Counter(static_cast<double>(counters.rays), Counter::kIsRate | Counter::kInvert);
  state.counters["rays"] = static_cast<double>(counters.rays) / estimates;
  state.counters["samples"] = static_cast<double>(counters.samples) / estimates;
  state.counters["mean_error"] = mean_error;
}

}  // namespace

void register_estimates(const BenchTile& tile) {
  for (const EstimatorEntry* entry : all_estimators()) {
    for (const int srl : {16, 64}) {
      const Budget budget = budget_of(*entry, srl);
      const std::string text = entry->adaptive
                                   ? fmt::format("{}-{}", budget.srl_initial, budget.srl_adaptive)
                                   : fmt::format("{}", srl);
      benchmark::RegisterBenchmark(
          fmt::format("estimate/{}/{}/srl:{}", entry->name, tile.scene->name(), text).c_str(),
          [&tile, entry, budget](benchmark::State& state) {
            estimate(state, tile, *entry, budget);
          });
    }
  }
}

}  // namespace penumbra::micro
