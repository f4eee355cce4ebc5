#include "harness/cost_split.h"

#include <algorithm>
#include <vector>

#include "harness/clocks.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// What one change of stages costs in ticks: the least over a few rows of changes.
double ticks_per_change() {
  constexpr int kChanges = 4096;
  double least = 1e9;
  for (int row = 0; row < 8; ++row) {
    StageClock clock;
    for (int i = 0; i < kChanges; ++i) clock.enter(EstimateStage::Sample);
    const auto spent = clock.spent()[static_cast<std::size_t>(EstimateStage::Sample)];
    least = std::min(least, static_cast<double>(spent) / (kChanges - 1));
  }
  return least;
}

// Shares of the stages in the time inside and around estimates.
std::array<double, kStages> shares_of(const StageClock& clock, double change) {
  std::array<double, kStages> shares{};
  double total = 0.0;
  for (std::size_t s = 0; s < kStages; ++s) {
    const double changes = static_cast<double>(clock.entered()[s]);
    shares[s] = std::max(static_cast<double>(clock.spent()[s]) - change * changes, 0.0);
    total += shares[s];
  }
  for (double& share : shares) share /= total;
  return shares;
}

// CPU time of an action on this thread [s].
template <typename Action>
double cpu_s_of(Action action) {
  const double start = thread_cpu_s();
  action();
  return thread_cpu_s() - start;
}

// Times of the rounds, one list per quantity.
struct Rounds {
  std::vector<double> total_s, batch_s;
  std::array<std::vector<double>, kBareQueries> bare_s;
  std::array<std::vector<double>, kStages> shares;
};

}  // namespace

std::string_view to_string(EstimateStage stage) {
  constexpr std::array<std::string_view, kStages> kNames{"outside", "set_up", "sample",
                                                         "trace",   "weigh",  "adapt"};
  return kNames[static_cast<std::size_t>(stage)];
}

double CostSplit::limit_ns() const { return *std::min_element(bare_ns.begin(), bare_ns.end()); }

CostSplit measure_cost_split(Scene& scene, const ShadingPoints& points,
                             const RenderSettings& settings, int rounds) {
  PN_CHECK(settings.threads == 1 && rounds >= 1, "one thread, and at least once");
  RayRecorder recorder;
  scene.set_recorder(&recorder);
  const RenderResult recorded = render(scene, points, settings);
  scene.set_recorder(nullptr);
  const auto estimates =
      static_cast<double>(std::max<std::uint64_t>(1, recorded.counters.estimates));
  const BareRays single(scene.rays(), recorder.batches, BareQuery::Single);
  const BareRays packets8(scene.rays(), recorder.batches, BareQuery::Packet8);
  const BareRays packets16(scene.rays(), recorder.batches, BareQuery::Packet16);
  const std::array<const BareRays*, kBareQueries> bare{&single, &packets8, &packets16};
  const double change = ticks_per_change();
  const DenormalMode mode(settings.denormals);

  Rounds times;
  for (int round = 0; round < rounds; ++round) {
    times.total_s.push_back(render(scene, points, settings).time_cpu_s);
    StageClock clock;
    RenderSettings clocked = settings;
    clocked.clock = &clock;
    render(scene, points, clocked);
    const std::array<double, kStages> shares = shares_of(clock, change);
    for (std::size_t s = 0; s < kStages; ++s) times.shares[s].push_back(shares[s]);
    times.batch_s.push_back(cpu_s_of([&] {
      for (RayBatch& batch : recorder.batches) scene.intersect(batch);
    }));
    for (std::size_t q = 0; q < kBareQueries; ++q) {
      times.bare_s[q].push_back(cpu_s_of([&] { bare[q]->trace(); }));
    }
  }

  CostSplit split;
  split.samples = static_cast<double>(recorded.counters.samples) / estimates;
  split.rays = static_cast<double>(recorded.counters.rays) / estimates;
  split.lit = static_cast<double>(recorded.counters.lit) / estimates;
  const double to_ns = 1e9 / estimates;
  split.total_ns = median(times.total_s) * to_ns;
  split.batch_ns = median(times.batch_s) * to_ns;
  for (std::size_t q = 0; q < kBareQueries; ++q) split.bare_ns[q] = median(times.bare_s[q]) * to_ns;
  for (std::size_t s = 0; s < kStages; ++s) {
    split.stage_ns[s] = median(times.shares[s]) * split.total_ns;
  }
  return split;
}

}  // namespace penumbra
