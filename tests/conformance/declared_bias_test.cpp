// What an estimator declares about its bias is true: one that declares a bias fails the test of
// unbiasedness on the fixture that it names.
//
// The limit of the test of unbiasedness is that of a family of 150 tests with false-alarm
// probability 1e-4 (Sidak: k = 5.0), as for the unbiased cases in tests/estimators.

#include <gtest/gtest.h>

#include <string>

#include "tests/conformance/conformance_support.h"
#include "tests/support/fixtures.h"

namespace penumbra::conformance {
namespace {

constexpr std::uint64_t kEstimates = 100'000;

// Whether the fixture's test of unbiasedness finds the bias; broken values are failures of their
// own and no proof of it.
bool is_caught(const Variant& variant, char fixture_id) {
  const fixtures::Fixture& fixture = fixtures::fixture(fixture_id);
  const double exact = fixtures::exact_radiance(fixture);
  const fixtures::RunStatistics run = fixtures::estimate_many(
      *variant.entry, variant.params, budget_of(*variant.entry), fixtures::build(fixture), exact,
      fixtures::test_seed(variant.name), kEstimates);
  EXPECT_EQ(run.non_finite, 0u) << variant.name;
  EXPECT_EQ(run.negative, 0u) << variant.name;
  return !fixtures::is_unbiased(run, exact, fixtures::family_limit(1e-4, 150));
}

class DeclaredBias : public ::testing::TestWithParam<Variant> {};

TEST_P(DeclaredBias, OfTheDefaultsIsCaughtOnTheFixtureThatIsNamed) {
  const EstimatorEntry& entry = *GetParam().entry;
  if (entry.bias_reason(GetParam().params).empty()) {
    EXPECT_EQ(entry.bias_fixture, 0) << "a fixture for a bias that is not declared";
    return;
  }
  ASSERT_NE(std::string("ABCDEF").find(entry.bias_fixture), std::string::npos)
      << entry.name << " declares a bias, so its entry must name a fixture, 'A' to 'F'";
  EXPECT_TRUE(is_caught(GetParam(), entry.bias_fixture))
      << entry.name << " declares a bias that fixture " << entry.bias_fixture << " does not show";
}

INSTANTIATE_TEST_SUITE_P(AllEstimators, DeclaredBias, ::testing::ValuesIn(defaults()),
                         [](const auto& test) { return test.param.name; });

// The mechanism, on parameters that are known to be biased and on their unbiased counterpart.
TEST(DeclaredBiasMechanism, CatchesTheLiteralPaperAndNotTheDefaults) {
  const EstimatorEntry& entry = *find_estimator("pmc_hi");
  const ParamSet literal = fixtures::params_with(
      entry, {{"n_min", std::int64_t{0}}, {"cone_min_hits", std::int64_t{1}}, {"beta_min", 1e-3}});
  EXPECT_NE(entry.bias_reason(literal), "");
  EXPECT_TRUE(is_caught({"literal", &entry, literal}, 'B'));
  EXPECT_FALSE(is_caught({"defaults", &entry, fixtures::params_with(entry, {})}, 'B'));
}

}  // namespace
}  // namespace penumbra::conformance
