// Every estimator in its standard settings against the six fixtures, with all samplers and light
// samplings.
//
// False alarms: each |mean - I| is compared with k standard errors, k such that all tests of this
// file together raise a false alarm with probability 1e-4 (Sidak, 450 tests: k = 5.2). Seeds are
// fixed and follow from the tests' names. Standard errors are 0.01 % (A) to 0.2 % (C) of I with 1e5
// estimates, so a bias of 1 % is found everywhere.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <ostream>

#include "tests/support/fixtures.h"

namespace penumbra::fixtures {
namespace {

constexpr double kFamilyLevel = 1e-4;
constexpr int kFamilyTests = 450;

struct Configuration {
  std::string name;
  std::string estimator;
  ParamSet::Map params;
  SamplerKind sampler;
};

Budget budget_of(const EstimatorEntry& entry, SamplerKind sampler) {
  return entry.adaptive ? Budget{sampler, 4, 12} : Budget{sampler, 16, 0};
}

std::vector<Configuration> configurations(bool independent) {
  struct Base {
    std::string name, estimator;
    ParamSet::Map params;
  };
  const std::string balance = "balance", power2 = "power2";
  const std::vector<Base> bases = {
      {"mis_shared_balance", "mis", {{"layout", std::string("shared")}, {"heuristic", balance}}},
      {"mis_shared_power2", "mis", {{"layout", std::string("shared")}, {"heuristic", power2}}},
      {"mis_pairs_power2", "mis", {{"layout", std::string("pairs")}, {"heuristic", power2}}},
      {"pmc_hi", "pmc_hi", {}},
      {"alsd", "alsd", {}},
      {"light", "light", {}},
      {"light_power", "light", {{"choice", std::string("power")}}},
      {"bsdf", "bsdf", {}},
      {"uniform", "uniform", {}},
  };
  const std::vector<SamplerKind> samplers =
      independent ? std::vector{SamplerKind::Independent}
                  : std::vector{SamplerKind::Stratified, SamplerKind::Sobol};
  std::vector<Configuration> result;
  for (const Base& base : bases) {
    for (const SamplerKind sampler : samplers) {
      for (const std::string light_sampling : {"area", "solid_angle", "cosine"}) {
        ParamSet::Map params = base.params;
        if (base.name == "bsdf" || base.name == "uniform") {
          if (light_sampling != "area") continue;
        } else {
          params["light_sampling"] = light_sampling;
        }
        result.push_back({base.name + "_" + light_sampling + "_" + std::string(to_string(sampler)),
                          base.estimator, params, sampler});
      }
    }
  }
  return result;
}

std::string name_of(const ::testing::TestParamInfo<Configuration>& info) { return info.param.name; }
void PrintTo(const Configuration& value, std::ostream* out) { *out << value.name; }

void expect_unbiased(const Configuration& c, std::uint64_t estimates) {
  const EstimatorEntry& entry = *find_estimator(c.estimator);
  const double limit = family_limit(kFamilyLevel, kFamilyTests);
  for (const Fixture& f : all_fixtures()) {
    const double exact = exact_radiance(f);
    const std::uint64_t seed = test_seed(std::string(1, f.id));
    const RunStatistics run =
        estimate_many(entry, params_with(entry, c.params), budget_of(entry, c.sampler), build(f),
                      exact, seed, estimates);
    EXPECT_TRUE(is_unbiased(run, exact, limit))
        << c.name << ", fixture " << f.id << ", seed " << seed << ": mean " << run.mean
        << ", exact " << exact << ", z " << (run.mean - exact) / run.standard_error() << ", limit "
        << limit << ", non-finite " << run.non_finite << ", negative " << run.negative
        << ", uncovered " << run.counters.uncovered;
    EXPECT_EQ(run.n, run.counters.estimates);
    EXPECT_LE(run.counters.rays, run.counters.samples);
  }
}

TEST(FixturesReference, QuadratureAgreesWithEveryPrintedDigit) {
  for (const Fixture& f : all_fixtures()) {
    EXPECT_EQ(std::round(exact_radiance(f) * 1e6), std::round(f.printed * 1e6)) << f.id;
  }
}

class Fixtures : public ::testing::TestWithParam<Configuration> {};
TEST_P(Fixtures, MeanIsTheExactRadiance) { expect_unbiased(GetParam(), 100'000); }
INSTANTIATE_TEST_SUITE_P(Independent, Fixtures, ::testing::ValuesIn(configurations(true)), name_of);

// Fewer estimates: stratification changes the samplers' points, not the estimators.
class FixturesStratified : public ::testing::TestWithParam<Configuration> {};
TEST_P(FixturesStratified, MeanIsTheExactRadiance) { expect_unbiased(GetParam(), 12'000); }
INSTANTIATE_TEST_SUITE_P(Samplers, FixturesStratified, ::testing::ValuesIn(configurations(false)),
                         name_of);

class FixturesLong : public ::testing::TestWithParam<Configuration> {};
TEST_P(FixturesLong, MeanIsTheExactRadiance) { expect_unbiased(GetParam(), 1'000'000); }
INSTANTIATE_TEST_SUITE_P(Independent, FixturesLong, ::testing::ValuesIn(configurations(true)),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Samplers, FixturesLong, ::testing::ValuesIn(configurations(false)),
                         name_of);

// One row of the specification's table: relative mean square error times samples.
struct Row {
  const char* label;
  const char* estimator;
  ParamSet::Map params;
  double cost[6];  // fixtures A to F
};

// The band around a printed cost: 5 % for its digits (.44 is 1 %) and the statistical error of 1e5
// estimates here and 2e5 there, and 10 % for one known difference of convention: the table's PMC-HI
// lets the cone enter again with weight 0.2 whenever Eq. 6 has set its weight to 0, the estimator
// leaves it at 0 as Eq. 6 says. That lowers the cost of A and E by 12 %.
constexpr double kCostBand = 0.15;

TEST(FixturesTable, CostsAreThoseOfTheSpecification) {
  const Row rows[] = {
      {"MIS-S balance", "mis", {}, {0.110, 1.20, 15.5, 0.44, 0.073, 0.805}},
      {"MIS-P power2",
       "mis",
       {{"layout", std::string("pairs")}, {"heuristic", std::string("power2")}},
       {0.068, 1.07, 16.1, 0.93, 0.068, 0.417}},
      {"light only", "light", {}, {0.034, 0.53, 8.0, 3.28, 0.034, 0.245}},
      {"PMC-HI R0",
       "pmc_hi",
       {{"cone", std::string("always")}},
       {0.072, 1.47, 9.5, 0.47, 0.062, 0.373}},
  };
  std::printf("%-14s fixture   bias %%  (se)      relMSE*samples  specification\n", "estimator");
  for (const Row& row : rows) {
    const EstimatorEntry& entry = *find_estimator(row.estimator);
    for (std::size_t i = 0; i < 6; ++i) {
      const Fixture& f = all_fixtures()[i];
      const double exact = exact_radiance(f);
      const RunStatistics run = estimate_many(
          entry, params_with(entry, row.params), budget_of(entry, SamplerKind::Independent),
          build(f), exact, test_seed(std::string(row.label) + f.id), 100'000);
      const double cost = run.cost(exact);
      std::printf("%-14s %c       %+7.3f  (%.3f)   %-8.4g        %.4g\n", row.label, f.id,
                  100.0 * run.bias(exact), 100.0 * run.standard_error() / exact, cost, row.cost[i]);
      EXPECT_NEAR(cost / row.cost[i], 1.0, kCostBand) << row.label << ' ' << f.id;
      EXPECT_EQ(run.counters.samples, 32 * run.counters.estimates) << row.label << ' ' << f.id;
    }
  }
}

}  // namespace
}  // namespace penumbra::fixtures
