#pragma once

#include <span>
#include <vector>

#include "estimators/mixture/estimates.h"
#include "estimators/pmc_hi_plus/population.h"

/// How many further samples each estimate of a block draws from each component.
namespace penumbra::pmc_hi_plus {

struct AllocationRules {
  bool by_variance{true};  ///< false: every estimate draws its share of the budget
  double rays{64};  ///< samples of a component whose single sample has a relative variance of 1
  double exponent{0.4};    ///< of the relative variance
  int radius{1};           ///< of the neighbourhood [pixels]
  double bsdf_share{0.5};  ///< of the BSDF component where nothing is known
  int srl_adaptive{0};     ///< largest mean over a block, per light that can contribute
};

/// Samples wanted beyond the initial ones. What a member gets depends on members of the other half
/// only.
class Allocation {
 public:
  /// @param estimates  most members
  Allocation(std::size_t slots, std::size_t estimates, const AllocationRules& rules);

  /// @param initial  called with a member: the counts of its initial population
  template <typename Initial>
  void decide(const Population& population, Initial initial) noexcept {
    for (int half = 0; half < 2; ++half) {
      const double dark = darkness(population, 1 - half);
      double wanted = 0.0, allowed = 0.0;
      for_each(population, half, [&](int pixel, int e, std::size_t i) {
        const Population::Member& member = population[i];
        wanted += want(population, pixel, e, initial(member), dark);
        allowed += static_cast<double>(rules_.srl_adaptive) * member.lights;
      });
      if (!(wanted > allowed)) continue;
      for_each(population, half, [&](int, int, std::size_t i) {
        for (double& n : of(i)) n *= allowed / wanted;
      });
    }
  }

  /// [slot], of a member in use: further samples, not yet whole numbers.
  std::span<const double> samples(std::size_t i) const noexcept {
    return std::span(samples_).subspan(i * slots_, slots_);
  }

 private:
  template <typename Visit>
  static void for_each(const Population& population, int half, Visit visit) noexcept {
    for (int pixel = 0; pixel < population.pixels(); ++pixel) {
      for (int e = 0; e < population.estimates(); ++e) {
        const std::size_t i = population.index(pixel, e);
        if (population[i].used && population.half(pixel, e) == half) visit(pixel, e, i);
      }
    }
  }
  static double darkness(const Population& population, int half) noexcept;
  double want(const Population& population, int pixel, int e, LightAndLobeCounts initial,
              double dark) noexcept;
  void share_equally(const Population::Member& member, std::span<double> samples) const noexcept;
  std::span<double> of(std::size_t i) noexcept {
    return std::span(samples_).subspan(i * slots_, slots_);
  }

  AllocationRules rules_;
  std::size_t slots_;
  std::vector<double> samples_;  // [estimate][slot]
  std::vector<double> scratch_;  // [slot]
};

}  // namespace penumbra::pmc_hi_plus
