// How PMC-HI's mixture weights become counts, against the definitions.
//
// Statistical tests compare means with 5 standard errors: each raises a false alarm with
// probability 6e-7, all (about 30 comparisons) with 2e-5. Seeds are fixed.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numeric>

#include "estimators/pmc_hi/adaptation.h"
#include "tests/estimators/many_keys.h"

namespace penumbra::pmc_hi {
namespace {

using Counts = std::vector<int>;

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

}  // namespace
}  // namespace penumbra::pmc_hi
