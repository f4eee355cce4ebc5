#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "estimators/mixture/light_grid.h"
#include "scenes/core/block.h"

/// Densities of a mixture with many light components; a part of Mixture. A direction meets few of
/// them: only densities that are not 0 are kept, and memory is touched as far as it is used.
namespace penumbra {

/// From this number of lights on a mixture keeps its densities so. Measured there (-O1, SRL 4): mis
/// takes 0.43, bsdf 0.24 of the time that all densities take; at 256 lights 0.16 and 0.07.
inline constexpr std::size_t kManyLights = 64;

/// The positive density of one light component at a direction.
struct LightDensity {
  std::uint32_t component;
  float pdf_w;
};

struct ManyLights {
  ManyLights(std::size_t lights, std::size_t max_samples, bool keep_samples)
      : grid(lights),
        lane_densities(std::make_unique_for_overwrite<LightDensity[]>(kBlock * (lights + 1))) {
    if (!keep_samples) return;
    first.resize(max_samples + 1);
    bsdf.resize(max_samples);
    cone.resize(max_samples);
    densities = std::make_unique_for_overwrite<LightDensity[]>(max_samples * (lights + 1));
  }

  LightGrid grid;
  bool built{false};  ///< whether the grid is that of the point at hand

  /// Of the block at hand: lane i has lane_densities[lane_first[i], lane_first[i + 1]), ascending
  /// components.
  std::unique_ptr<LightDensity[]> lane_densities;
  std::array<std::size_t, kBlock + 1> lane_first{};

  /// Of the samples, in the same form; [sample] densities of the BSDF and of the cone.
  std::unique_ptr<LightDensity[]> densities;
  std::vector<std::size_t> first;
  std::vector<float> bsdf, cone;

  std::span<const LightDensity> lane(std::size_t i) const noexcept {
    return {&lane_densities[lane_first[i]], lane_first[i + 1] - lane_first[i]};
  }
  std::span<const LightDensity> sample(std::size_t i) const noexcept {
    return {&densities[first[i]], first[i + 1] - first[i]};
  }
};

}  // namespace penumbra
