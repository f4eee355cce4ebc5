// Weights, counts and populations at their ends: nothing seen, one hit, fewer samples than
// components, densities over 40 orders of magnitude. Statistical checks of this file (fewer than
// 300) raise a false alarm with probability 1e-4 together.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "estimators/mixture/estimates.h"
#include "estimators/pmc_hi/kernel.h"
#include "tests/stability/estimator_scene.h"
#include "tests/stability/naive.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using fixtures::PlacedPoint;

const double kLimit = fixtures::family_limit(1e-4, 300);

// A sample's share of the weights as equation 6 has it.
PN_NAIVE double naive_share(double weight, double sum) { return weight / sum; }

// Balance of the power heuristic, all in float.
PN_NAIVE float naive_power_sum(float a, float b) {
  return a * a / (a * a + b * b) + b * b / (a * a + b * b);
}

class Weights : public test::EveryEstimator {};
class UnbiasedWeights : public test::EveryEstimator {};

std::vector<const EstimatorEntry*> unbiased() {
  std::vector<const EstimatorEntry*> result;
  for (const EstimatorEntry* entry : all_estimators()) {
    if (entry->bias_reason(fixtures::params_with(*entry, {})).empty()) result.push_back(entry);
  }
  return result;
}

// Two lights and a board that hides both of them.
PlacedPoint fully_shadowed() {
  SceneDescription scene;
  scene.materials = {fixtures::lambert("black", 0.0), fixtures::lambert("white", 1.0)};
  scene.shapes = {fixtures::rectangle("left", 0, {-1, -1, 2}, {0, 1, 0}, {1, 0, 0}, 1.0),
                  fixtures::rectangle("right", 0, {0.5, 0, 2}, {0, 1, 0}, {1, 0, 0}, 5.0),
                  fixtures::rectangle("board", 0, {-9, -9, 1}, {18, 0, 0}, {0, 18, 0}, 0.0)};
  PlacedPoint placed{std::make_unique<Scene>(scene), {}};
  placed.point = fixtures::place(*placed.scene, Vec3d(0.0), {0, 0, 1}, {0, 0, 1}, 1);
  return placed;
}

TEST_P(Weights, AllZeroGiveExactlyZeroAndKeepTracing) {
  const PlacedPoint placed = fully_shadowed();
  const Budget budget = GetParam()->adaptive ? Budget{SamplerKind::Stratified, 4, 12}
                                             : Budget{SamplerKind::Stratified, 16, 0};
  const auto run = fixtures::estimate_many(*GetParam(), fixtures::params_with(*GetParam(), {}),
                                           budget, placed, 1.0, 9, 2048);
  EXPECT_EQ(run.mean, 0.0);
  EXPECT_EQ(run.variance, 0.0);
  EXPECT_EQ(run.non_finite + run.counters.uncovered + run.counters.untraced, 0u);
  EXPECT_EQ(run.counters.lit, 0u);
  // Light that only the last samples could find is still looked for; by pmc_hi_plus with the
  // initial samples, whose neighbours all saw none.
  const int srl = GetParam()->name == "pmc_hi_plus" ? budget.srl_initial : budget.srl();
  EXPECT_EQ(run.counters.samples, run.counters.estimates * static_cast<std::uint64_t>(2 * srl));
}

// Any number of samples, odd ones and fewer than components: the mean is the exact radiance, of
// estimators that say so.
TEST_P(UnbiasedWeights, PopulationsOfAnySizeHaveTheExactMean) {
  const ParamSet params = fixtures::params_with(*GetParam(), {});
  for (const char id : {'A', 'F'}) {
    const fixtures::Fixture& fixture = fixtures::fixture(id);
    const PlacedPoint placed = fixtures::build(fixture);
    const double exact = fixtures::exact_radiance(fixture);
    for (int n = GetParam()->min_srl; n <= 11; ++n) {
      for (const SamplerKind sampler : {SamplerKind::Stratified, SamplerKind::Sobol}) {
        const Budget budget = GetParam()->adaptive
                                  ? Budget{sampler, (n + 3) / 2, std::max(2, n / 2)}
                                  : Budget{sampler, n, 0};
        const auto run = fixtures::estimate_many(
            *GetParam(), params, budget, placed, exact,
            fixtures::test_seed(std::to_string(n) + id + std::string(to_string(sampler))), 20000);
        EXPECT_TRUE(fixtures::is_unbiased(run, exact, kLimit))
            << id << " n = " << n << ": " << run.bias(exact) << " of "
            << run.standard_error() / exact;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Estimators, Weights,
                         ::testing::ValuesIn(all_estimators().begin(), all_estimators().end()),
                         test::estimator_name);
INSTANTIATE_TEST_SUITE_P(Estimators, UnbiasedWeights, ::testing::ValuesIn(unbiased()),
                         test::estimator_name);

// The kernel of PMC-HI without any light: weights as before, no cone.
TEST(KernelWeights, StayWhereNothingWasSeenWhereEquation6HasNoValue) {
  using pmc_hi::Kernel;
  const pmc_hi::Settings settings;
  const PlacedPoint placed = fully_shadowed();
  Mixture mixture(*placed.scene, LightSampling::Area, false, 64);
  mixture.set_up(placed.point);
  Kernel kernel(settings, 4);
  StreamKey key;
  kernel.start(mixture, key, 32, true);
  const std::vector<double> before(kernel.alpha().begin(), kernel.alpha().end());
  mixture.draw(SamplerKind::Stratified, key, kernel.counts());
  ASSERT_GT(mixture.size(), 0u);
  const std::vector<double> weights(mixture.size(), 0.0);
  kernel.learn(mixture, 0, weights);
  EXPECT_TRUE(std::equal(before.begin(), before.end(), kernel.alpha().begin()));
  EXPECT_FALSE(mixture.cone().active());
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  EXPECT_TRUE(std::isnan(naive_share(weights[0], sum))) << "the naive form";
}

// One hit: all weight to its component, but a sample for every other, and no cone of angle 0.
TEST(KernelWeights, OfASingleHitKeepASampleForEveryComponent) {
  using pmc_hi::Kernel;
  const pmc_hi::Settings settings;
  const PlacedPoint placed = fixtures::build(fixtures::fixture('A'));
  Mixture mixture(*placed.scene, LightSampling::Area, false, 128);
  mixture.set_up(placed.point);
  Kernel kernel(settings, 4);
  StreamKey key;
  kernel.start(mixture, key, 32, true);
  mixture.draw(SamplerKind::Stratified, key, kernel.counts());
  std::vector<double> weights(mixture.size(), 0.0);
  weights[0] = 1e-250;
  const auto own = static_cast<std::size_t>(mixture.component(0));
  kernel.learn(mixture, 0, weights);
  EXPECT_FALSE(mixture.cone().active());
  EXPECT_EQ(kernel.alpha()[own], 1.0);
  for (int n = 3; n <= 9; ++n) {
    key.iteration = static_cast<std::uint32_t>(n);
    kernel.next(key, n);
    EXPECT_EQ(std::accumulate(kernel.counts().begin(), kernel.counts().end(), 0), n);
    for (std::size_t k = 0; k + 1 < kernel.counts().size(); ++k) {
      EXPECT_GE(kernel.counts()[k], 1) << "component " << k << " of " << n;
      EXPECT_GT(kernel.coefficients()[k], 0.0);
    }
  }
  // The counts of Eq. 6 alone: the other light and the BSDF are never drawn again.
  std::vector<int> naive(4);
  pmc_hi::round_counts(settings.rounding, kernel.alpha(), 9, key, naive);
  EXPECT_EQ(std::count(naive.begin(), naive.end(), 0), 3) << "negative control";
}

// As it was: the last entry gets what is left over, whatever its probability.
void counts_up_to_the_last_entry(std::span<const double> pmf, int total, double offset,
                                 std::span<int> counts) {
  double cumulative = 0.0;
  int before = 0;
  for (std::size_t k = 0; k < pmf.size(); ++k) {
    cumulative += total * pmf[k];
    const int upto = k + 1 == pmf.size()
                         ? total
                         : std::min(total, static_cast<int>(std::floor(cumulative + offset)));
    counts[k] = upto - before;
    before = upto;
  }
}

TEST(SystematicCounts, NeverChooseAnEntryOfProbability0WhereTheSumRoundsDown) {
  int naive_failures = 0;
  for (int entries = 2; entries <= 40; ++entries) {
    const auto n = static_cast<std::size_t>(entries);
    std::vector<double> pmf(n + 1, 1.0 / entries);
    pmf[n] = 0.0;
    std::vector<int> counts(n + 1);
    for (int total = 1; total <= 64; ++total) {
      for (const double offset : {0.0, 0x1p-32, 0.5, 1.0 - 0x1p-32}) {
        systematic_counts(pmf, total, offset, counts);
        ASSERT_EQ(counts[n], 0) << entries << " " << total;
        ASSERT_EQ(std::accumulate(counts.begin(), counts.end(), 0), total);
        ASSERT_GE(*std::min_element(counts.begin(), counts.end()), 0);
        counts_up_to_the_last_entry(pmf, total, offset, counts);
        naive_failures += counts[n] > 0 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(naive_failures, 0) << "negative control";
}

// Power heuristic of two densities p, q with p/q = 10^d: in float, squares of what light densities
// are for lights of 1e-10 overflow.
TEST(PowerHeuristic, OfDensitiesOver40OrdersOfMagnitudeSumsToOne) {
  int naive_failures = 0;
  for (int p = -20; p <= 20; ++p) {
    for (int q = -20; q <= 20; ++q) {
      const auto a = static_cast<float>(std::pow(10.0, p));
      const auto b = static_cast<float>(std::pow(10.0, q));
      // As mis/power2 does: float densities, squares in double.
      const double a2 = static_cast<double>(a) * static_cast<double>(a);
      const double b2 = static_cast<double>(b) * static_cast<double>(b);
      const double wa = a2 / (a2 + b2);
      const double wb = b2 / (a2 + b2);
      EXPECT_TRUE(wa >= 0.0 && wa <= 1.0 && std::abs(wa + wb - 1.0) < 1e-15) << p << " " << q;
      naive_failures += std::abs(naive_power_sum(a, b) - 1.0f) < 1e-5f ? 0 : 1;
    }
  }
  EXPECT_GT(naive_failures, 50) << "negative control";
}

// One of 200 lights a hundred million times as bright as the others: chosen by power its radiance
// is found at once, and the others keep their share.
TEST(DominatingLight, IsFoundAmongHundredsAndTheOthersAreNotLost) {
  SceneDescription scene;
  scene.materials = {fixtures::lambert("black", 0.0), fixtures::lambert("grey", 0.5)};
  scene.shapes = {fixtures::rectangle("floor", 0, {-2, -2, -1}, {4, 0, 0}, {0, 4, 0}, 0.0)};
  for (int i = 0; i < 200; ++i) {
    const Vec3d origin(-1.0 + 0.1 * (i % 20), -0.5 + 0.1 * (i / 20), 1.0);
    scene.shapes.push_back(fixtures::rectangle("light" + std::to_string(i), 0, origin, {0, 0.05, 0},
                                               {0.05, 0, 0}, i == 77 ? 1e8 : 1.0));
  }
  PlacedPoint placed{std::make_unique<Scene>(scene), {}};
  placed.point = fixtures::place(*placed.scene, Vec3d(0.0), {0, 0, 1}, {0, 0, 1}, 1);
  double exact = 0.0;
  for (const Light& light : placed.scene->lights()) {
    exact += 0.5 / M_PI * static_cast<double>(light.radiance.x) *
             test::rectangle_irradiance(light, placed.point.position, {0, 0, 1});
  }
  const EstimatorEntry& entry = *find_estimator("light");
  const ParamSet params = fixtures::params_with(entry, {{"choice", std::string("power")}});
  const auto run = fixtures::estimate_many(entry, params, Budget{SamplerKind::Stratified, 1, 0},
                                           placed, exact, 4, 2048);
  EXPECT_TRUE(fixtures::is_unbiased(run, exact, kLimit)) << run.bias(exact);
  EXPECT_LT(run.standard_error() / exact * std::sqrt(static_cast<double>(run.n)), 1e-2)
      << "a single estimate of 200 samples";
  const auto naive =
      fixtures::estimate_many(entry, fixtures::params_with(entry, {}),
                              Budget{SamplerKind::Stratified, 1, 0}, placed, exact, 4, 2048);
  EXPECT_GT(naive.standard_error(), 2.0 * run.standard_error()) << "equal shares: control";
}

}  // namespace
}  // namespace penumbra
