// Stopping by the clock biases an estimate where cost and value of a sample go together: a sample
// that is in shadow is cheap and 0. Stopping after a number of samples fixed beforehand, as every
// estimator and every curve here does, does not. A simulation of both.
//
// Sample: with probability 1/2 in shadow, value 0 and cost 1/2; else value 2, cost 3/2. Means 1.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

constexpr int kTrials = 200'000;
// Of about 12 comparisons together 1e-4.
const double kBound = test::z_bound(test::sidak(1e-4, 12));

struct Draw {
  double value;
  double cost;
};

Draw draw(test::TestRandom& random) {
  const bool lit = random.uniform() < 0.5;
  return {lit ? 2.0 : 0.0, lit ? 1.5 : 0.5};
}

// Mean of all samples begun before the budget ran out: the one at hand is finished.
double until_the_clock_stops(test::TestRandom& random, double budget) {
  double sum = 0.0;
  int n = 0;
  for (double time = 0.0; time < budget; ++n) {
    const Draw d = draw(random);
    sum += d.value;
    time += d.cost;
  }
  return sum / n;
}

// Mean of the samples that were complete in time, at least one. Source: Glynn and Heidelberger
// 1990, "Bias properties of budget constrained simulations".
double complete_in_time(test::TestRandom& random, double budget) {
  const Draw first = draw(random);
  double sum = first.value;
  int n = 1;
  for (double time = first.cost;; ++n) {
    const Draw d = draw(random);
    time += d.cost;
    if (time > budget) return sum / n;
    sum += d.value;
  }
}

double fixed_number(test::TestRandom& random, int n) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += draw(random).value;
  return sum / n;
}

// Stops when the estimated standard error falls below a share of the mean.
double until_precise(test::TestRandom& random, double tolerance) {
  double mean = 0.0;
  double squares = 0.0;
  for (int n = 1;; ++n) {
    // Skewed values of mean 1, nearly log-normal: exp of twelve uniforms, E[exp(u - 1/2)] =
    // 2 sinh(1/2).
    double x = -6.0;
    for (int i = 0; i < 12; ++i) x += random.uniform();
    x = std::exp(x) / std::pow(2.0 * std::sinh(0.5), 12);
    const double step = x - mean;
    mean += step / n;
    squares += step * (x - mean);
    if (n >= 5 && std::sqrt(squares / (n - 1.0) / n) < tolerance * mean) return mean;
  }
}

template <typename Estimate>
test::Moments run(Estimate estimate, int trials = kTrials) {
  test::TestRandom random;
  test::Moments moments;
  for (int i = 0; i < trials; ++i) moments.add(estimate(random));
  return moments;
}

TEST(StoppingTime, FinishingTheSampleAtHandWhenTheClockStopsIsBiasedByOneOverTheBudget) {
  double before = 0.0;
  for (const double budget : {2.2, 9.2, 36.2}) {
    const auto moments =
        run([&](test::TestRandom& random) { return until_the_clock_stops(random, budget); });
    EXPECT_GT(moments.z(1.0), kBound) << budget;
    const double bias = moments.mean() - 1.0;
    EXPECT_GT(bias, 0.0) << "lit samples take longer, so that the last one is lit more often";
    if (before > 0.0) {
      EXPECT_NEAR(before / bias, 4.0, 2.5) << budget;
    }
    before = bias;
  }
}

TEST(StoppingTime, StoppingWhenTheErrorLooksSmallIsBiasedDownwards) {
  for (const double tolerance : {0.3, 0.1}) {
    const auto moments =
        run([&](test::TestRandom& random) { return until_precise(random, tolerance); }, 20'000);
    EXPECT_LT(moments.mean(), 1.0);
    EXPECT_GT(moments.z(1.0), kBound) << tolerance << ": " << moments.mean();
  }
}

TEST(StoppingTime, SamplesFixedBeforehandHaveNoBias) {
  for (const int n : {2, 9, 36}) {
    const auto moments = run([&](test::TestRandom& random) { return fixed_number(random, n); });
    EXPECT_LT(moments.z(1.0), kBound) << n << ": " << moments.mean();
  }
}

TEST(StoppingTime, SamplesCompleteInTimeWithAtLeastOneHaveNoBias) {
  for (const double budget : {2.2, 9.2}) {
    const auto moments =
        run([&](test::TestRandom& random) { return complete_in_time(random, budget); });
    EXPECT_LT(moments.z(1.0), kBound) << budget << ": " << moments.mean();
  }
}

}  // namespace
}  // namespace penumbra
