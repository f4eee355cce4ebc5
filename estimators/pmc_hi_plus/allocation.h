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
  int radius{2};           ///< of the neighbourhood [pixels]
  double bsdf_share{0.5};  ///< of the BSDF component where nothing is known
  int srl_adaptive{0};     ///< largest mean over a block, per light that can contribute
};

/// Samples wanted beyond the initial ones, for each place of a population. What a place gets
/// depends on members of the other half only.
class Allocation {
 public:
  /// @param places  most of a population
  Allocation(std::size_t slots, std::size_t places, const AllocationRules& rules);

  /// @param initial  called with a member: the counts of its initial population
  template <typename Initial>
  void decide(const Population& population, Initial initial) noexcept {
    for (int half = 0; half < 2; ++half) {
      const double dark = darkness(population, 1 - half);
      double wanted = 0.0, allowed = 0.0;
      population.for_each_place(half, [&](std::size_t p, const Population::Place& place) {
        const Population::Member& member = population[place.first];
        wanted += place.count * want(population, p, member, initial(member), dark);
        allowed += static_cast<double>(place.count) * rules_.srl_adaptive * member.lights;
      });
      if (!(wanted > allowed)) continue;
      population.for_each_place(half, [&](std::size_t p, const Population::Place&) {
        for (double& n : of(p)) n *= allowed / wanted;
      });
    }
  }

  /// [slot], of a place: further samples of each of its estimates, not yet whole numbers.
  std::span<const double> samples(std::size_t p) const noexcept {
    return std::span(samples_).subspan(p * slots_, slots_);
  }

 private:
  static double darkness(const Population& population, int half) noexcept;
  double want(const Population& population, std::size_t p, const Population::Member& member,
              LightAndLobeCounts initial, double dark) noexcept;
  void share_equally(const Population::Member& member, std::span<double> samples) const noexcept;
  std::span<double> of(std::size_t p) noexcept {
    return std::span(samples_).subspan(p * slots_, slots_);
  }

  AllocationRules rules_;
  std::size_t slots_;
  std::vector<double> samples_;  // [place][slot]
  std::vector<double> scratch_;  // [slot]
};

}  // namespace penumbra::pmc_hi_plus
