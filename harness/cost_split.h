#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "harness/render.h"
#include "harness/stage_shares.h"
#include "scenes/core/bare_rays.h"

/// Where the time of an estimate goes, and how near it is to the time of its rays alone.
namespace penumbra {

/// Also the times of the rays alone; CPU times, medians over rounds.
struct CostSplit : StageShares {
  /// [BareQuery] per estimate, of the same rays through Embree's own calls.
  std::array<double, kBareQueries> bare_ns{};
  /// The fastest of them with Embree's fast flags; 0 where no such scene was given.
  double fast_flags_ns{0};

  /// Fastest way to trace the rays alone, with the flags that the scene has.
  double limit_ns() const;
  /// Share of an estimate's time that its rays alone would take.
  double share_of_limit() const { return limit_ns() / total_ns; }
};

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
