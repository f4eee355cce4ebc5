#include "harness/cost_split.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "harness/clocks.h"
#include "harness/statistics.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

// CPU time of an action on this thread [s].
template <typename Action>
double cpu_s_of(Action action) {
  const double start = thread_cpu_s();
  action();
  return thread_cpu_s() - start;
}

// Recorded rays ready for every kind of bare query in a scene.
class BareRound {
 public:
  BareRound(const RayScene& scene, const RayRecorder& recorder)
      : rays_{{{scene, recorder, BareQuery::Single},
               {scene, recorder, BareQuery::Packet8},
               {scene, recorder, BareQuery::Packet16}}} {}

  void time() {
    for (std::size_t q = 0; q < kBareQueries; ++q) {
      times_[q].push_back(cpu_s_of([&] { rays_[q].trace(); }));
    }
  }

  std::array<double, kBareQueries> medians_s() const {
    std::array<double, kBareQueries> result{};
    std::transform(times_.begin(), times_.end(), result.begin(), median);
    return result;
  }

 private:
  std::array<BareRays, kBareQueries> rays_;
  std::array<std::vector<double>, kBareQueries> times_;
};

}  // namespace

double CostSplit::limit_ns() const { return *std::min_element(bare_ns.begin(), bare_ns.end()); }

CostSplit measure_cost_split(Scene& scene, const ShadingPoints& points,
                             const RenderSettings& settings, int rounds, const Scene* fast) {
  PN_CHECK(settings.threads == 1 && rounds >= 1, "one thread, and at least once");
  RayRecorder recorder;
  scene.set_recorder(&recorder);
  const RenderResult recorded = render(scene, points, settings);
  scene.set_recorder(nullptr);
  BareRound bare(scene.rays(), recorder);
  std::optional<BareRound> bare_fast;
  if (fast != nullptr) bare_fast.emplace(fast->rays(), recorder);
  StageTimer stages(scene, points, settings);
  for (int round = 0; round < rounds; ++round) {
    stages.render_both();
    const DenormalMode mode(settings.denormals);
    bare.time();
    if (bare_fast) bare_fast->time();
  }

  CostSplit split{stages.result()};
  const auto estimates =
      static_cast<double>(std::max<std::uint64_t>(1, recorded.counters.estimates));
  const double to_ns = 1e9 / estimates;
  split.bare_ns = bare.medians_s();
  for (double& time : split.bare_ns) time *= to_ns;
  if (bare_fast) {
    const std::array<double, kBareQueries> times = bare_fast->medians_s();
    split.fast_flags_ns = *std::min_element(times.begin(), times.end()) * to_ns;
  }
  return split;
}

nlohmann::ordered_json cost_split_json(const CostSplit& split) {
  nlohmann::ordered_json json = {{"samples", split.samples},
                                 {"rays", split.rays},
                                 {"lit", split.lit},
                                 {"total_ns", split.total_ns}};
  for (std::size_t s = 0; s < kStages; ++s) {
    json["stages_ns"][std::string(to_string(static_cast<EstimateStage>(s)))] = split.stage_ns[s];
  }
  for (std::size_t q = 0; q < kBareQueries; ++q) {
    json["bare_ns"][std::string(to_string(static_cast<BareQuery>(q)))] = split.bare_ns[q];
  }
  if (split.fast_flags_ns > 0.0) json["bare_fast_flags_ns"] = split.fast_flags_ns;
  json["limit_ns"] = split.limit_ns();
  json["share_of_limit"] = split.share_of_limit();
  return json;
}

std::string cost_splits_text(const std::vector<NamedCost>& costs) {
  std::string text =
      fmt::format("  {:<10}{:>7}{:>8}{:>8}{:>8} |", "", "SRL", "rays", "ns", "ns/ray");
  for (std::size_t s = 1; s < kStages; ++s) {
    text += fmt::format("{:>8}", to_string(static_cast<EstimateStage>(s)));
  }
  text += fmt::format(" |{:>8}{:>8}{:>8}{:>8}{:>8}\n", "single", "by 8", "by 16", "fast", "limit");
  for (const NamedCost& cost : costs) {
    const CostSplit& c = cost.split;
    text += fmt::format("  {:<10}{:>7}{:>8.1f}{:>8.0f}{:>8.1f} |", cost.estimator, cost.srl, c.rays,
                        c.total_ns, c.total_ns / c.rays);
    for (std::size_t s = 1; s < kStages; ++s) {
      text += fmt::format("{:>6.1f} %", 100.0 * c.stage_ns[s] / c.total_ns);
    }
    text += " |";
    for (const double bare : c.bare_ns) text += fmt::format("{:>8.0f}", bare);
    text +=
        c.fast_flags_ns > 0.0 ? fmt::format("{:>8.0f}", c.fast_flags_ns) : fmt::format("{:>8}", "");
    text += fmt::format("{:>6.0f} %\n", 100.0 * c.share_of_limit());
  }
  return text +
         "  ns: CPU time of an estimate, and its shares; single, by 8, by 16: its rays alone "
         "through\n"
         "  Embree's own calls, fast: the fastest of them without the robust flag; limit: the "
         "fastest\n"
         "  of the first three as a share of the estimate\n";
}

}  // namespace penumbra
