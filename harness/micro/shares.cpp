#include "harness/micro/shares.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "harness/atomic_file.h"
#include "harness/commands/commands.h"
#include "harness/micro/replay.h"

namespace penumbra::micro {
namespace {

// The estimators that the table is about.
constexpr const char* kEstimators[] = {"pmc_hi", "mis", "alsd", "mdhi"};
// What is timed at once; the clock has to be asked that often.
constexpr double kShortest_s = 1e-3;

// Something that is timed in turns with others.
struct Timed {
  std::function<void()> run;
  int repeats{1};
  std::vector<double> times_s{};  // [round], of one run

  void round() {
    const double start_s = thread_cpu_s();
    for (int i = 0; i < repeats; ++i) run();
    times_s.push_back((thread_cpu_s() - start_s) / repeats);
  }
  // Also warms up.
  void set_repeats() {
    round();
    times_s.clear();
    round();
    repeats = static_cast<int>(std::ceil(kShortest_s / std::max(times_s[0], 1e-7)));
    times_s.clear();
  }
  double median_s() {
    std::sort(times_s.begin(), times_s.end());
    const std::size_t n = times_s.size();
    return 0.5 * (times_s[(n - 1) / 2] + times_s[n / 2]);
  }
};

EstimateShares measure(Suite& suite, const std::string& scene, const EstimatorEntry& entry, int srl,
                       Replay& replay) {
  const BenchTile& tile = suite.tile(scene);
  const std::unique_ptr<Estimator> estimator =
      entry.create(*tile.scene, default_params(entry), budget_of(entry, srl));
  const Tile job = tile.tile(replayed_spp(entry));
  std::vector<Rgb> radiance(job.estimate_count());
  RayMeter& meter = suite.ray_meter(scene);

  std::vector<Timed> timed;
  std::uint64_t runs = 0;
  timed.push_back({[&] {
    TileOutput out;
    out.radiance = radiance;
    estimator->estimate(job, suite.config().seed + runs++ % kReplayedSeeds, out);
  }});
  timed.push_back({[&] { meter.ns_per_ray(); }});
  for (const ReplayedKernel& kernel : replay.kernels) timed.push_back({kernel.run});
  for (Timed& t : timed) t.set_repeats();
  for (int round = 0; round < suite.config().shares_rounds; ++round) {
    for (Timed& t : timed) t.round();
  }

  EstimateShares result{scene, std::string(entry.name), srl_text(entry, srl)};
  result.samples = replay.samples;
  result.rays = replay.rays;
  result.shadow_ray_ns = 1e9 * timed[1].median_s() / static_cast<double>(meter.rays());
  for (std::size_t k = 0; k < replay.kernels.size(); ++k) {
    const ReplayedKernel& kernel = replay.kernels[k];
    const double ns = 1e9 * timed[k + 2].median_s() / kernel.estimates;
    result.kernels.push_back({kernel.name, kernel.unit, kernel.calls, ns / kernel.calls});
  }
  set_shares(result, 1e9 * timed[0].median_s() / static_cast<double>(job.estimate_count()));
  return result;
}

}  // namespace

int print_shares(Suite& suite, const std::string& csv) {
  std::vector<EstimateShares> all;
  int faults = 0;
  for (const std::string& scene : suite.config().scenes) {
    for (const char* name : kEstimators) {
      const EstimatorEntry& entry = *find_estimator(name);
      for (const int srl : suite.config().shares_srl) {
        const auto make = entry.name == "mdhi" ? replay_mdhi : replay_mixture;
        const std::unique_ptr<Replay> replay =
            make(suite.tile(scene), entry, budget_of(entry, srl), suite.config().seed);
        if (replay->fault.empty()) {
          all.push_back(measure(suite, scene, entry, srl, *replay));
          continue;
        }
        ++faults;
        std::fprintf(stderr, "penumbra_micro: error: %s in %s at SRL %d: %s\n", name, scene.c_str(),
                     srl, replay->fault.c_str());
      }
    }
  }
  std::fputs(shares_text(all).c_str(), stdout);
  if (!csv.empty()) write_file_atomically(csv, shares_csv(all, suite.config()));
  return faults == 0 ? kSuccess : kRunFailure;
}

}  // namespace penumbra::micro
