#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "estimators/stage_clock.h"
#include "harness/render.h"
#include "scenes/core/bare_rays.h"

/// Where the time of an estimate goes, and how near it is to the time of its rays alone.
namespace penumbra {

/// Means over the estimates of a rendering on one thread; CPU times, medians over rounds.
struct CostSplit {
  double samples{0}, rays{0}, lit{0};  ///< per estimate
  double total_ns{0};                  ///< per estimate, without the clock
  /// [EstimateStage] per estimate: the shares that the clock tells, without what reading it takes,
  /// of `total_ns`.
  std::array<double, kStages> stage_ns{};
  /// [BareQuery] per estimate, of the same rays through Embree's own calls.
  std::array<double, kBareQueries> bare_ns{};
  /// The fastest of them with Embree's fast flags; 0 where no such scene was given.
  double fast_flags_ns{0};

  /// Fastest way to trace the rays alone, with the flags that the scene has.
  double limit_ns() const;
  /// Share of an estimate's time that its rays alone would take.
  double share_of_limit() const { return limit_ns() / total_ns; }
  double stage_share(EstimateStage stage) const {
    return stage_ns[static_cast<std::size_t>(stage)] / total_ns;
  }
};

std::string_view to_string(EstimateStage stage);

/// Renders in turns with and without the clock and traces the recorded rays again in between, so
/// that other load on the machine meets all alike.
/// @param scene     records its rays meanwhile
/// @param settings  `threads` must be 1
/// @param rounds    repetitions, >= 1
/// @param fast      the same scene with SceneOptions::fast_rays, or nullptr
CostSplit measure_cost_split(Scene& scene, const ShadingPoints& points,
                             const RenderSettings& settings, int rounds,
                             const Scene* fast = nullptr);

nlohmann::ordered_json cost_split_json(const CostSplit& split);

/// A cost split with its name, for tables.
struct NamedCost {
  std::string estimator;
  std::string srl;
  CostSplit split;
};

/// One line each.
std::string cost_splits_text(const std::vector<NamedCost>& costs);

}  // namespace penumbra
