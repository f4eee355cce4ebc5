// The parts of PMC-HI's adaptation, each against its definition: cone, sums of weights.
//
// Statistical tests compare means with 5 standard errors: each raises a false alarm with
// probability 6e-7, all (about 30 comparisons) with 2e-5. Seeds are fixed.

#include "estimators/pmc_hi/adaptation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "scenes/core/warp.h"
#include "tests/estimators/many_keys.h"
#include "tests/support/fixtures.h"

namespace penumbra::pmc_hi {
namespace {

TEST(Normalise, ScalesToSumOneAndRefusesASumOfZero) {
  std::vector<double> values = {1.0, 3.0, 0.0};
  EXPECT_TRUE(normalise(values));
  EXPECT_EQ(values, (std::vector<double>{0.25, 0.75, 0.0}));
  values = {0.0, 0.0};
  EXPECT_FALSE(normalise(values));
  EXPECT_EQ(values, (std::vector<double>{0.0, 0.0}));
  values = {std::nan(""), 1.0};
  EXPECT_FALSE(normalise(values));
}

// A point inside a two-sided luminous sphere: every direction above the horizon meets the light and
// is kept.
class ConeFit : public ::testing::Test {
 protected:
  ConeFit() {
    SceneDescription description;
    description.materials = {fixtures::lambert("white", 1.0)};
    ShapeDescription sky{"sky", 0, SphereShape{{0, 0, 0}, 1.0},
                         EmissionDescription{Rgb(1.0f), true}};
    description.shapes = {sky};
    scene_ = std::make_unique<Scene>(description);
    mixture_ = std::make_unique<Mixture>(*scene_, LightSampling::Area, false, kSamples);
    mixture_->set_up(fixtures::place(*scene_, Vec3d(0.0), {0, 0, 1}, {0, 0, 1}, 0));
  }

  /// Appends directions uniform in a cone to the samples; the mixture's cone is left in place.
  void draw_cone(const Vec3& axis, double half_angle, int count) {
    mixture_->cone() = {axis.normalized(), one_minus_cos_of(static_cast<float>(half_angle))};
    const int counts[3] = {0, 0, count};
    StreamKey key = key_of(static_cast<int>(mixture_->size()));
    mixture_->draw(SamplerKind::Independent, key, counts);
  }

  double fitted_angle(const ConeRules& rules, const std::vector<double>& weights) const {
    const Cone cone = fit_cone(*mixture_, 0, weights, rules);
    return 2.0 * std::asin(std::sqrt(0.5 * static_cast<double>(cone.one_minus_cos)));
  }

  static constexpr std::size_t kSamples = 1 << 16;
  std::unique_ptr<Scene> scene_;
  std::unique_ptr<Mixture> mixture_;
};

constexpr BetaRule kRules[] = {BetaRule::RmsAngle,   BetaRule::Chord,       BetaRule::SphericalStd,
                               BetaRule::PerAxisStd, BetaRule::CircularStd, BetaRule::MeanAngle};

// For 1 - cos uniform in [0, h], h = 1 - cos b: E[1 - cos] = h/2 and theta^2 = 2 (1 - cos) +
// O(theta^4), so the RMS angle is b/sqrt 2 and every rule is that times its constant, to a relative
// O(b^2). The axis is fitted, too, which changes the mean square by 1/n.
TEST_F(ConeFit, UniformDiscGivesEveryRulesConstantTimesTheRmsAngle) {
  constexpr double b = 0.1;
  draw_cone({0.3f, -0.2f, 1.0f}, b, kSamples);
  ASSERT_EQ(mixture_->size(), kSamples);
  const std::vector<double> weights(kSamples, 2.5);
  // 1 - cos has relative standard deviation 1/sqrt 3 of its mean; the angle half of that.
  const double error = 0.5 / std::sqrt(3.0 * static_cast<double>(kSamples));
  for (const BetaRule rule : kRules) {
    const double constant = rule == BetaRule::PerAxisStd ? 0.5 : std::sqrt(0.5);
    EXPECT_NEAR(fitted_angle({.rule = rule}, weights) / (b * constant), 1.0,
                kErrors * error + b * b)
        << static_cast<int>(rule);
  }
  const Cone cone = fit_cone(*mixture_, 0, weights, {});
  EXPECT_LT((cone.axis - Vec3(0.3f, -0.2f, 1.0f).normalized()).length(), 5.0 * b / 256.0);
}

TEST_F(ConeFit, RulesAgreeToThirdOrderInTheAngle) {
  const std::vector<double> weights(1000, 1.0);
  std::vector<double> deviations;
  for (const double b : {0.4, 0.2, 0.1}) {
    mixture_->clear_samples();
    draw_cone({0.0f, 0.0f, 1.0f}, b, 1000);
    const double rms = fitted_angle({}, weights);
    double worst = 0.0;
    for (const BetaRule rule : kRules) {
      const double scale = rule == BetaRule::PerAxisStd ? std::sqrt(2.0) : 1.0;
      worst =
          std::max(worst, std::abs(fitted_angle({.rule = rule, .scale = scale}, weights) - rms));
    }
    EXPECT_LT(worst, 0.5 * rms * rms * rms) << b;
    deviations.push_back(worst);
  }
  // Halving the angle divides a cubic deviation by 8.
  EXPECT_LT(deviations[1], deviations[0] / 6.0);
  EXPECT_LT(deviations[2], deviations[1] / 6.0);
}

// Two directions with weights 1 and 3, the rest 0, against the formulas in double.
TEST_F(ConeFit, IsTheWeightedMeanDirectionAndItsDeviation) {
  draw_cone({0.0f, 0.5f, 1.0f}, 0.5, 20);
  std::vector<double> weights(20, 0.0);
  weights[4] = 1e-30;
  weights[11] = 3e-30;
  const Vec3d a(mixture_->wi(4)), b(mixture_->wi(11));
  const Vec3d s = (a + b * 3.0) / 4.0;
  const double r = s.length();
  const double to_a = std::acos(s.dot(a) / r), to_b = std::acos(s.dot(b) / r);
  const double expected[] = {std::sqrt((to_a * to_a + 3.0 * to_b * to_b) / 4.0),
                             std::sqrt(2.0 - 2.0 * r),
                             std::sqrt(1.0 - r * r),
                             std::sqrt(0.5 - 0.5 * r * r),
                             std::sqrt(-2.0 * std::log(r)),
                             std::acos(r)};
  for (std::size_t i = 0; i < 6; ++i) {
    // Directions are unit to 1e-7, which 1 - r magnifies.
    EXPECT_NEAR(fitted_angle({.rule = kRules[i]}, weights) / expected[i], 1.0, 2e-5) << i;
  }
  const Cone cone = fit_cone(*mixture_, 0, weights, {});
  EXPECT_LT((Vec3d(cone.axis) - s / r).length(), 1e-6);
}

TEST_F(ConeFit, OppositeDirectionsGiveNoCone) {
  draw_cone({1.0f, 0.0f, 1e-4f}, 1e-5, 4);
  draw_cone({-1.0f, 0.0f, 1e-4f}, 1e-5, 4);
  ASSERT_EQ(mixture_->size(), 8u);
  EXPECT_FALSE(fit_cone(*mixture_, 0, std::vector<double>(8, 1.0), {}).active());
}

TEST_F(ConeFit, NoWeightGivesNoCone) {
  draw_cone({0.0f, 0.0f, 1.0f}, 0.1, 4);
  EXPECT_FALSE(fit_cone(*mixture_, 0, std::vector<double>(4, 0.0), {}).active());
}

TEST_F(ConeFit, HalfAngleIsHeldBetweenItsLimits) {
  draw_cone({0.0f, 0.0f, 1.0f}, 0.3, 100);
  std::vector<double> weights(100, 1.0);
  EXPECT_NEAR(fitted_angle({.max = 0.05}, weights), 0.05, 1e-6);
  EXPECT_NEAR(fitted_angle({.min = 0.7}, weights), 0.7, 1e-6);
  std::fill(weights.begin() + 1, weights.end(), 0.0);  // one direction: angle 0
  EXPECT_NEAR(fitted_angle({}, weights), 0.02, 1e-6);
  EXPECT_NEAR(fitted_angle({.min = 1e-3}, weights), 1e-3, 1e-8);
}

TEST_F(ConeFit, ScaleMultipliesTheHalfAngle) {
  draw_cone({0.0f, 0.0f, 1.0f}, 0.3, 100);
  const std::vector<double> weights(100, 1.0);
  const double angle = fitted_angle({}, weights);
  EXPECT_NEAR(fitted_angle({.scale = 2.0}, weights), 2.0 * angle, 1e-6);
}

// With counts n_k = N c_k, E[sum of the weights drawn by k] = n_k int h_k f/K = E[sum of all
// weights times rho_k].
TEST(AdaptationSums, TagAndPosteriorFormsHaveTheSameExpectation) {
  const fixtures::PlacedPoint placed = fixtures::build(fixtures::fixture('F'));
  Mixture mixture(*placed.scene, LightSampling::Area, false, 32);
  const std::vector<int> counts = {4, 4, 8, 0};
  const std::vector<double> coefficients = {0.25, 0.25, 0.5, 0.0};
  std::vector<double> mean(4), square(4), tag_mean(4);
  for (int i = 0; i < kKeys; ++i) {
    mixture.set_up(placed.point);
    ASSERT_GT(mixture.active_lights(), 0);
    mixture.draw(SamplerKind::Independent, key_of(i), counts);
    std::vector<double> weights(mixture.size());
    std::vector<double> density(mixture.size() + kLaneGroup);
    mixture.mixture_pdfs_w(0, coefficients, density);
    for (std::size_t j = 0; j < weights.size(); ++j) {
      weights[j] = luminance(widen(mixture.f(j))) / density[j];
    }
    std::vector<double> tag(4), posterior(4);
    add_tag_sums(mixture, 0, weights, tag);
    add_posterior_sums(mixture, 0, weights, coefficients, posterior);
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    ASSERT_NEAR(std::accumulate(tag.begin(), tag.end(), 0.0), total, 1e-12 * total);
    ASSERT_NEAR(std::accumulate(posterior.begin(), posterior.end(), 0.0), total, 1e-12 * total);
    for (std::size_t k = 0; k < 4; ++k) {
      const double difference = tag[k] - posterior[k];
      tag_mean[k] += tag[k];
      mean[k] += difference;
      square[k] += difference * difference;
    }
  }
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_GT(tag_mean[k], 0.0) << k;
    // Both forms are noisy: a difference within 5 standard errors and those below 2 % of the sum.
    EXPECT_LT(std::abs(mean[k]), kErrors * std::sqrt(square[k])) << k;
    EXPECT_LT(kErrors * std::sqrt(square[k]), 0.1 * tag_mean[k]) << k;
  }
  EXPECT_EQ(tag_mean[3], 0.0);
}

}  // namespace
}  // namespace penumbra::pmc_hi
