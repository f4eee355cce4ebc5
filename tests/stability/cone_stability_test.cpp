// Cones from half a turn to 1e-7 rad, and the cone that is fitted to directions: each check is one
// that the same formula in terms of the cosine fails.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "estimators/pmc_hi/adaptation.h"
#include "scenes/core/frame.h"
#include "scenes/core/warp.h"
#include "tests/support/fixtures.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using Real = long double;

constexpr double kTolerance = 1e-5;
const float kHalfAngles[] = {1.5707963f, 1.0f,  0.3f,  0.1f,  3e-2f, 1e-2f, 3e-3f,
                             1e-3f,      4e-4f, 1e-4f, 1e-5f, 1e-6f, 1e-7f};

double exact_solid_angle(float half_angle) {
  const Real s = std::sin(0.5L * static_cast<Real>(half_angle));
  return static_cast<double>(4.0L * std::numbers::pi_v<Real> * s * s);
}

bool agrees(double value, double exact) {
  return std::abs(value - exact) <= kTolerance * std::abs(exact);
}

// A direction of the cone about +z at a share of its half angle, and its membership.
Vec3 at_share(float half_angle, double share, double phi) {
  const double angle = share * static_cast<double>(half_angle);
  return Vec3(
      Vec3d(std::sin(angle) * std::cos(phi), std::sin(angle) * std::sin(phi), std::cos(angle)));
}

TEST(NarrowCone, InverseDensityIsItsSolidAngleAndThatOfTheCosineIsNot) {
  int naive_failures = 0;
  for (const float b : kHalfAngles) {
    const double exact = exact_solid_angle(b);
    EXPECT_TRUE(agrees(1.0 / double{uniform_cone_pdf_w(one_minus_cos_of(b))}, exact)) << b;
    naive_failures += agrees(double{2.0f * kPi * (1.0f - std::cos(b))}, exact) ? 0 : 1;
  }
  EXPECT_GE(naive_failures, 7) << "negative control";
}

// Density times solid angle, ring by ring, of the directions that the cone says it contains.
TEST(NarrowCone, DensityIntegratesToOne) {
  int naive_failures = 0;
  for (const float b : kHalfAngles) {
    if (b > 1.5f) continue;  // the rings below go beyond the horizon
    const Cone cone{{0, 0, 1}, one_minus_cos_of(b)};
    constexpr int kRings = 200;
    double sum = 0.0;
    double naive_sum = 0.0;
    for (int i = 0; i < 2 * kRings; ++i) {
      const double share = std::sqrt((i + 0.5) / kRings);
      const Vec3 w = at_share(b, share, 2.39996 * i);
      const double lower = std::sqrt(static_cast<double>(i) / kRings) * double{b};
      const double upper = std::sqrt((i + 1.0) / kRings) * double{b};
      const double ring = 4.0 * std::numbers::pi * std::sin(0.5 * (upper + lower)) *
                          std::sin(0.5 * (upper - lower));
      sum += double{cone.pdf_w(w)} * ring;
      naive_sum += w.z >= std::cos(b) ? ring / exact_solid_angle(b) : 0.0;
    }
    // A ring at the border may count for its neighbour's share.
    EXPECT_NEAR(sum, 1.0, 1.5 / kRings) << b;
    naive_failures += std::abs(naive_sum - 1.0) > 1.5 / kRings ? 1 : 0;
  }
  EXPECT_GE(naive_failures, 3) << "negative control";
}

TEST(NarrowCone, SamplesAreMembersAndSpreadOverTheWholeCone) {
  test::TestRandom random;
  int naive_collapses = 0;
  for (const float b : kHalfAngles) {
    const float depth = one_minus_cos_of(b);
    const Cone cone{{0, 0, 1}, depth};
    // A quarter of the directions lies within half of the chord.
    int inner = 0;
    int naive_inner = 0;
    constexpr int kDraws = 40000;
    for (int i = 0; i < kDraws; ++i) {
      const Vec2 u = random.variates().u;
      const Vec3 w = sample_uniform_cone(u, depth);
      ASSERT_LE(double{(w - cone.axis).length2()}, 2.0 * double{depth} * (1.0 + 1e-6)) << b;
      inner += (w - cone.axis).length2() <= 0.5f * depth ? 1 : 0;
      const float z = 1.0f - u.x * (1.0f - std::cos(b));
      const float sine = std::sqrt(std::max(0.0f, 1.0f - z * z));
      naive_inner += sine * sine + (1.0f - z) * (1.0f - z) <= 0.5f * depth ? 1 : 0;
    }
    // 5 standard deviations.
    const double tolerance = 5.0 * std::sqrt(0.25 * 0.75 / kDraws);
    EXPECT_NEAR(inner / static_cast<double>(kDraws), 0.25, tolerance) << b;
    const double naive_share = naive_inner / static_cast<double>(kDraws);
    naive_collapses += std::abs(naive_share - 0.25) > tolerance ? 1 : 0;
  }
  EXPECT_GE(naive_collapses, 4) << "negative control";
}

TEST(NarrowCone, MembershipIsRightUpToItsBorder) {
  int naive_failures = 0;
  for (const float b : kHalfAngles) {
    const Cone cone{{0, 0, 1}, one_minus_cos_of(b)};
    int wrong = 0;
    int naive_wrong = 0;
    for (int i = 0; i < 1000; ++i) {
      for (const double share : {0.9, 0.99, 1.01, 1.1}) {
        const Vec3 w = at_share(b, share, 2.39996 * i);
        wrong += (cone.pdf_w(w) > 0.0f) != (share < 1.0) ? 1 : 0;
        naive_wrong += (w.z >= std::cos(b)) != (share < 1.0) ? 1 : 0;
      }
    }
    EXPECT_EQ(wrong, 0) << b;
    naive_failures += naive_wrong > 0 ? 1 : 0;
  }
  EXPECT_GE(naive_failures, 4) << "negative control";
}

// About any axis, directions are known to 1e-7: memberships are right where the border is farther
// away than that.
TEST(NarrowCone, SamplesAboutAnyAxisAreMembersAsFarAsDirectionsGo) {
  test::TestRandom random;
  for (const float b : kHalfAngles) {
    if (b < 1e-6f) continue;
    int outside = 0;
    constexpr int kDraws = 20000;
    for (int i = 0; i < kDraws; ++i) {
      const Vec3 axis = i == 0 ? Vec3(0, 0, -1) : random.direction().normalized();
      const Cone cone{axis, one_minus_cos_of(b)};
      const Vec3 local = sample_uniform_cone(random.variates().u, cone.one_minus_cos);
      outside += cone.pdf_w(Frame(axis).to_world(local).normalized()) > 0.0f ? 0 : 1;
    }
    // The ring of width 1.5e-7 inside the border is 3e-7/b of the cone.
    EXPECT_LE(outside / static_cast<double>(kDraws), 3e-7 / double{b} + 5e-4) << b;
  }
}

// A point inside a luminous sphere, where every direction above the horizon is kept.
class FittedCone : public ::testing::Test {
 protected:
  FittedCone() {
    SceneDescription description;
    description.materials = {fixtures::lambert("white", 1.0)};
    description.shapes = {
        {"sky", 0, SphereShape{{0, 0, 0}, 1.0}, EmissionDescription{Rgb(1.0f), true}}};
    scene_ = std::make_unique<Scene>(description);
    mixture_ = std::make_unique<Mixture>(*scene_, LightSampling::Area, false, kSamples);
    mixture_->set_up(fixtures::place(*scene_, Vec3d(0.0), {0, 0, 1}, {0, 0, 1}, 0));
  }

  void draw(const Vec3& axis, float half_angle, int count) {
    mixture_->cone() = {axis.normalized(), one_minus_cos_of(half_angle)};
    const int counts[3] = {0, 0, count};
    StreamKey key;
    key.seed = 5;
    key.estimate = static_cast<std::uint32_t>(mixture_->size());
    mixture_->draw(SamplerKind::Independent, key, counts);
  }

  // 1 - Rbar of equal weights as 1 minus the length of the mean vector.
  double naive_depth() const {
    Vec3d sum(0.0);
    for (std::size_t i = 0; i < mixture_->size(); ++i) sum += Vec3d(mixture_->wi(i));
    return 1.0 - sum.length() / static_cast<double>(mixture_->size());
  }

  static constexpr int kSamples = 4096;
  std::unique_ptr<Scene> scene_;
  std::unique_ptr<Mixture> mixture_;
};

// 1 - cos uniform in [0, h]: the mean is h/2, so the chord rule gives sqrt(h) = b/sqrt 2.
TEST_F(FittedCone, HasTheAngleOfItsDirectionsDownTo1eMinus5) {
  using pmc_hi::BetaRule;
  int naive_failures = 0;
  for (const float b : {0.1f, 1e-2f, 1e-3f, 1e-4f, 1e-5f}) {
    mixture_->clear_samples();
    draw({0.3f, -0.2f, 1.0f}, b, kSamples);
    ASSERT_EQ(mixture_->size(), static_cast<std::size_t>(kSamples));
    const std::vector<double> weights(kSamples, 1.0);
    for (const BetaRule rule : {BetaRule::RmsAngle, BetaRule::Chord, BetaRule::SphericalStd,
                                BetaRule::PerAxisStd, BetaRule::CircularStd, BetaRule::MeanAngle}) {
      const Cone cone =
          pmc_hi::fit_cone(*mixture_, 0, weights, {.rule = rule, .scale = 1.0, .min = 1e-9});
      const double expected =
          double{b} * (rule == BetaRule::PerAxisStd ? 0.5 : std::numbers::sqrt2 / 2.0);
      // Of 4096 angles the RMS has a standard error of 0.5 %; the float axis is off by 1e-7.
      EXPECT_NEAR(cone.half_angle() / expected, 1.0, 0.03) << b << " " << static_cast<int>(rule);
    }
    const double naive = std::sqrt(2.0 * std::max(0.0, naive_depth()));
    naive_failures += std::abs(naive / (double{b} / std::numbers::sqrt2) - 1.0) > 0.03 ? 1 : 0;
  }
  EXPECT_GE(naive_failures, 2) << "negative control";
}

TEST_F(FittedCone, WeightsOver40OrdersOfMagnitudeGiveTheSameCone) {
  draw({0.3f, -0.2f, 1.0f}, 0.2f, 64);
  std::vector<double> weights(64);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weights[i] = std::pow(10.0, -20.0 + 40.0 * static_cast<double>(i) / 63.0);
  }
  const Cone cone = pmc_hi::fit_cone(*mixture_, 0, weights, {});
  ASSERT_TRUE(cone.active());
  // The brightest direction, with a share of 1 - 10^(-40/63), rules.
  EXPECT_GT(dot(cone.axis, mixture_->wi(63)), 0.99f);
  for (const int power : {-300, -66, 66, 300}) {
    std::vector<double> scaled = weights;
    for (double& w : scaled) w *= std::ldexp(1.0, power);
    const Cone other = pmc_hi::fit_cone(*mixture_, 0, scaled, {});
    EXPECT_EQ(other.axis, cone.axis) << power;
    EXPECT_EQ(other.one_minus_cos, cone.one_minus_cos) << power;
  }
  // Sums of weights in float: negative control.
  float sum = 0.0f;
  for (const double w : weights) sum += static_cast<float>(w * 1e20);
  EXPECT_FALSE(std::isfinite(sum));
}

TEST_F(FittedCone, OppositeDirectionsHaveNoneWhereTheNaiveMeanIsAnyDirection) {
  draw({1.0f, 0.0f, 1e-4f}, 1e-6f, 1);
  draw({-1.0f, 0.0f, 1e-4f}, 1e-6f, 1);
  ASSERT_EQ(mixture_->size(), 2u);
  EXPECT_FALSE(pmc_hi::fit_cone(*mixture_, 0, std::vector<double>(2, 1.0), {}).active());
  const Vec3 sum = mixture_->wi(0) + mixture_->wi(1);
  EXPECT_NEAR(sum.normalized().length(), 1.0f, 1e-5f) << "a direction like any other";
  EXPECT_LT(sum.length(), 1e-3f);
}

}  // namespace
}  // namespace penumbra
