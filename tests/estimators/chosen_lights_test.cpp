// Estimates with a limited number of samples, down to fewer than lights: unbiased and within it.
//
// False alarms: 1e-4 for all tests of this file together (Sidak, 30 tests: k = 4.6). Seeds are
// fixed and follow from the tests' names.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/fixtures.h"

namespace penumbra::fixtures {
namespace {

struct Case {
  std::string estimator;
  ParamSet::Map params;
};

std::vector<Case> cases() {
  std::vector<Case> result;
  for (const std::int64_t samples : {1, 3, 32}) {
    result.push_back({"light", {{"samples", samples}}});
    result.push_back({"light", {{"samples", samples}, {"choice", std::string("power")}}});
    result.push_back({"light_tree", {{"samples", samples}, {"split", 0.0}}});
    result.push_back({"light_tree", {{"samples", samples}}});
  }
  return result;
}

TEST(ChosenLights, AreUnbiasedWithFewSamples) {
  const Budget budget{SamplerKind::Independent, 16, 0};
  for (const Case& c : cases()) {
    const EstimatorEntry& entry = *find_estimator(c.estimator);
    const ParamSet params = params_with(entry, c.params);
    EXPECT_EQ(entry.bias_reason(params), "");
    for (const char id : {'A', 'F'}) {
      const double exact = exact_radiance(fixture(id));
      const std::string label = c.estimator + params.differences(entry.params()) + id;
      const RunStatistics run = estimate_many(entry, params, budget, build(fixture(id)), exact,
                                              test_seed(label), 100'000);
      EXPECT_TRUE(is_unbiased(run, exact, family_limit(1e-4, 30)))
          << label << ": bias " << run.bias(exact) << ", se " << run.standard_error() / exact;
      const auto most = static_cast<std::uint64_t>(std::get<std::int64_t>(c.params.at("samples")));
      EXPECT_LE(run.counters.samples, most * run.n) << label;
    }
  }
}

// The negative control: the test sees half a per cent.
TEST(ChosenLights, HalfAPercentOfBiasIsFound) {
  const EstimatorEntry& entry = *find_estimator("light_tree");
  const double exact = exact_radiance(fixture('A'));
  const RunStatistics run =
      estimate_many(entry, params_with(entry, {}), {SamplerKind::Independent, 16, 0},
                    build(fixture('A')), exact, test_seed(""), 100'000);
  EXPECT_FALSE(is_unbiased(run, 1.005 * exact, family_limit(1e-4, 30)));
}

}  // namespace
}  // namespace penumbra::fixtures
