// The parts of PMC-HI's adaptation, each against its definition: counts, cone, sums of weights.
//
// Statistical tests compare means with 5 standard errors: each raises a false alarm with
// probability 6e-7, all (about 60 comparisons) with 4e-5. Seeds are fixed.

#include "estimators/pmc_hi/adaptation.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numeric>

#include "scenes/core/warp.h"
#include "tests/support/fixtures.h"

namespace penumbra::pmc_hi {
namespace {

using Counts = std::vector<int>;

constexpr double kErrors = 5.0;
constexpr int kKeys = 20'000;

StreamKey key_of(int i) {
  StreamKey key;
  key.seed = 77;
  key.estimate = static_cast<std::uint32_t>(i);
  return key;
}

Counts counts_of(Rounding rounding, const std::vector<double>& alpha, int total, int key = 0) {
  Counts counts(alpha.size(), -1);
  round_counts(rounding, alpha, total, key_of(key), counts);
  return counts;
}

int sum(const Counts& counts) { return std::accumulate(counts.begin(), counts.end(), 0); }

// Weights of 2 to 9 components, some of them 0, sum 1.
rc::Gen<std::vector<double>> weights_gen() {
  return rc::gen::map(
      rc::gen::suchThat(
          rc::gen::resize(9, rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 1000))),
          [](const std::vector<int>& v) {
            return v.size() >= 2 && std::accumulate(v.begin(), v.end(), 0) > 0;
          }),
      [](const std::vector<int>& v) {
        std::vector<double> alpha(v.begin(), v.end());
        normalise(alpha);
        return alpha;
      });
}

RC_GTEST_PROP(RoundCounts, SumToTheTotalAndLeaveOutWeightZero, ()) {
  const std::vector<double> alpha = *weights_gen();
  const int total = *rc::gen::inRange(1, 200);
  const int key = *rc::gen::inRange(0, 1 << 20);
  for (const Rounding rounding :
       {Rounding::LargestRemainder, Rounding::Systematic, Rounding::Multinomial}) {
    const Counts counts = counts_of(rounding, alpha, total, key);
    RC_ASSERT(sum(counts) == total);
    for (std::size_t k = 0; k < alpha.size(); ++k) {
      RC_ASSERT(counts[k] >= 0);
      if (alpha[k] <= 0.0) RC_ASSERT(counts[k] == 0);
    }
  }
}

RC_GTEST_PROP(RoundCounts, SystematicAndLargestRemainderAreWithinOneOfTheProduct, ()) {
  const std::vector<double> alpha = *weights_gen();
  const int total = *rc::gen::inRange(1, 200);
  const int key = *rc::gen::inRange(0, 1 << 20);
  for (const Rounding rounding : {Rounding::LargestRemainder, Rounding::Systematic}) {
    const Counts counts = counts_of(rounding, alpha, total, key);
    for (std::size_t k = 0; k < alpha.size(); ++k) {
      // Cumulative sums round at 1e-13 of the total.
      RC_ASSERT(std::abs(counts[k] - total * alpha[k]) < 1.0 + 1e-9);
    }
  }
}

RC_GTEST_PROP(RoundCounts, LargestRemainderIsANearestPointOfTheCounts, ()) {
  const std::vector<double> alpha = *weights_gen();
  const int total = *rc::gen::inRange(1, 200);
  const Counts counts = counts_of(Rounding::LargestRemainder, alpha, total);
  // Moving one sample from i to j changes the squared distance by 2 (1 - e_i + e_j), e = counts - N
  // alpha.
  for (std::size_t i = 0; i < alpha.size(); ++i) {
    for (std::size_t j = 0; j < alpha.size(); ++j) {
      if (i == j || counts[i] == 0 || alpha[j] <= 0.0) continue;
      RC_ASSERT(1.0 - (counts[i] - total * alpha[i]) + (counts[j] - total * alpha[j]) > -1e-6);
    }
  }
}

// Weights of 17 to 120 components and a last that takes the rest: of few values, so that most are
// equal; one in four is moved by less than what equals may differ by, or little more.
std::vector<double> many_weights(int total) {
  const auto size = *rc::gen::inRange<std::size_t>(17, 120);
  const auto pairs = *rc::gen::container<std::vector<std::pair<int, int>>>(
      size, rc::gen::pair(rc::gen::inRange(0, 4), rc::gen::inRange(0, 40)));
  std::vector<double> alpha;
  double left = 1.0;
  for (const auto& [value, shift] : pairs) {
    const double shifted = shift < 10 ? shift * 4e-10 / total : 0.0;
    alpha.push_back(value == 0 ? 0.0 : value / (4.0 * static_cast<double>(size)) + shifted);
    left -= alpha.back();
  }
  alpha.push_back(left);
  return alpha;
}

RC_GTEST_PROP(RoundCounts, OfManyComponentsAreTheOnesGivenOneByOne, ()) {
  const int total = *rc::gen::inRange(1, 400);
  const std::vector<double> alpha = many_weights(total);
  const int key = *rc::gen::inRange(0, 1 << 20);
  Counts expected(alpha.size());
  give_one_by_one(alpha, total, key_of(key), expected);
  RC_ASSERT(counts_of(Rounding::LargestRemainder, alpha, total, key) == expected);
}

TEST(RoundCounts, OfEqualWeightsAreTheOnesGivenOneByOne) {
  for (const std::size_t m : {17u, 100u, 1001u}) {
    std::vector<double> alpha(m + 1, 1.0 / static_cast<double>(m));
    alpha.back() = 0.0;
    Counts first;
    int different = 0;
    for (int key = 0; key < 50; ++key) {
      const int total = static_cast<int>(m) + static_cast<int>(m) * key / 50;
      Counts expected(alpha.size());
      give_one_by_one(alpha, total, key_of(key), expected);
      const Counts counts = counts_of(Rounding::LargestRemainder, alpha, total, key);
      ASSERT_EQ(counts, expected) << m << " " << total;
      ASSERT_EQ(sum(counts), total);
      // Negative control: the ranks are of the key, so that another key gives other counts.
      different += counts_of(Rounding::LargestRemainder, alpha, total, key + 1000) != counts;
    }
    EXPECT_GT(different, 40) << m;
  }
}

RC_GTEST_PROP(RaiseToMinimum, KeepsTheSumRaisesAllButTheConeAndTakesNoMoreThanNeeded, ()) {
  const std::vector<double> alpha = *weights_gen();
  const int minimum = *rc::gen::inRange(0, 4);
  const int others = static_cast<int>(alpha.size()) - 1;
  const int total = *rc::gen::inRange(std::max(1, minimum * others), 200);
  const Counts before = counts_of(Rounding::LargestRemainder, alpha, total);
  Counts after = before;
  raise_to_minimum(after, minimum);
  RC_ASSERT(sum(after) == total);
  for (int k = 0; k < others; ++k) {
    const auto i = static_cast<std::size_t>(k);
    RC_ASSERT(after[i] >= minimum);
    if (before[i] <= minimum) RC_ASSERT(after[i] == minimum);
  }
  RC_ASSERT(after.back() >= 0);
}

TEST(RaiseToMinimum, TakesFromTheLargestEachTime) {
  Counts counts = {0, 5, 4, 0};
  raise_to_minimum(counts, 2);
  EXPECT_EQ(counts, (Counts{2, 3, 4, 0}));  // from 5, then from the first 4
}

TEST(RaiseToMinimum, TakesFromTheConeBeforeAComponentThatIsAtTheMinimum) {
  Counts counts = {1, 0, 1};
  raise_to_minimum(counts, 1);
  EXPECT_EQ(counts, (Counts{1, 1, 0}));
}

TEST(RaiseToMinimum, TakesFromTheConeButGivesItNothing) {
  Counts counts = {0, 0, 8};
  raise_to_minimum(counts, 1);
  EXPECT_EQ(counts, (Counts{1, 1, 6}));
  counts = {4, 4, 0};
  raise_to_minimum(counts, 1);
  EXPECT_EQ(counts, (Counts{4, 4, 0}));
}

TEST(RoundCounts, LargestRemainderWithoutTiesDoesNotDependOnTheKey) {
  for (int key = 0; key < 100; ++key) {
    // 8 alpha = 3.44, 2.64, 1.92: floors 3, 2, 1; the remainders .92 and .64 win.
    EXPECT_EQ(counts_of(Rounding::LargestRemainder, {0.43, 0.33, 0.24}, 8, key), (Counts{3, 3, 2}));
  }
}

// Mean counts over keys against N alpha, with the standard error from the sample.
void expect_mean_counts(Rounding rounding, const std::vector<double>& alpha, int total) {
  std::vector<double> first(alpha.size()), second(alpha.size());
  for (int i = 0; i < kKeys; ++i) {
    const Counts counts = counts_of(rounding, alpha, total, i);
    for (std::size_t k = 0; k < alpha.size(); ++k) {
      first[k] += counts[k];
      second[k] += counts[k] * counts[k];
    }
  }
  for (std::size_t k = 0; k < alpha.size(); ++k) {
    const double mean = first[k] / kKeys;
    const double variance = std::max(second[k] / kKeys - mean * mean, 0.0);
    EXPECT_NEAR(mean, total * alpha[k], kErrors * std::sqrt(variance / kKeys) + 1e-9)
        << "component " << k << " of " << alpha.size() << ", N = " << total;
  }
}

// The first iteration of pmc_hi: equal weights, cone 0. Each of the equal components has to get the
// extra samples equally often.
TEST(RoundCounts, LargestRemainderBreaksTiesWithoutFavour) {
  const double third = 1.0 / 3.0;
  expect_mean_counts(Rounding::LargestRemainder, {third, third, third, 0.0}, 8);
  expect_mean_counts(Rounding::LargestRemainder, {third, third, third, 0.0}, 7);
  expect_mean_counts(Rounding::LargestRemainder, {0.0, 0.5, 0.0, 0.5, 0.0}, 3);
  expect_mean_counts(Rounding::LargestRemainder, std::vector<double>(7, 1.0 / 7.0), 10);
}

TEST(RoundCounts, SystematicCountsHaveMeanNAlpha) {
  expect_mean_counts(Rounding::Systematic, {0.43, 0.33, 0.04, 0.2}, 8);
  expect_mean_counts(Rounding::Systematic, {0.01, 0.02, 0.97}, 5);
}

TEST(RoundCounts, MultinomialCountsHaveMeanNAlphaAndTheirVariance) {
  const std::vector<double> alpha = {0.43, 0.33, 0.04, 0.2};
  expect_mean_counts(Rounding::Multinomial, alpha, 8);
  double mean = 0.0, square = 0.0;
  for (int i = 0; i < kKeys; ++i) {
    const int n = counts_of(Rounding::Multinomial, alpha, 8, i)[0];
    mean += n;
    square += n * n;
  }
  mean /= kKeys;
  const double variance = 8 * 0.43 * 0.57;
  // The standard error of a variance near normality is var sqrt(2/n).
  EXPECT_NEAR(square / kKeys - mean * mean, variance, kErrors * variance * std::sqrt(2.0 / kKeys));
}

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
