#include "estimators/pmc_hi_plus/allocation.h"

#include <algorithm>
#include <cmath>

namespace penumbra::pmc_hi_plus {
namespace {

// Estimates that a neighbourhood needs to say anything.
constexpr int kLeastEstimates = 2;
// Luminance below this part of the block's mean counts as this much: errors of dark pixels are
// small in every measure.
constexpr double kDark = 0.1;
// Largest share of a neighbourhood's light that its lobes are held responsible for.
constexpr double kMostLobe = 0.75;

}  // namespace

Allocation::Allocation(std::size_t slots, std::size_t places, const AllocationRules& rules)
    : rules_(rules), slots_(slots), samples_(places * slots), scratch_(slots) {}

// Square of the luminance that counts as dark, by one half of a block.
double Allocation::darkness(const Population& population, int half) noexcept {
  double sum = 0.0;
  int count = 0;
  population.for_each_place(half, [&](std::size_t, const Population::Place& place) {
    sum += place.luminance;
    count += place.count;
  });
  const double dark = count > 0 ? kDark * sum / count : 0.0;
  return dark * dark;
}

void Allocation::share_equally(const Population::Member& member,
                               std::span<double> samples) const noexcept {
  const double lobe = member.lobe ? rules_.bsdf_share : 0.0;
  std::fill(samples.begin(), samples.end(), rules_.srl_adaptive * (1.0 - lobe));
  samples.back() = rules_.srl_adaptive * lobe * member.lights;
}

// @return the samples wanted by each estimate of a place, of all components
double Allocation::want(const Population& population, std::size_t p,
                        const Population::Member& member, LightAndLobeCounts initial,
                        double dark) noexcept {
  const std::span<double> samples = of(p);
  const Neighbourhood around =
      rules_.by_variance ? population.around(p, rules_.radius, scratch_) : Neighbourhood{};
  // A single sample has no variance.
  if (around.estimates < kLeastEstimates || initial.per_light < 2) {
    share_equally(member, samples);
    return static_cast<double>(rules_.srl_adaptive) * member.lights;
  }
  const double unit = around.luminance * around.luminance + dark;
  double of_lights = 0.0;
  for (std::size_t k = 0; k < slots_; ++k) {
    const bool is_lobe = k + 1 == slots_;
    const double variance = around.variance[k];
    const double all =
        variance > 0.0 ? rules_.rays * std::pow(variance / unit, rules_.exponent) : 0.0;
    samples[k] = std::max(0.0, all - (is_lobe ? initial.lobe : initial.per_light));
    if (!is_lobe) of_lights += samples[k];
  }
  // Further samples of lights alone would find a sharp lobe by chance only.
  const double share = std::min(around.lobe_share, kMostLobe);
  double& of_lobe = samples.back();
  of_lobe = member.lobe ? std::max(of_lobe, of_lights * share / (1.0 - share)) : 0.0;
  return of_lights + of_lobe;
}

}  // namespace penumbra::pmc_hi_plus
