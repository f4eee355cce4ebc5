#pragma once

#include <span>
#include <string>

#include "estimators/estimator.h"
#include "estimators/pmc_hi/adaptation.h"

namespace penumbra::pmc_hi {

enum class Denominator : std::uint8_t { Counts, Alpha };
enum class Update : std::uint8_t { Tag, RaoBlackwell };
enum class Combine : std::uint8_t { Average, Sqrt, Last, AdaptiveOnly, InverseVariance, Pooled };
/// Where the cone is a component.
enum class ConeUse : std::uint8_t {
  Needed,  ///< where something can lie between the point and one of its lights
  Always,  ///< the literal paper
  Never,
};
enum class Initial : std::uint8_t { Equal, MisSplit };

/// The estimator's parameters as declared in `specs()`, with names resolved.
struct Settings {
  LightSampling light_sampling{LightSampling::Area};
  bool lights_as_one{false};
  bool adapt{true};
  ConeUse cone{ConeUse::Needed};
  bool two_stage{false};   ///< a few populations to adapt, then one iteration with the rest
  int base_iterations{1};  ///< populations of the first stage, after the initial one
  int population{0};       ///< samples per adaptive iteration; 0: twice the number of components
  Initial initial{Initial::Equal};
  Rounding rounding{Rounding::LargestRemainder};
  Denominator denominator{Denominator::Counts};
  int n_min{1};
  double alpha_floor{0.0};
  Update update{Update::Tag};
  bool cumulative{false};
  Combine combine{Combine::Average};
  bool continue_sequence{false};  ///< later iterations draw the next points of the first one's set
  double alpha_cone{0.2};         ///< weight of the cone when it enters
  int cone_min_hits{2};
  ConeRules cone_rules;
};

std::span<const ParamSpec> specs();
Settings read_settings(const ParamSet& params);

/// Reasons why E[estimate] differs from the radiance with these settings; empty when it does not.
std::string bias_reason(const ParamSet& params);

/// Checks that the counts of every iteration can hold the defensive samples.
/// @throws InputError with the smallest budget that can
void check_budget(const Settings& settings, const Budget& budget, std::size_t lights);

}  // namespace penumbra::pmc_hi
