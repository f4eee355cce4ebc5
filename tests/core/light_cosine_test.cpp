// Rectangle lights by solid angle and cosines: the density against its definition, what the warp
// gains, and that another density is rejected. That samples fit the density, and irradiances their
// closed forms, is tested with the other samplings in light_test.cpp.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "scenes/core/light.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

const Vec3 kOrigin(0.0f);
const Vec3 kUp(0.0f, 0.0f, 1.0f);

// All face the origin; the last is partly below its horizon.
Light above() { return test::rectangle_light({-0.2f, -0.9f, 0.7f}, {0, 2.0f, 0}, {1.0f, 0, 0}); }
Light tilted() {
  return test::rectangle_light({0.5f, -1.0f, 0.2f}, {0.0f, 0.6f, 0.8f}, {0.0f, 1.6f, -1.2f});
}
Light low() { return test::rectangle_light({0.2f, 0.25f, 0.3f}, {0, 0.3f, 0}, {2.0f, 0, 0}); }
Light astride() { return test::rectangle_light({1, -1, -1}, {0, 0, 3}, {0, 2, 0}, true); }

LightProposal proposal(const Light& light, LightSampling sampling) {
  LightProposal result;
  EXPECT_TRUE(result.set_up(light, sampling, kOrigin, kUp));
  return result;
}
// It points to the light.
LightProposal proposal(Light&&, LightSampling) = delete;

// The part of a rectangle up to shares of its edges.
Light part(const Light& light, double u, double v) {
  return test::rectangle_light(light.origin, light.edge_u * static_cast<float>(u),
                               light.edge_v * static_cast<float>(v), light.two_sided);
}

// Bilinear in the square whose first coordinate is the share of the solid angle before a place
// along edge_u, and whose second is that of a thin strip there, with the cosines at the corners.
double density_by_definition(const Light& light, double u, double v) {
  double corner[4];
  double largest = 0.0;
  double sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    const Vec3 d = light.origin + light.edge_u * static_cast<float>(i % 2) +
                   light.edge_v * static_cast<float>(i / 2);
    corner[i] = std::max(0.0, double{dot(d, kUp)} / double{d.length()});
    largest = std::max(largest, corner[i]);
  }
  for (double& c : corner) sum += c = std::max(c, largest / 32.0);
  const auto whole = static_cast<double>(test::rectangle_solid_angle(light, kOrigin));
  const auto before = [&](double along_u, double along_v) {
    return static_cast<double>(test::rectangle_solid_angle(part(light, along_u, along_v), kOrigin));
  };
  const double x = before(u, 1.0) / whole;
  constexpr double kThin = 0.01;
  const double strip = before(u + kThin, 1.0) - before(u - kThin, 1.0);
  const double y = (before(u + kThin, v) - before(u - kThin, v)) / strip;
  const double low_edge = corner[0] + x * (corner[1] - corner[0]);
  const double high_edge = corner[2] + x * (corner[3] - corner[2]);
  return (low_edge + y * (high_edge - low_edge)) * 4.0 / sum / whole;
}

TEST(RectangleCosine, DensityIsBilinearOverTheSquareOfTheSolidAngle) {
  test::TestRandom random;
  for (const Light& light : {above(), tilted(), low(), astride()}) {
    const LightProposal p = proposal(light, LightSampling::Cosine);
    for (int i = 0; i < 200; ++i) {
      const double u = random.uniform(0.02, 0.98);
      const double v = random.uniform(0.02, 0.98);
      const Vec3 d = light.origin + light.edge_u * static_cast<float>(u) +
                     light.edge_v * static_cast<float>(v);
      const double expected = density_by_definition(light, u, v);
      EXPECT_NEAR(double{p.pdf_w(d / d.length())}, expected, 2e-3 * expected) << u << ' ' << v;
    }
  }
}

TEST(RectangleCosine, BlocksHaveTheSameBitsAsSingleDirections) {
  test::TestRandom random;
  const Light light = tilted();
  const LightProposal p = proposal(light, LightSampling::Cosine);
  VectorBlock wi;
  Block<float> pdf{};
  std::size_t met = 0;
  for (std::size_t i = 0; i < kBlock; ++i) {
    wi.set(i, i % 2 == 0 ? random.direction() : p.sample(random.variates())->wi);
  }
  p.pdf_w(wi, kBlock, pdf);
  for (std::size_t i = 0; i < kBlock; ++i) {
    EXPECT_EQ(pdf[i], p.pdf_w(wi[i]));
    met += pdf[i] > 0.0f ? 1u : 0u;
  }
  EXPECT_GE(met, kBlock / 2 - 1);
}

// The standard deviation of cos/pdf, relative to the irradiance.
double irradiance_noise(const Light& light, LightSampling sampling) {
  const LightProposal p = proposal(light, sampling);
  test::TestRandom random;
  test::Moments moments;
  for (int i = 0; i < 50000; ++i) {
    const auto sample = p.sample(random.variates());
    moments.add(std::max(0.0, double{sample->wi.z}) / double{sample->pdf_w});
  }
  return moments.standard_error() * std::sqrt(moments.n()) / moments.mean();
}

// Corners do not tell of a cosine that is largest in the middle, straight above: there the gain is
// small.
TEST(RectangleCosine, TakesNoiseWhereTheRectangleIsSeenObliquely) {
  const auto ratio = [](const Light& light) {
    return irradiance_noise(light, LightSampling::Cosine) /
           irradiance_noise(light, LightSampling::SolidAngle);
  };
  EXPECT_LT(ratio(tilted()), 0.6);
  EXPECT_LT(ratio(low()), 0.6);
  EXPECT_LT(ratio(above()), 1.0);
}

// Negative control of the fit: the density of the square where it is drawn uniformly.
TEST(RectangleCosine, ChiSquareRejectsTheSolidAnglesDensity) {
  const Light light = tilted();
  const LightProposal drawn = proposal(light, LightSampling::Cosine);
  const LightProposal claimed = proposal(light, LightSampling::SolidAngle);
  test::TestRandom random;
  const auto result = test::fit_directions(
      test::SphereGrid::cap({0.5f, 0.1f, 0.2f}, 1.0, 16, 24),
      [&] { return std::optional(drawn.sample(random.variates())->wi); },
      [&](const Vec3& wi) { return double{claimed.pdf_w(wi)}; }, 40000, 16);
  EXPECT_LT(result.p, test::sidak(1e-4, 200));
}

}  // namespace
}  // namespace penumbra
