#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>

#include "harness/micro/register.h"

namespace penumbra::micro {
namespace {

constexpr int kSpp = 4;
constexpr int kCheckRuns = 32;
// Of |z| between an estimator's mean and that of the check: false alarms once in 10^7 runs.
constexpr double kCheckLimit = 5.5;

// Whether the mean over the tile is the one that another estimator finds. A biased estimator must
// be finite; how far off it is is printed.
// @param spp  of each run
std::string estimate_fault(const BenchTile& tile, const EstimatorEntry& entry, const Budget& budget,
                           int spp, double& mean_error) {
  const std::string other = entry.name == "mis" ? "light" : "mis";
  const MeanEstimate expected = mean_over_tile(
      tile, *find_estimator(other), {SamplerKind::Independent, 32, 0}, spp, 2 * kCheckRuns, 0x1000);
  const MeanEstimate found = mean_over_tile(tile, entry, budget, spp, kCheckRuns, 0x2000);
  mean_error = found.mean / expected.mean - 1.0;
  if (!found.finite) return "estimates are not finite";
  const double z =
      (found.mean - expected.mean) / std::hypot(found.standard_error, expected.standard_error);
  if (!entry.bias_reason(default_params(entry)).empty() || std::abs(z) < kCheckLimit) return {};
  return fmt::format("mean {} differs from {} by {} ({:+.1f} standard errors)", found.mean,
                     expected.mean, other, z);
}

void time_estimate(benchmark::State& state, Suite& suite, const std::string& scene,
                   const EstimatorEntry& entry, int srl) {
  const Budget budget = budget_of(entry, srl);
  const BenchTile& tile = suite.tile(scene);
  const std::string key = fmt::format("estimate/{}/{}/{}", entry.name, scene, srl);
  double& mean_error = suite.remembered(key);
  if (!suite.passes(state, key, [&] {
        return estimate_fault(tile, entry, budget, suite.config().check_spp, mean_error);
      })) {
    return;
  }
  const std::unique_ptr<Estimator> estimator =
      entry.create(*tile.scene, default_params(entry), budget);
  const Tile job = tile.tile(kSpp);
  std::vector<Rgb> radiance(job.estimate_count());
  EstimateCounters counters;
  std::uint64_t seed = 1;
  Work work{"estimate", static_cast<double>(job.estimate_count()), &suite.ray_meter(scene)};
  work.samples = static_cast<double>(job.estimate_count()) * budget.srl() *
                 static_cast<double>(tile.scene->sampled_lights().size());
  time_kernel(state, work, [&] {
    TileOutput out;
    out.radiance = radiance;
    estimator->estimate(job, seed++, out);
    counters += out.counters;
    benchmark::DoNotOptimize(radiance.data());
  });
  const auto estimates = static_cast<double>(counters.estimates);
  const double whole_ns = state.counters["ns_per_estimate"] * estimates;
  state.counters["ns_per_sample"] = whole_ns / static_cast<double>(counters.samples);
  state.counters["ns_per_ray"] = whole_ns / static_cast<double>(counters.rays);
  state.counters["rays"] = static_cast<double>(counters.rays) / estimates;
  state.counters["samples"] = static_cast<double>(counters.samples) / estimates;
  state.counters["mean_error"] = mean_error;
}

}  // namespace

void register_estimates(Suite& suite) {
  for (const std::string& scene : suite.config().scenes) {
    for (const EstimatorEntry* entry : all_estimators()) {
      for (const int srl : suite.config().estimate_srl) {
        benchmark::RegisterBenchmark(
            fmt::format("estimate/{}/{}/srl:{}", entry->name, scene, srl_text(*entry, srl)).c_str(),
            [&suite, scene, entry, srl](benchmark::State& state) {
              time_estimate(state, suite, scene, *entry, srl);
            });
      }
    }
  }
}

}  // namespace penumbra::micro
