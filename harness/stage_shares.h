#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "estimators/stage_clock.h"
#include "harness/render.h"

/// How the time of an estimate splits into stages.
namespace penumbra {

std::string_view to_string(EstimateStage stage);

/// Means over the estimates of a rendering on one thread.
struct StageShares {
  double samples{0}, rays{0}, lit{0};  ///< per estimate
  double total_ns{0};                  ///< CPU time per estimate, without the clock
  /// [EstimateStage] per estimate: the shares that the clock tells, without what reading it takes,
  /// of `total_ns`, which they add up to.
  std::array<double, kStages> stage_ns{};

  double share(EstimateStage stage) const {
    return stage_ns[static_cast<std::size_t>(stage)] / total_ns;
  }
};

/// Renders the same work with the clock, for the shares, and without it, for the time that they are
/// of. The clock runs on while the thread waits for another program, and counts that for the stage
/// that it meets; so the shares are those of the rendering that took least.
class StageTimer {
 public:
  /// @param scene, points  outlive this
  /// @param settings       `threads` must be 1
  StageTimer(const Scene& scene, const ShadingPoints& points, const RenderSettings& settings);

  void render_both();

  /// Of all calls of render_both, of which there must be one; the total is their median.
  StageShares result() const;

 private:
  const Scene& scene_;
  const ShadingPoints& points_;
  RenderSettings settings_;
  double ticks_per_change_;
  EstimateCounters counters_;  // of one rendering
  std::vector<double> total_s_;
  std::array<double, kStages> least_ticks_{};  // [EstimateStage], of the shortest with the clock
};

/// A part of an image that takes a bounded time.
struct StageWork {
  ShadingPoints points;
  int spp{1};  ///< estimates per pixel
};

/// Squares of up to 8 x 8 pixels at up to 64 places that are spread evenly over the image; places
/// where nothing is seen are left out. The squares are as large as the bound allows. Estimators may
/// learn over the estimates of a pixel, so `spp` stays as it is unless single pixels are too much.
/// @param spp                   estimates per pixel of a run, >= camera samples
/// @param samples_per_estimate  expected, > 0
StageWork stage_work(const ShadingPoints& points, int spp, double samples_per_estimate);

}  // namespace penumbra
