// Optimal MIS: least squares by hand, integrands that the densities span, and the control: with
// coefficients from the estimate's own samples the test of unbiasedness fails.
//
// False alarms of the positive cases: 1e-4 for all of this file together (Sidak, 12 tests).

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <vector>

#include "estimators/mixture/mixture.h"
#include "estimators/optimal_mis/normal_equations.h"
#include "tests/support/fixtures.h"

namespace penumbra::fixtures {
namespace {

using optimal_mis::NormalEquations;
using Text = std::string;

const EstimatorEntry& entry() { return *find_estimator("optimal_mis"); }
double limit() { return family_limit(1e-4, 12); }

constexpr std::array<std::array<double, 3>, 4> kRegressors{
    {{1.0, 0.5, 0.0}, {0.25, 2.0, 1.0}, {0.0, 1.0, 3.0}, {2.0, 0.0, 0.5}}};

RgbSum value_of(const std::array<double, 3>& x, const std::array<RgbSum, 3>& beta) {
  return beta[0] * x[0] + beta[1] * x[1] + beta[2] * x[2];
}

TEST(NormalEquations, FindTheCoefficientsThatValuesAreMadeOf) {
  const std::array<RgbSum, 3> made{RgbSum(1.0, -2.0, 0.0), RgbSum(0.5, 0.5, 4.0),
                                   RgbSum(-3.0, 1.0, 1.0)};
  NormalEquations equations(5);
  NormalEquations half(5);
  equations.clear(3);
  half.clear(3);
  for (std::size_t i = 0; i < 2; ++i) equations.add(kRegressors[i], value_of(kRegressors[i], made));
  for (std::size_t i = 2; i < 4; ++i) half.add(kRegressors[i], value_of(kRegressors[i], made));
  equations.add(half);
  EXPECT_EQ(equations.samples(), 4.0);
  std::array<RgbSum, 3> beta;
  equations.solve(1e-12, beta);
  for (std::size_t k = 0; k < 3; ++k) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(beta[k][c], made[k][c], 1e-9) << k << ' ' << c;
  }
}

TEST(NormalEquations, ASampleOfOneRegressorIsASampleWithTheOthersAtZero) {
  NormalEquations alone(2);
  NormalEquations spelled_out(2);
  alone.clear(2);
  spelled_out.clear(2);
  const std::array<double, 2> both{1.0, 2.0};
  const std::array<double, 2> second{0.0, 3.0};
  alone.add(both, RgbSum(5.0));
  alone.add_alone(1, 3.0, 2.0);
  spelled_out.add(both, RgbSum(5.0));
  spelled_out.add(second, RgbSum(0.0));
  spelled_out.add(second, RgbSum(0.0));
  EXPECT_EQ(alone.samples(), spelled_out.samples());
  std::array<RgbSum, 2> a, b;
  alone.solve(0.1, a);
  spelled_out.solve(0.1, b);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_DOUBLE_EQ(a[k].x, b[k].x);
}

// Two regressors that are one: the ridge shares the coefficient between them. One that is never
// seen gets none.
TEST(NormalEquations, WithoutFullRankHaveASolutionAllTheSame) {
  NormalEquations equations(3);
  equations.clear(3);
  for (const double x : {1.0, 2.0, 3.0}) {
    equations.add(std::array<double, 3>{x, x, 0.0}, RgbSum(4.0 * x));
  }
  std::array<RgbSum, 3> beta;
  equations.solve(1e-6, beta);
  EXPECT_NEAR(beta[0].x, 2.0, 1e-5);
  EXPECT_NEAR(beta[1].x, 2.0, 1e-5);
  EXPECT_EQ(beta[2].x, 0.0);
}

/// A diffuse point under a constant environment; nothing is above it.
PlacedPoint under_the_sky() {
  SceneDescription scene;
  scene.name = "sky";
  scene.camera = {{0.0, -4.0, 2.5}, {0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, 60.0, {8, 8}};
  scene.materials = {lambert("grey", 0.5)};
  scene.shapes.push_back(rectangle("floor", 0, {-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, 0.0));
  scene.environment = EnvironmentDescription{"sky", 1, 1, {Rgb(2.0f)}, 0.0};
  PlacedPoint placed;
  placed.scene = std::make_unique<Scene>(std::move(scene));
  placed.point = place(*placed.scene, {0, 0, 0}, {0, 0, 1}, Vec3d(0, -0.6, 0.8), 0);
  return placed;
}

// Under a constant sky a diffuse reflection is proportional to the density of its BSDF: beta of
// that density is the radiance, and no error is left. `mis` spends half of its samples on the sky.
TEST(OptimalMis, HasNoErrorWhereADensityIsProportionalToTheIntegrand) {
  const PlacedPoint placed = under_the_sky();
  const double exact = 0.5 * 2.0;
  const Budget budget{SamplerKind::Independent, 16, 0};
  const RunStatistics optimal = estimate_many(entry(), params_with(entry(), {}), budget, placed,
                                              exact, test_seed("optimal"), 4096);
  const EstimatorEntry& mis = *find_estimator("mis");
  const RunStatistics balance =
      estimate_many(mis, params_with(mis, {}), budget, placed, exact, test_seed("mis"), 4096);
  std::printf("relative rms: optimal_mis %.2g, mis %.2g\n",
              std::sqrt(optimal.mean_square_error) / exact,
              std::sqrt(balance.mean_square_error) / exact);
  EXPECT_LT(std::sqrt(optimal.mean_square_error), 1e-4 * exact);
  EXPECT_GT(std::sqrt(balance.mean_square_error), 1e-2 * exact) << "the control";
}

/// A glossy point under a rectangle that reaches below its horizon, a sphere, and the sky.
PlacedPoint of_many_kinds() {
  SceneDescription scene;
  scene.name = "kinds";
  scene.camera = {{0.0, -4.0, 2.5}, {0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, 60.0, {8, 8}};
  scene.materials = {{"phong", PhongMaterial{Rgb(0.3f), Rgb(0.5f), 5.0f}}, lambert("black", 0.0)};
  scene.shapes.push_back(rectangle("floor", 0, {-1, -1, 0}, {0.5, 0, 0}, {0, 0.5, 0}, 0.0));
  scene.shapes.push_back(rectangle("panel", 1, {1, -1, -1}, {0, 2, 0}, {0, 0, 3}, 2.0, true));
  ShapeDescription ball;
  ball.name = "ball";
  ball.material = 1;
  ball.shape = SphereShape{{-1.5, 0.5, 0.1}, 0.5};
  ball.emission = EmissionDescription{Rgb(3.0f), false};
  scene.shapes.push_back(ball);
  scene.environment = EnvironmentDescription{"sky", 1, 2, {Rgb(2.0f), Rgb(1.0f)}, 0.0};
  PlacedPoint placed;
  placed.scene = std::make_unique<Scene>(std::move(scene));
  const Vec3d wo = Vec3d(0.8, 0.0, 0.6);  // the lobe reaches below the horizon
  placed.point = place(*placed.scene, {0, 0, 0}, {0, 0, 1}, wo, 0);
  return placed;
}

// E[h_k/K] is the integral of h_k: 1, once the directions that bring no light are counted too.
// Without them it is not, for any kind of component.
TEST(DroppedDirections, CompleteTheIntegralOfEveryDensity) {
  const PlacedPoint placed = of_many_kinds();
  for (const bool lights_as_one : {false, true}) {
    Mixture mixture(*placed.scene, LightSampling::Area, lights_as_one, 64);
    mixture.keep_dropped();
    mixture.set_up(placed.point);
    ASSERT_EQ(mixture.active_lights(), 3);
    const int m = mixture.light_components() + 1;
    std::vector<int> counts(static_cast<std::size_t>(m) + 1, 0);
    for (int k = 0; k < m; ++k) counts[static_cast<std::size_t>(k)] = 3 + k;
    const int n = std::accumulate(counts.begin(), counts.end(), 0);
    std::vector<double> all(static_cast<std::size_t>(m)), kept(all), squares(all);
    constexpr int kRuns = 40'000;
    for (int run = 0; run < kRuns; ++run) {
      StreamKey key;
      key.seed = test_seed("draws");
      key.estimate = static_cast<std::uint32_t>(run);
      mixture.clear_samples();
      mixture.draw(SamplerKind::Independent, key, counts);
      const auto share = [&](int k, auto pdf_w) {
        double density = 0.0;
        for (int q = 0; q < m; ++q) {
          density += counts[static_cast<std::size_t>(q)] * static_cast<double>(pdf_w(q));
        }
        return static_cast<double>(pdf_w(k)) / density;
      };
      for (int k = 0; k < m; ++k) {
        const auto at = static_cast<std::size_t>(k);
        double of_kept = 0.0;
        for (std::size_t i = 0; i < mixture.size(); ++i) {
          of_kept += share(k, [&](int q) { return mixture.pdf_w(i, q); });
        }
        double sum = of_kept + mixture.dropped_alone(k) / static_cast<double>(counts[at]);
        for (std::size_t i = 0; i < mixture.dropped(); ++i) {
          sum += share(k, [&](int q) { return mixture.dropped_pdf_w(i, q); });
        }
        kept[at] += of_kept / kRuns;
        all[at] += sum / kRuns;
        squares[at] += sum * sum / kRuns;
      }
    }
    for (std::size_t k = 0; k < all.size(); ++k) {
      const double error = std::sqrt((squares[k] - all[k] * all[k]) / kRuns);
      EXPECT_NEAR(all[k], 1.0, limit() * error + 1e-6) << "component " << k << " of " << n;
      EXPECT_LT(kept[k], 0.98) << "the control, component " << k;
    }
  }
}

RunStatistics run_on(char id, const ParamSet::Map& params, SamplerKind sampler,
                     std::uint64_t estimates) {
  const Fixture& f = fixture(id);
  return estimate_many(entry(), params_with(entry(), params), Budget{sampler, 8, 0}, build(f),
                       exact_radiance(f), test_seed(std::string(1, id)), estimates);
}

// On fixture F, where the lobe makes few samples decide both f and h_BSDF.
TEST(OptimalMis, CoefficientsOfTheEstimatesOwnSamplesAreBiasedAndThoseOfOthersAreNot) {
  const ParamSet::Map own = {{"coefficients", Text("own")}};
  EXPECT_NE(entry().bias_reason(params_with(entry(), own)), "");
  const double exact = exact_radiance(fixture('F'));
  const RunStatistics biased = run_on('F', own, SamplerKind::Independent, 100'000);
  const RunStatistics unbiased = run_on('F', {}, SamplerKind::Independent, 100'000);
  std::printf("own %+.3f %% (se %.3f), others %+.3f %% (se %.3f)\n", 100.0 * biased.bias(exact),
              100.0 * biased.standard_error() / exact, 100.0 * unbiased.bias(exact),
              100.0 * unbiased.standard_error() / exact);
  EXPECT_EQ(biased.non_finite + biased.counters.uncovered, 0u);
  EXPECT_FALSE(is_unbiased(biased, exact, limit()));
  EXPECT_TRUE(is_unbiased(unbiased, exact, limit()));
}

TEST(OptimalMis, IsUnbiasedWithEverySampler) {
  for (const SamplerKind sampler : {SamplerKind::Stratified, SamplerKind::Sobol}) {
    for (const char id : {'C', 'E'}) {
      const double exact = exact_radiance(fixture(id));
      EXPECT_TRUE(is_unbiased(run_on(id, {}, sampler, 50'000), exact, limit()))
          << id << ' ' << to_string(sampler);
    }
  }
}

}  // namespace
}  // namespace penumbra::fixtures
