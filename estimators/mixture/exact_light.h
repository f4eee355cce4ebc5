#pragma once

#include <vector>

#include "estimators/estimator.h"
#include "estimators/mixture/sums.h"

namespace penumbra {

/// Light that every estimator adds without sampling, because it comes from a single direction: that
/// of lights without extent and, in a perfect mirror, all there is. One ray each; in scenes without
/// any, nothing is allocated or done.
class ExactLight {
 public:
  explicit ExactLight(const Scene& scene);

  /// Whether the scene has such light at all.
  bool possible() const noexcept { return !rays_.empty(); }

  /// Its part of the radiance at a valid point [W/(m^2 sr)].
  /// @param frame     about the shading normal
  /// @param record    the radiance is noted there, unless nullptr
  Rgb radiance(const ShadingPoint& point, const Frame& frame, const BoundBsdf& bsdf,
               EstimateCounters& counters, EstimateRecord* record) noexcept;

 private:
  struct Ray {
    float distance;  // to the light
    Rgb reflected;   // without occlusion
  };

  RgbSum of_delta_lights(const ShadingPoint& point, const Frame& frame, const BoundBsdf& bsdf,
                         EstimateCounters& counters) noexcept;
  RgbSum in_mirror(const ShadingPoint& point, const Frame& frame, const BoundBsdf& bsdf,
                   EstimateCounters& counters) noexcept;
  void trace(EstimateCounters& counters) noexcept;

  const Scene* scene_;
  std::vector<Ray> rays_;  // the first batch_.size() are in use
  RayBatch batch_;
};

}  // namespace penumbra
