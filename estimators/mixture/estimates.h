#pragma once

#include <algorithm>
#include <span>

#include "estimators/mixture/mixture.h"

/// From a mixture's samples to estimates: weights, counts, and the loop over a tile.
namespace penumbra {

/// Sum over all samples of f/K with K = sum_k (n_k/N) h_k: N times the balance-heuristic estimate.
/// A sample with f > 0 and K = 0 is counted as uncovered and adds nothing.
/// @param density  scratch as in Mixture::mixture_pdfs_w
RgbSum balance_sum(Mixture& mixture, std::span<const double> coefficients,
                   std::span<double> density) noexcept;

/// Samples that one estimate draws at most: the size to make a mixture with. None where no light
/// has a density.
/// @throws InputError when they are more than kMaxSamples, before memory is asked for
std::size_t most_samples(const Scene& scene, const Budget& budget);
inline constexpr std::size_t kMaxSamples = std::size_t{1} << 24;

/// Counts of the shared MIS layout: half of each light's shadow rays for the light, the other half
/// pooled for the BSDF; an odd one goes to the light.
/// @param counts  [component]; filled for light components and BSDF, cone 0
/// @return the sum of the counts
int shared_mis_counts(int srl, int active_lights, int light_components,
                      std::span<int> counts) noexcept;

/// Samples of lights, alike, and of glossy lobes.
struct LightAndLobeCounts {
  int per_light{0};  ///< at least 1
  int lobe{0};
};

/// Shares samples out: the lobes get their share, each light as many as the others of the rest. Can
/// be fewer than `total`, because counts are whole numbers.
/// @param total, lights  at least 1 for each light
/// @param lobe_share     in [0, 1); 0 where there is no lobe
LightAndLobeCounts light_and_lobe_counts(int total, int lights, double lobe_share) noexcept;

/// Sum over all samples of f/(n_k h_k) with their own densities only: an estimate by techniques
/// that stand for disjoint parts of the light.
/// @param expected  [component] number of samples, or its expectation where counts are random
RgbSum own_density_sum(Mixture& mixture, std::span<const double> expected) noexcept;

/// Counts with expectation N p_k that differ from it by less than 1: systematic sampling of the
/// cumulative distribution with one offset.
/// @param pmf     >= 0, sum 1
/// @param total   N
/// @param offset  uniform in [0, 1)
/// @param counts  result, same length as pmf, sum N
void systematic_counts(std::span<const double> pmf, int total, double offset,
                       std::span<int> counts) noexcept;

/// Light sampling by itself: chooses SRL x active lights samples among the lights by systematic
/// sampling of a pmf and weights them with it.
/// @param mixture  with Densities::Own
/// @param pmf      [active light], sum 1
/// @param counts, expected  scratch, at least `mixture.components()` long; expected[l] is n P_l
/// then
/// @return the estimate
RgbSum chosen_lights_estimate(Mixture& mixture, const Budget& budget, StreamKey key,
                              std::span<const double> pmf, std::span<int> counts,
                              std::span<double> expected) noexcept;

/// Makes estimate s of a pixel: binds the mixture to its point, adds the light that needs no
/// sampling to what `one_point` returns and stores the sum, 0 where the point is not valid.
/// @param one_point  called with the key of the estimate where there are lights to draw from;
///                   returns their radiance
template <typename OnePoint>
void estimate_one(Mixture& mixture, const Tile& tile, std::uint64_t seed, int pixel, int s,
                  TileOutput& out, OnePoint one_point) noexcept {
  const std::size_t i = static_cast<std::size_t>(pixel) * static_cast<std::size_t>(tile.spp) +
                        static_cast<std::size_t>(s);
  out.radiance[i] = Rgb(0.0f);
  const ShadingPoint& point = tile.point(pixel, s);
  if (!point.valid()) return;
  mixture.enter(EstimateStage::SetUp);
  ++mixture.counters().estimates;
  mixture.set_up(point, tile.surface(pixel, s),
                 out.recorder != nullptr ? out.recorder->begin(pixel, s) : nullptr);
  out.radiance[i] = mixture.exact_radiance();
  if (mixture.active_lights() == 0) return;
  StreamKey key;
  key.seed = seed;
  key.pixel = tile.pixel_index(pixel);
  key.estimate = static_cast<std::uint32_t>(s);
  out.radiance[i] += one_point(key);
}

/// Makes the estimates of a tile in the order of its output and adds up the counters.
/// @param before_point  called with the index of every estimate, also of those that are 0
/// @param one_point     as in estimate_one
template <typename BeforePoint, typename OnePoint>
void estimate_tile(Mixture& mixture, const Tile& tile, std::uint64_t seed, TileOutput& out,
                   BeforePoint before_point, OnePoint one_point) noexcept {
  mixture.counters() = {};
  mixture.set_clock(out.clock);
  std::size_t i = 0;
  for (int pixel = 0; pixel < tile.pixel_count(); ++pixel) {
    for (int s = 0; s < tile.spp; ++s, ++i) {
      before_point(i);
      estimate_one(mixture, tile, seed, pixel, s, out, one_point);
    }
  }
  mixture.enter(EstimateStage::Outside);
  out.counters += mixture.counters();
}

/// Power that a light with a density emits, both sides together; of the environment, that through
/// the scene's bounding sphere. Luminance [W], in scene units.
double emitted_power(const Scene& scene, const Light& light) noexcept;

/// The parameter `light_sampling` and its value: how directions towards a light are drawn.
ParamSpec light_sampling_param(LightSampling by_default = LightSampling::Area);
LightSampling light_sampling_of(const ParamSet& params);

}  // namespace penumbra
