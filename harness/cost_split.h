#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "estimators/stage_clock.h"
#include "harness/render.h"
#include "scenes/core/bare_rays.h"

/// Where the time of an estimate goes, and how near it is to the time of its rays alone.
namespace penumbra {

/// Means over the estimates of a rendering, on one thread; CPU times, medians over repetitions.
struct CostSplit {
  double samples{0}, rays{0}, lit{0};  ///< per estimate
  double total_ns{0};                  ///< per estimate, without the clock
  /// [EstimateStage] per estimate: shares that the clock tells, without what reading it takes, of
  /// `total_ns`.
  std::array<double, kStages> stage_ns{};
  double batch_ns{0};  ///< per estimate, of the same batches through the scene's query again
  /// [BareQuery] per estimate, of the same rays through Embree's own calls.
  std::array<double, kBareQueries> bare_ns{};

  /// Fastest way to trace the rays alone.
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
CostSplit measure_cost_split(Scene& scene, const ShadingPoints& points,
                             const RenderSettings& settings, int rounds);

}  // namespace penumbra
