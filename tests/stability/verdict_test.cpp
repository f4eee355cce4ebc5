// The rules of `penumbra stability` on samples made by hand. Seeds follow from the tests' names;
// the false alarms that tests count are bounded by the binomial distribution at 1e-4.

#include "harness/stability/verdict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "tests/support/fixtures.h"

namespace penumbra::stability {
namespace {

constexpr int kSamples = 16384;

class Uniform {
 public:
  explicit Uniform(std::string_view label) : engine_(fixtures::test_seed(label)) {}
  double operator()() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
};

Evidence evidence_of(int count, const std::function<double()>& draw) {
  Evidence evidence;
  for (int i = 0; i < count; ++i) evidence.statistics.add(draw());
  evidence.tolerance = tolerance_of(1);
  return evidence;
}

/// Judged as the only cell of a matrix, with a repetition from the same source.
Judgement judge_alone(int count, const std::function<double()>& draw, bool dark = false) {
  std::vector<Evidence> all{evidence_of(count, draw)};
  all[0].is_dark = dark;
  if (significantly_biased(all, kLevel).empty()) return judge(all[0], nullptr);
  std::vector<Evidence> repeated{evidence_of(kConfirmFactor * count, draw)};
  const bool confirmed = !significantly_biased(repeated, kConfirmLevel).empty();
  return judge(all[0], confirmed ? repeated.data() : nullptr);
}

/// Mean 1, infinite variance for exponents up to 2.
double pareto(Uniform& uniform, double exponent) {
  return (exponent - 1) / exponent * std::pow(1 - uniform(), -1 / exponent);
}

TEST(StabilityVerdict, CalmEstimatesAboutTheAnswerAreOk) {
  Uniform uniform("u");
  const Judgement judgement = judge_alone(kSamples, [&] { return 0.5 + uniform(); });
  EXPECT_EQ(judgement.verdict, Verdict::Ok) << judgement.reason;
}

TEST(StabilityVerdict, ADeviationWithinSinglePrecisionIsOk) {
  EXPECT_EQ(judge_alone(kSamples, [] { return 1 + 1e-6; }).verdict, Verdict::Ok);
  EXPECT_EQ(judge_alone(kSamples, [] { return 1.01; }).verdict, Verdict::Biased);
}

TEST(StabilityVerdict, TwoPercentTooMuchOrTooLittleIsBiased) {
  Uniform uniform("u");
  for (const double factor : {0.98, 1.02}) {
    const Judgement judgement = judge_alone(kSamples, [&] { return factor * (0.5 + uniform()); });
    EXPECT_EQ(judgement.verdict, Verdict::Biased) << factor;
  }
}

TEST(StabilityVerdict, ALostLightIsBiasedAndALostAnswerBreaks) {
  Uniform uniform("u");
  const auto lost = [&](double share) {
    return [&uniform, share] { return (1 - share) * 2 * uniform(); };
  };
  EXPECT_EQ(judge_alone(kSamples, lost(0.5)).verdict, Verdict::Biased);
  EXPECT_EQ(judge_alone(kSamples, lost(0.95)).verdict, Verdict::Breaks);
  EXPECT_EQ(judge_alone(kSamples, lost(-1.5)).verdict, Verdict::Breaks);
}

TEST(StabilityVerdict, LargeVarianceIsNoisy) {
  Uniform uniform("u");
  // 1 in 10 estimates is 10: relative variance 9.
  const Judgement judgement = judge_alone(kSamples, [&] { return uniform() < 0.1 ? 10.0 : 0.0; });
  EXPECT_EQ(judgement.verdict, Verdict::Noisy);
}

TEST(StabilityVerdict, EstimatesThatNeverSeeTheLightAreNoisyAndTheIntervalSaysSo) {
  const Judgement judgement = judge_alone(kSamples, [] { return 0.0; });
  EXPECT_EQ(judgement.verdict, Verdict::Noisy);
  EXPECT_EQ(judgement.reason, "no light in 16384 estimates");
  const Interval interval =
      evidence_of(kSamples, [] { return 0.0; }).statistics.mean_interval(0.95);
  EXPECT_EQ(interval.lo, 0);
  EXPECT_EQ(interval.hi, std::numeric_limits<double>::infinity());
}

TEST(StabilityVerdict, AFewThatCarryAllTheLightAreNoisyThoughTheVarianceLooksSmall) {
  Uniform uniform("u");
  int i = 0;
  // Two of 16384 are 60: less than 1 % of the answer, half of the variance of 0.8.
  const auto draw = [&] { return ++i % 8192 == 77 ? 60.0 : 0.993 * 2 * uniform(); };
  const Evidence evidence = evidence_of(kSamples, draw);
  EXPECT_LT(evidence.statistics.variance(), kNoisyVariance);
  const Judgement judgement = judge(evidence, nullptr);
  EXPECT_EQ(judgement.verdict, Verdict::Noisy);
  EXPECT_NE(judgement.reason.find("few estimates decide"), std::string::npos) << judgement.reason;
}

TEST(StabilityVerdict, BadEstimatesBreak) {
  Evidence evidence = evidence_of(100, [] { return 1.0; });
  EXPECT_EQ(judge(evidence, nullptr).verdict, Verdict::Ok);
  evidence.non_finite = 1;
  EXPECT_EQ(judge(evidence, nullptr).verdict, Verdict::Breaks);
  evidence.non_finite = 0;
  evidence.negative = 1;
  EXPECT_EQ(judge(evidence, nullptr).verdict, Verdict::Breaks);
  evidence.negative = 0;
  evidence.uncovered = 1;
  EXPECT_EQ(judge(evidence, nullptr).verdict, Verdict::Breaks);
  evidence.claims_unbiased = false;
  EXPECT_EQ(judge(evidence, nullptr).verdict, Verdict::Ok);
}

TEST(StabilityVerdict, LightWhereThereIsNoneBreaks) {
  EXPECT_EQ(judge_alone(
                kSamples, [] { return 0.0; }, true)
                .verdict,
            Verdict::Ok);
  int i = 0;
  const auto leak = [&] { return ++i == 77 ? 1e-9 : 0.0; };
  EXPECT_EQ(judge_alone(kSamples, leak, true).verdict, Verdict::Breaks);
}

// Unbiased estimators whose mean comes from rare large estimates: the t test calls many of them
// biased, the test of the suite none.
TEST(StabilityVerdict, HeavyTailsRaiseNoFalseAlarms) {
  constexpr int kTrials = 300;
  constexpr double kTestLevel = 1e-4;
  for (const double exponent : {1.2, 1.5, 2.0}) {
    Uniform uniform("pareto" + std::to_string(exponent));
    int alarms = 0;
    int plain_alarms = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const EstimateStatistics s =
          evidence_of(2000, [&] { return pareto(uniform, exponent); }).statistics;
      alarms += s.test(0).p <= kTestLevel ? 1 : 0;
      const double t = (s.mean() - 1) / std::sqrt(s.variance() / 2000);
      plain_alarms += student_t_two_sided_p(t, 1999) <= kTestLevel ? 1 : 0;
    }
    // Expected at the level: 0.03 in 300.
    EXPECT_LE(alarms, 1) << exponent;
    if (exponent < 2) {
      EXPECT_GE(plain_alarms, 5) << exponent << ": the control has nothing to show";
    }
  }
}

TEST(StabilityVerdict, RareEventsRaiseNoFalseAlarms) {
  // One in `rarity` estimates carries the light; many of them, few or none are among the samples.
  for (const double rarity : {100.0, 2000.0, 16384.0, 1e6}) {
    Uniform uniform("rare" + std::to_string(rarity));
    int alarms = 0;
    for (int trial = 0; trial < 200; ++trial) {
      const EstimateStatistics s =
          evidence_of(4096, [&] { return uniform() * rarity < 1 ? rarity : 0.0; }).statistics;
      alarms += s.test(0).p <= 1e-4 ? 1 : 0;
    }
    EXPECT_LE(alarms, 1) << rarity;
  }
}

TEST(StabilityVerdict, CalmNoiseKeepsTheLevelOfTheTest) {
  Uniform uniform("u");
  int alarms = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const EstimateStatistics s = evidence_of(500, [&] { return 2 * uniform(); }).statistics;
    alarms += s.test(0).p <= 0.05 ? 1 : 0;
  }
  // At most 5 %: 100 expected, binomial standard deviation 9.7.
  EXPECT_LE(alarms, 137);
}

TEST(StabilityVerdict, IntervalsCoverTheAnswer) {
  for (const double exponent : {1.5, 3.0}) {
    Uniform uniform("cover" + std::to_string(exponent));
    int held = 0;
    constexpr int kTrials = 500;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Interval interval = evidence_of(2000, [&] {
                                  return pareto(uniform, exponent);
                                }).statistics.mean_interval(0.95);
      held += interval.lo <= 1 && 1 <= interval.hi ? 1 : 0;
    }
    EXPECT_GE(held, 456) << exponent;  // 95 % less 3.9 binomial standard deviations
  }
}

TEST(StabilityVerdict, HolmCountsAllCellsOfTheMatrix) {
  Uniform uniform("u");
  const auto noise = [&](double mean) {
    return evidence_of(2000, [&uniform, mean] { return mean * (0.5 + uniform()); });
  };
  // 5 %, about 3.7 standard errors together with those of the unseen: enough alone, not among a
  // thousand.
  const Evidence slight = noise(0.95);
  std::vector<Evidence> few{slight};
  EXPECT_EQ(significantly_biased(few, kLevel).size(), 1u);
  std::vector<Evidence> many(1000, noise(1));
  many.push_back(slight);
  EXPECT_TRUE(significantly_biased(many, kLevel).empty());
}

TEST(EstimateStatistics, MomentsAreThoseOfTheDefinition) {
  const std::vector<double> values{0, 0.5, 1, 1, 1.5, 2, 7, 0.25};
  EstimateStatistics s;
  for (const double v : values) s.add(v);
  const auto n = static_cast<double>(values.size());
  double mean = 0, m2 = 0, m4 = 0, square = 0;
  for (const double v : values) mean += v / n;
  for (const double v : values) {
    m2 += std::pow(v - mean, 2) / n;
    m4 += std::pow(v - mean, 4) / n;
    square += std::pow(v - 1, 2) / n;
  }
  EXPECT_NEAR(s.mean(), mean, 1e-14);
  EXPECT_NEAR(s.variance(), m2 * n / (n - 1), 1e-13);
  EXPECT_NEAR(s.kurtosis().value(), m4 / (m2 * m2), 1e-12);
  EXPECT_NEAR(s.mean_square_error(), square, 1e-13);
  EXPECT_EQ(s.largest(), 7);
  EXPECT_EQ(s.zeros(), 1u);
}

TEST(EstimateStatistics, SlopeOfErrorsIsTheExponentOfTheirLaw) {
  for (const double exponent : {-1.0, -2.0, 0.0}) {
    std::vector<SlopePoint> points;
    for (const double samples : {16.0, 64.0, 256.0}) {
      const double error = 3 * std::pow(samples, exponent);
      points.push_back({samples, error, 0.05 * error});
    }
    const auto slope = fit_error_slope(points.data(), points.size(), 0.95);
    ASSERT_TRUE(slope);
    EXPECT_NEAR(slope->value, exponent, 1e-12);
    // Three points two factors of 4 apart: sd of log samples x sqrt(3) = 1.96.
    const double half = 1.96 * 0.05 / (std::log(4.0) * std::sqrt(2.0));
    EXPECT_NEAR(slope->interval.hi - exponent, half, 1e-3 * half);
  }
  const std::vector<SlopePoint> exact{{16, 0, 0}, {64, 0, 0}};
  EXPECT_FALSE(fit_error_slope(exact.data(), exact.size(), 0.95));
}

}  // namespace
}  // namespace penumbra::stability
