#include "harness/selftest.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "harness/bias_test.h"
#include "harness/clocks.h"
#include "harness/curves.h"
#include "harness/keys.h"
#include "harness/progress.h"
#include "harness/selftest_scene.h"
#include "harness/statistics.h"

namespace penumbra {
namespace {

constexpr int kBlocks = 10;
constexpr double kNominal = 0.95;
constexpr double kLevel = 0.05;
/// Of a one-sided bound on a share: a correct share exceeds it in one of a thousand runs.
constexpr double kBound = 3.09;
constexpr double kNarrow = 0.7;
constexpr double kBrightness = 1.25;
constexpr double kPlantedError = 1.02;
constexpr double kBiasLevel = 0.01;
constexpr int kReplicates = 16;
constexpr std::array<int, 2> kTileSides{16, 8};
/// Of the whole image's mean: what float arithmetic may cost.
constexpr double kRounding = 1e-5;
/// Stands for a time where the outcome must not depend on the machine.
constexpr double kSecondsPerRay = 1e-6;

std::uint64_t seed_of(std::string_view check, int trial, int block, std::string_view method) {
  return hash_texts({"selftest", check, std::to_string(trial), std::to_string(block), method});
}

double binomial_error(double share, int trials) { return std::sqrt(share * (1 - share) / trials); }

/// Share of trials that hold, tried on all cores.
double share_of(int trials, const std::function<bool(int)>& trial) {
  std::vector<char> holds(static_cast<std::size_t>(trials));
  tbb::parallel_for(0, trials, [&](int i) { holds[static_cast<std::size_t>(i)] = trial(i); });
  return static_cast<double>(std::count(holds.begin(), holds.end(), 1)) / trials;
}

double width_factor(const SelfTestOptions& options) {
  return options.planted == PlantedFault::NarrowIntervals ? kNarrow : 1;
}

double energy_factor(const SelfTestOptions& options) {
  return options.planted == PlantedFault::EnergyError ? kBrightness : 1;
}

bool covers(std::span<const PairedCostError> blocks, double truth, const SelfTestOptions& options) {
  const EfficiencyEstimate estimate = log_efficiency_ratio(blocks);
  if (!estimate.log || !estimate.log->interval) return false;
  const double half_width = estimate.log->interval->hi - estimate.log->value;
  return std::abs(estimate.log->value - truth) <= width_factor(options) * half_width;
}

/// What is allowed of a coverage: 0.92 to 0.97, wider by twice the noise of few trials.
SelfTestCheck coverage_check(std::string name, std::string claim, int trials, bool quick) {
  SelfTestCheck check{std::move(name), std::move(claim), trials};
  check.error = binomial_error(kNominal, trials);
  const double more = quick ? 2 * check.error : 0;
  check.least = 0.92 - more;
  check.most = std::min(1.0, 0.97 + more);
  return check;
}

/// Blocks as a shared machine gives them: times with a drift that all methods share, a random walk
/// of 10 % per block, and 6 % of their own; log-normal errors of relative standard deviation 0.53
/// and skewness 1.75. The method takes 1.5 and errs 0.5 times as much as its baseline.
std::vector<PairedCostError> simulated_blocks(std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const auto uniform = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };
  const auto gaussian = [&] {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  };
  std::vector<PairedCostError> blocks;
  double drift = 1;
  for (int i = 0; i < kBlocks; ++i) {
    drift *= std::exp(0.1 * gaussian());
    PairedCostError block;
    block.method.cost = 1.5 * drift * std::exp(0.06 * gaussian());
    block.baseline.cost = drift * std::exp(0.06 * gaussian());
    block.method.error = 0.5 * std::exp(0.5 * gaussian());
    block.baseline.error = std::exp(0.5 * gaussian());
    blocks.push_back(block);
  }
  return blocks;
}

SelfTestCheck check_simulated_coverage(const SelfTestOptions& options) {
  SelfTestCheck check =
      coverage_check("coverage, simulated",
                     "95 % intervals of efficiency ratios at 10 heavy-tailed blocks hold the truth",
                     options.quick ? 4000 : 40000, options.quick);
  const double truth = -std::log(1.5 * 0.5);
  check.measured = share_of(check.trials, [&](int trial) {
    return covers(simulated_blocks(seed_of("simulated", trial, 0, "")), truth, options);
  });
  return check;
}

CostError cost_error(const AnalyticScene& scene, const RenderResult& result) {
  return {static_cast<double>(result.counters.rays), scene.mean_square_error(result)};
}

SelfTestCheck check_rendered_coverage(const SelfTestOptions& options) {
  SelfTestCheck check =
      coverage_check("coverage, rendered",
                     "likewise for renders: \"mis\" over \"light\" by rays, the truth from all",
                     options.quick ? 200 : 1000, options.quick);
  const AnalyticScene scene(16);
  std::vector<PairedCostError> all(static_cast<std::size_t>(check.trials * kBlocks));
  tbb::parallel_for(0, check.trials * kBlocks, [&](int i) {
    const auto render = [&](const char* method) {
      return cost_error(scene, scene.render(method, 1, 2, seed_of("rendered", i, 0, method)));
    };
    all[static_cast<std::size_t>(i)] = {render("mis"), render("light")};
  });
  const double truth = log_efficiency_ratio(all).log.value().value;
  check.measured = share_of(check.trials, [&](int trial) {
    const auto first = static_cast<std::size_t>(trial * kBlocks);
    return covers(std::span(all).subspan(first, kBlocks), truth, options);
  });
  return check;
}

/// Whether the bias test rejects replicates of "mis", made `planted` times too bright.
bool is_rejected(const AnalyticScene& scene, int repetition, double planted,
                 const SelfTestOptions& options) {
  const std::vector<BiasTile> tiles = bias_tiles(scene.side(), scene.side(), kTileSides);
  TileReplicates replicates(tiles);
  const char* const stream = planted == 1 ? "alarm" : "power";
  for (int i = 0; i < kReplicates; ++i) {
    const std::uint64_t seed = seed_of(stream, repetition, i, "mis");
    // What is rendered as unbiased carries the fault; a planted error is known.
    const double energy = planted == 1 ? energy_factor(options) : planted;
    replicates.add(scene.render("mis", 1, 6, seed, energy).radiance);
  }
  BiasTestOptions test;
  test.level = kBiasLevel;
  test.tolerance = options.planted == PlantedFault::BlindBiasTest ? 0.1 : kRounding;
  return bias_test(replicates, TileReplicates::exact(tiles, scene.exact()), test).rejected;
}

SelfTestCheck check_false_alarms(const SelfTestOptions& options) {
  SelfTestCheck check{"bias test, false alarms",
                      "unbiased renders are called biased, 16 replicates, level 1 %",
                      options.quick ? 50 : 300};
  check.error = binomial_error(kBiasLevel, check.trials);
  check.least = 0;
  check.most = 1.0 / 50;
  const AnalyticScene scene(32);
  check.measured =
      share_of(check.trials, [&](int trial) { return is_rejected(scene, trial, 1, options); });
  return check;
}

SelfTestCheck check_power(const SelfTestOptions& options) {
  SelfTestCheck check{"bias test, power", "a planted energy error of 2 % is found, likewise",
                      options.quick ? 50 : 300};
  check.error = binomial_error(kNominal, check.trials);
  check.least = 0.95;
  const AnalyticScene scene(32);
  check.measured = share_of(
      check.trials, [&](int trial) { return is_rejected(scene, trial, kPlantedError, options); });
  return check;
}

/// A row as a run would leave it; `time_s` is its CPU and wall time.
RunRow row_of(const AnalyticScene& scene, const RenderResult& result, int trial, int block,
              std::string label, double time_s) {
  RunRow row;
  row.run_id = fmt::format("{}-{}-{}", trial, block, label);
  row.scene = fmt::format("trial {}", trial);
  row.label = std::move(label);
  row.estimator = "mis";
  row.sampler = "independent";
  row.block = block;
  row.rays = result.counters.rays;
  row.time_cpu_s = time_s;
  row.time_wall_s = time_s;
  row.mse = row.mse_naive = scene.mean_square_error(result);
  row.relmse = *row.mse / (scene.exact_mean() * scene.exact_mean());
  row.mean_error = scene.mean_error(result);
  row.reference_mean = scene.exact_mean();
  return row;
}

/// Whether the table calls one of the two better. @param factor  on the interval's width
bool is_significant(const EfficiencyRow& row, double factor) {
  if (factor == 1) return row.verdict == Verdict::Better || row.verdict == Verdict::Worse;
  return row.ratio_hi &&
         std::abs(std::log(*row.ratio)) > factor * std::log(*row.ratio_hi / *row.ratio);
}

/// Real CPU times, so one run after the other and A B, B A, ...
SelfTestCheck check_same_estimator(const SelfTestOptions& options) {
  SelfTestCheck check{"A/A",
                      "the same estimator under two labels differs significantly, in CPU time",
                      options.quick ? 200 : 1000};
  check.error = binomial_error(kLevel, check.trials);
  check.least = 0;
  check.most = kLevel + kBound * check.error;
  const AnalyticScene scene(16);
  std::vector<RunRow> rows;
  for (int trial = 0; trial < check.trials; ++trial) {
    for (int block = 0; block < kBlocks; ++block) {
      for (const bool first : {true, false}) {
        const std::string label = first == (block % 2 == 0) ? "a" : "b";
        const RenderResult result = scene.render("mis", 1, 4, seed_of("same", trial, block, label));
        rows.push_back(row_of(scene, result, trial, block, label, result.time_cpu_s));
      }
    }
  }
  TableOptions table;
  table.baseline = "a";
  int significant = 0;
  for (const EfficiencyRow& row : efficiency_table(rows, table)) {
    significant += row.label == "b" && is_significant(row, width_factor(options)) ? 1 : 0;
  }
  check.measured = static_cast<double>(significant) / check.trials;
  return check;
}

SelfTestCheck check_slope(const SelfTestOptions& options) {
  constexpr std::array<int, 4> kSpp{1, 2, 4, 8};
  SelfTestCheck check = coverage_check(
      "slope of MSE", "95 % intervals of an unbiased estimator's slope hold -1, by rays",
      options.quick ? 100 : 600, options.quick);
  const AnalyticScene scene(16);
  std::vector<RunRow> rows(static_cast<std::size_t>(check.trials * kBlocks) * kSpp.size());
  tbb::parallel_for(0, static_cast<int>(rows.size()), [&](int i) {
    const int spp = kSpp[static_cast<std::size_t>(i) % kSpp.size()];
    const int block = i / static_cast<int>(kSpp.size()) % kBlocks;
    const int trial = i / (static_cast<int>(kSpp.size()) * kBlocks);
    const std::uint64_t seed = seed_of("slope", trial, block, std::to_string(spp));
    const RenderResult result = scene.render("mis", spp, 2, seed, energy_factor(options));
    RunRow row = row_of(scene, result, trial, block, "mis",
                        kSecondsPerRay * static_cast<double>(result.counters.rays));
    row.spp = spp;
    rows[static_cast<std::size_t>(i)] = std::move(row);
  });
  TableOptions table;
  table.baseline = "mis";
  int held = 0;
  for (const CurveRow& row : error_curves(rows, table).rows) {
    held += row.mse.slope_lo && *row.mse.slope_lo <= -1 && -1 <= *row.mse.slope_hi ? 1 : 0;
  }
  check.measured = static_cast<double>(held) / check.trials;
  return check;
}

}  // namespace

std::vector<SelfTestCheck> run_selftest(const SelfTestOptions& options) {
  constexpr std::array kChecks{check_simulated_coverage, check_rendered_coverage,
                               check_false_alarms,       check_power,
                               check_same_estimator,     check_slope};
  std::vector<SelfTestCheck> checks;
  Progress progress("selftest", static_cast<double>(kChecks.size()));
  for (const auto& check : kChecks) {
    const Stopwatch watch;
    checks.push_back(check(options));
    checks.back().wall_s = watch.wall_s();
    progress.update(static_cast<double>(checks.size()), checks.back().name);
  }
  progress.finish();
  return checks;
}

bool passed(std::span<const SelfTestCheck> checks) {
  return std::all_of(checks.begin(), checks.end(),
                     [](const SelfTestCheck& check) { return check.passed(); });
}

}  // namespace penumbra
