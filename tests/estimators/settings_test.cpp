// What PMC-HI says of its parameters: budgets and floors that it refuses, and which settings are
// biased.

#include "estimators/pmc_hi/settings.h"

#include <gtest/gtest.h>

#include "scenes/core/error.h"
#include "tests/support/fixtures.h"

namespace penumbra::pmc_hi {
namespace {

std::string refusal(const ParamSet::Map& given, const Budget& budget, std::size_t lights) {
  const EstimatorEntry& entry = *find_estimator("pmc_hi");
  try {
    check_budget(read_settings(fixtures::params_with(entry, given)), budget, lights);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(CheckBudget, RefusesMoreDefensiveSamplesThanAnAutomaticPopulationHolds) {
  const ParamSet::Map three = {{"n_min", std::int64_t{3}}, {"cone", std::string("always")}};
  const Budget budget{SamplerKind::Independent, 8, 24};
  EXPECT_EQ(refusal(three, budget, 1), "");  // population 6 for 2 components
  EXPECT_EQ(refusal(three, budget, 2),
            "pmc_hi: n_min = 3 needs a population of at least 9 for 3 components, found 8");
  // Points without a cone have smaller populations.
  EXPECT_EQ(refusal({{"n_min", std::int64_t{3}}}, budget, 1),
            "pmc_hi: n_min = 3 needs a population of at least 6 for 2 components, found 4");
  EXPECT_EQ(refusal({{"n_min", std::int64_t{3}}, {"population", std::int64_t{9}}}, budget, 2), "");
  EXPECT_EQ(refusal({{"n_min", std::int64_t{3}},
                     {"schedule", std::string("two_stage")},
                     {"base_iterations", std::int64_t{0}}},
                    budget, 2),
            "");
  EXPECT_EQ(refusal({{"n_min", std::int64_t{2}}}, budget, 100), "");
}

TEST(CheckBudget, RefusesFloorsThatSumToMoreThanOne) {
  const Budget budget{SamplerKind::Independent, 4, 12};
  EXPECT_EQ(refusal({{"alpha_floor", 0.25}}, budget, 3), "");
  EXPECT_NE(refusal({{"alpha_floor", 0.26}}, budget, 3), "");
  EXPECT_EQ(refusal({{"alpha_floor", 0.5}, {"light_mode", std::string("all_as_one")}}, budget, 9),
            "");
}

TEST(BiasReason, KnowsThatDrawnCountsCanMissAComponentWithoutAdaptation) {
  const EstimatorEntry& entry = *find_estimator("pmc_hi");
  const auto reason = [&](const ParamSet::Map& given) {
    return entry.bias_reason(fixtures::params_with(entry, given));
  };
  const ParamValue multinomial = std::string("multinomial");
  const ParamValue alpha = std::string("alpha");
  const ParamValue none = std::int64_t{0};
  EXPECT_NE(reason({{"adapt", false}, {"rounding", multinomial}, {"n_min", none}}), "");
  EXPECT_NE(reason({{"adapt", false}, {"rounding", multinomial}, {"denominator", alpha}}), "");
  EXPECT_EQ(
      reason(
          {{"adapt", false}, {"rounding", multinomial}, {"denominator", alpha}, {"n_min", none}}),
      "");
  EXPECT_EQ(reason({{"adapt", false}, {"denominator", alpha}}), "");
}

}  // namespace
}  // namespace penumbra::pmc_hi
