#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "harness/render.h"
#include "scenes/core/scene.h"

namespace penumbra {

/// A scene with an exact answer: a rectangle light close above an empty grey floor, where the light
/// that a point reflects has a closed form, and where area samples of near points have heavy tails.
class AnalyticScene {
 public:
  /// @param side  of the square image [pixels], a multiple of 8
  explicit AnalyticScene(int side);

  /// Renders with an estimator's defaults and independent points, on one thread.
  /// @param srl     shadow rays per light
  /// @param energy  factor on the result: an error that is planted; 1 for none
  /// @throws RunError when an estimate is not finite or negative
  RenderResult render(std::string_view estimator, int spp, int srl, std::uint64_t seed,
                      double energy = 1) const;

  /// Exact radiance, row-major.
  const std::vector<Vec3d>& exact() const { return exact_; }
  double exact_mean() const { return exact_mean_; }
  int side() const { return points_.width; }

  /// Mean of squared errors over pixels and channels, and signed mean error.
  double mean_square_error(const RenderResult& result) const;
  double mean_error(const RenderResult& result) const;

 private:
  Scene scene_;
  ShadingPoints points_;
  std::vector<Vec3d> exact_;
  double exact_mean_{0};
};

}  // namespace penumbra
