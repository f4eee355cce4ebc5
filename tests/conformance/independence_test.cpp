// Estimates of neighbouring pixels, and those of one pixel, have uncorrelated errors: nothing ties
// the random numbers of one estimate to those of another.
//
// False alarms: the correlation of n pairs of independent errors is normal with variance 1/n; the
// tests of all estimators, samplers and neighbourhoods together raise an alarm with probability
// 1e-4 (Sidak). Seeds follow from the tests' names.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/conformance/conformance_support.h"
#include "tests/support/correlation.h"
#include "tests/support/fixtures.h"

namespace penumbra::conformance {
namespace {

constexpr std::size_t kSpp = fixtures::kCorrelationSpp;
constexpr double kFamilyLevel = 1e-4;

struct Sampled {
  Variant variant;
  SamplerKind sampler;
};

void PrintTo(const Sampled& s, std::ostream* out) {
  *out << s.variant.name << '_' << to_string(s.sampler);
}

std::vector<Sampled> with_all_samplers() {
  std::vector<Sampled> result;
  for (const Variant& variant : defaults()) {
    for (const SamplerKind sampler :
         {SamplerKind::Independent, SamplerKind::Stratified, SamplerKind::Sobol}) {
      result.push_back({variant, sampler});
    }
  }
  return result;
}

std::vector<double> errors(const Sampled& s) {
  Budget budget = budget_of(*s.variant.entry);
  budget.sampler = s.sampler;
  return fixtures::errors_of_a_tile(*s.variant.entry, s.variant.params, budget,
                                    fixtures::build(fixtures::fixture('F')),
                                    fixtures::test_seed("errors"));
}

class Independence : public ::testing::TestWithParam<Sampled> {
 protected:
  const double limit_ =
      fixtures::family_limit(kFamilyLevel, 2 * static_cast<int>(with_all_samplers().size()));
};

TEST_P(Independence, OfNeighbouringPixels) {
  if (GetParam().variant.entry->correlates_pixels) {
    GTEST_SKIP() << "shares samples between pixels, and its entry says so";
  }
  const double z = fixtures::correlation_z(errors(GetParam()), kSpp);
  EXPECT_LT(std::abs(z), limit_);
}

TEST_P(Independence, OfTheEstimatesOfAPixel) {
  const double z = fixtures::correlation_z(errors(GetParam()), 1);
  EXPECT_LT(std::abs(z), limit_);
}

INSTANTIATE_TEST_SUITE_P(AllEstimators, Independence, ::testing::ValuesIn(with_all_samplers()),
                         [](const auto& test) {
                           return test.param.variant.name + "_" +
                                  std::string(to_string(test.param.sampler));
                         });

// The negative control: pixels that share their random numbers.
TEST(IndependenceControl, SharedNumbersAreFound) {
  const Sampled s{defaults().front(), SamplerKind::Independent};
  std::vector<double> shared = errors(s);
  for (std::size_t i = kSpp; i < shared.size(); ++i) {
    if (i / kSpp % 8 == 0)
      shared[i] = shared[i - kSpp];  // every eighth pixel repeats the one before
  }
  EXPECT_GT(fixtures::correlation_z(shared, kSpp), fixtures::family_limit(kFamilyLevel, 1));
}

}  // namespace
}  // namespace penumbra::conformance
