// MIS compensation of environments: unbiased together with BSDF samples, and only so.
//
// False alarms: 1e-4 for all tests of this file together (Sidak, 20 tests: k = 4.6). Seeds are
// fixed and follow from the tests' names.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "estimators/mixture/estimates.h"
#include "tests/support/fixtures.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra::fixtures {
namespace {

const double kLimit = family_limit(1e-4, 20);
constexpr float kAlbedo = 0.6f;

// A sky with a sun, over a grey floor whose point sees all of the upper half.
SceneDescription under_sky(bool panel) {
  SceneDescription scene;
  scene.materials = {test::lambert(kAlbedo),
                     {"plastic", MetallicRoughnessMaterial{Rgb(0.5f), 0.2f, 0.4f}}};
  scene.shapes = {test::shape("floor", RectangleShape{{-3, 0, 3}, {6, 0, 0}, {0, 0, -6}})};
  if (panel) {
    scene.shapes.push_back(
        test::light("panel", RectangleShape{{-0.5, 1, -0.5}, {1, 0, 0}, {0, 0, 1}}, Rgb(2.0f)));
  }
  EnvironmentDescription sky;
  sky.columns = 8;
  sky.rows = 4;
  for (int i = 0; i < 32; ++i) sky.texels.emplace_back(0.3f + 0.02f * static_cast<float>(i % 8));
  sky.texels[11] = Rgb(9.0f);
  scene.environment = sky;
  return scene;
}

PlacedPoint point_under_sky(std::uint32_t material, bool panel = false) {
  PlacedPoint result{std::make_unique<Scene>(under_sky(panel)), {}};
  result.point =
      place(*result.scene, {0, 1e-4, 0}, {0, 1, 0}, Vec3d(0.4, 1, 0.2).normalized(), material);
  return result;
}

// Radiance of a diffuse point under the whole sky, by the cosine's integral over each texel: its
// share of a turn x the difference of squared sines / 2.
double exact_of_sky(const Scene& scene) {
  const auto light = static_cast<std::size_t>(scene.environment_light());
  const Environment& sky = scene.lights()[light].environment;
  double irradiance = 0.0;
  for (std::uint32_t row = 0; 2 * row < sky.rows(); ++row) {
    const double step = M_PI / sky.rows();
    const double low = std::sin(row * step);
    const double high = std::sin((row + 1) * step);
    for (std::uint32_t column = 0; column < sky.columns(); ++column) {
      const double theta = (row + 0.5) * step;
      const double phi = (column + 0.5) * 2.0 * M_PI / sky.columns();
      const Vec3 w(
          Vec3d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)));
      irradiance += double{luminance(sky.radiance(w))} * 2.0 * M_PI / sky.columns() *
                    (high * high - low * low) / 2.0;
    }
  }
  return double{kAlbedo} / M_PI * irradiance;
}

RunStatistics run(const PlacedPoint& point, const ParamSet::Map& given, double exact) {
  const EstimatorEntry& mis = *find_estimator("mis");
  const ParamSet params = params_with(mis, given);
  EXPECT_EQ(mis.bias_reason(params), "");
  return estimate_many(mis, params, {SamplerKind::Independent, 8, 0}, point, exact,
                       test_seed(params.differences(mis.params())), 200'000);
}

TEST(Compensation, IsUnbiasedWithEveryLayoutAndHeuristic) {
  const PlacedPoint point = point_under_sky(0);
  const double exact = exact_of_sky(*point.scene);
  for (const std::string layout : {"shared", "pairs"}) {
    for (const std::string heuristic : {"balance", "power2"}) {
      const RunStatistics stats = run(point,
                                      {{"layout", layout},
                                       {"heuristic", heuristic},
                                       {"environment", std::string("compensated")}},
                                      exact);
      EXPECT_TRUE(is_unbiased(stats, exact, kLimit))
          << layout << ' ' << heuristic << ": bias " << stats.bias(exact);
      EXPECT_LT(stats.standard_error(), 1e-3 * exact) << "the test has power";
    }
  }
}

// Against the plain density, where there is no closed form: a glossy surface and another light.
TEST(Compensation, GivesTheMeanOfThePlainDensityBesideOtherLights) {
  for (const std::uint32_t material : {0u, 1u}) {
    const PlacedPoint point = point_under_sky(material, true);
    const RunStatistics plain = run(point, {{"environment", std::string("luminance")}}, 1.0);
    const RunStatistics stats = run(point, {{"environment", std::string("compensated")}}, 1.0);
    const double error = std::hypot(plain.standard_error(), stats.standard_error());
    EXPECT_LT(std::abs(stats.mean - plain.mean), kLimit * error) << material;
    EXPECT_LT(stats.variance, plain.variance) << material;
  }
}

// The negative control: light samples alone miss what is below the sky's mean.
TEST(Compensation, IsBiasedWithoutBsdfSamplesAndTheTestFindsIt) {
  const PlacedPoint point = point_under_sky(0);
  const double exact = exact_of_sky(*point.scene);
  for (const bool with_bsdf : {true, false}) {
    Mixture mixture(*point.scene, LightSampling::SolidAngle, false, 64);
    mixture.compensate_environment();
    const std::vector<int> counts = {4, with_bsdf ? 4 : 0, 0};
    const double n = counts[0] + counts[1];
    const std::vector<double> coefficients = {counts[0] / n, counts[1] / n, 0.0};
    std::vector<double> density(64);
    test::Moments moments;
    StreamKey key;
    key.seed = test_seed("mixture");
    for (key.pixel = 0; key.pixel < 100'000; ++key.pixel) {
      mixture.set_up(point.point);
      mixture.draw(SamplerKind::Independent, key, counts);
      moments.add(luminance(balance_sum(mixture, coefficients, density)) / n);
    }
    EXPECT_EQ(mixture.counters().uncovered, 0u) << "no sample tells of what is missing";
    EXPECT_EQ(moments.z(exact, 1e-6) < kLimit, with_bsdf) << moments.mean() << ' ' << exact;
  }
}

}  // namespace
}  // namespace penumbra::fixtures
