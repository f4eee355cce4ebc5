#include "scenes/core/distribution.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

// All p-values of this file together (fewer than 40) raise a false alarm with probability 1e-4.
const double kLevel = test::sidak(1e-4, 40);
constexpr int kDraws = 200000;

std::vector<double> random_weights(test::TestRandom& random, std::size_t n) {
  std::vector<double> weights(n);
  for (double& w : weights) w = random.uniform() < 0.2 ? 0.0 : std::exp(random.uniform(-3.0, 3.0));
  weights[n / 2] = 1.0;
  return weights;
}

// Variates at and next to every border of a cumulative distribution.
std::vector<float> border_variates(const std::vector<double>& weights) {
  std::vector<float> result = {0.0f, 0x1p-32f, 1.0f - 0x1p-24f};
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  double sum = 0.0;
  for (const double w : weights) {
    sum += w;
    const auto border = static_cast<float>(sum / total);
    for (const float u : {std::nextafter(border, 0.0f), border, std::nextafter(border, 1.0f)}) {
      if (u < 1.0f) result.push_back(u);
    }
  }
  return result;
}

TEST(DiscreteDistribution, SamplesMatchPmfByChiSquare) {
  test::TestRandom random;
  for (const std::size_t n : {1u, 2u, 3u, 17u, 100u}) {
    const std::vector<double> weights = random_weights(random, n);
    const DiscreteDistribution distribution(weights);
    std::vector<double> counts(n, 0.0);
    std::vector<double> expected(n);
    for (int i = 0; i < kDraws; ++i) counts[distribution.sample(random.unit_float()).index] += 1.0;
    for (std::uint32_t i = 0; i < n; ++i) expected[i] = distribution.pmf(i) * kDraws;
    EXPECT_GT(test::chi_square_p(counts, expected), kLevel) << n;
  }
}

TEST(DiscreteDistribution, ChiSquareRejectsAWrongPmf) {  // negative control
  test::TestRandom random;
  const DiscreteDistribution distribution(std::vector<double>{1.0, 2.0, 3.0});
  std::vector<double> counts(3, 0.0);
  for (int i = 0; i < kDraws; ++i) counts[distribution.sample(random.unit_float()).index] += 1.0;
  const std::vector<double> expected = {kDraws / 6.0 * 1.05, kDraws / 3.0, kDraws / 2.0 * 0.98};
  EXPECT_LT(test::chi_square_p(counts, expected), kLevel);
}

TEST(DiscreteDistribution, PmfIsTheShareOfTheWeightAndSumsTo1) {
  test::TestRandom random;
  for (const std::size_t n : {1u, 5u, 1000u}) {
    const std::vector<double> weights = random_weights(random, n);
    const DiscreteDistribution distribution(weights);
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    double sum = 0.0;
    for (std::uint32_t i = 0; i < n; ++i) {
      EXPECT_NEAR(distribution.pmf(i), weights[i] / total, 1e-15);
      sum += distribution.pmf(i);
    }
    EXPECT_NEAR(sum, 1.0, 1e-14);
    EXPECT_DOUBLE_EQ(distribution.total_weight(), total);
    EXPECT_EQ(distribution.size(), n);
  }
}

TEST(DiscreteDistribution, ZeroEntriesAreNeverChosenEvenAtTheBorders) {
  const std::vector<std::vector<double>> cases = {{0, 0, 1, 0, 2, 0, 0, 3, 0, 0},
                                                  {0, 1e-30, 0, 1, 0},
                                                  {1, 0},
                                                  {0, 1},
                                                  {0, 0.1, 0, 0.2, 0, 0.7, 0}};
  for (const auto& weights : cases) {
    const DiscreteDistribution distribution(weights);
    for (const float u : border_variates(weights)) {
      const auto choice = distribution.sample(u);
      ASSERT_LT(choice.index, weights.size());
      EXPECT_GT(weights[choice.index], 0.0) << "u=" << u;
      EXPECT_EQ(choice.pmf, distribution.pmf(choice.index));
      EXPECT_TRUE(choice.remapped_u >= 0.0f && choice.remapped_u < 1.0f) << "u=" << u;
    }
  }
}

TEST(DiscreteDistribution, RemappedVariateIsUniformGivenTheChoice) {
  test::TestRandom random;
  const DiscreteDistribution distribution(std::vector<double>{1.0, 5.0, 0.0, 2.0});
  std::vector<double> counts(4 * 16, 0.0);
  std::vector<double> expected(4 * 16);
  for (int i = 0; i < kDraws; ++i) {
    const auto choice = distribution.sample(random.unit_float());
    counts[choice.index * 16 + static_cast<std::size_t>(choice.remapped_u * 16.0f)] += 1.0;
  }
  for (std::uint32_t i = 0; i < 64; ++i) expected[i] = distribution.pmf(i / 16) * kDraws / 16;
  EXPECT_GT(test::chi_square_p(counts, expected), kLevel);
}

TEST(DiscreteDistribution, OneDominatingWeightLeavesTheOthersTheirShare) {
  std::vector<double> weights(5000, 1.0);
  weights[1234] = 1e8;
  const DiscreteDistribution distribution(weights);
  const double total = 1e8 + 4999.0;
  EXPECT_NEAR(distribution.pmf(1234), 1e8 / total, 1e-15);
  // Differences of sums near 1 keep 1e-16 of 1e-8.
  for (const std::uint32_t i : {0u, 1233u, 1235u, 4999u}) {
    EXPECT_NEAR(distribution.pmf(i) * total, 1.0, 1e-7) << i;
  }
  // Groups of entries that are wider than the grid of the variates get their share of all 2^24
  // variates.
  std::uint32_t before = 0;
  std::uint32_t after = 0;
  constexpr std::uint32_t kAll = 1u << 24;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    before += distribution.sample(static_cast<float>(i) * 0x1p-24f).index < 1234 ? 1 : 0;
    after += distribution.sample(static_cast<float>(kAll - 1 - i) * 0x1p-24f).index > 1234 ? 1 : 0;
  }
  EXPECT_NEAR(before, 1234.0 / total * kAll, 1.0);
  EXPECT_NEAR(after, 3765.0 / total * kAll, 1.0);
}

TEST(DiscreteDistributionDeathTest, RefusesWeightsWithoutASum) {
  EXPECT_DEATH(DiscreteDistribution(std::vector<double>{0.0, 0.0}), "positive finite sum");
  EXPECT_DEATH(DiscreteDistribution(std::vector<double>{1.0, -1.0}), "finite and >= 0");
  EXPECT_DEATH(DiscreteDistribution(std::vector<double>{NAN}), "finite and >= 0");
}

TEST(PiecewiseConstant1D, SamplesMatchPdfByChiSquare) {
  test::TestRandom random;
  const std::vector<double> values = random_weights(random, 12);
  const PiecewiseConstant1D distribution(values);
  std::vector<double> counts(48, 0.0);
  std::vector<double> expected(48);
  for (int i = 0; i < kDraws; ++i) {
    counts[static_cast<std::size_t>(double{distribution.sample(random.unit_float()).x} * 48.0)] +=
        1.0;
  }
  for (std::size_t i = 0; i < 48; ++i) {
    expected[i] = distribution.pdf((static_cast<float>(i) + 0.5f) / 48.0f) * kDraws / 48.0;
  }
  EXPECT_GT(test::chi_square_p(counts, expected), kLevel);
  EXPECT_NEAR(std::accumulate(expected.begin(), expected.end(), 0.0), kDraws, 1e-6);
  EXPECT_NEAR(distribution.integral(), std::accumulate(values.begin(), values.end(), 0.0) / 12.0,
              1e-12);
}

TEST(PiecewiseConstant1D, PdfAtASampleIsTheSamplesPdfEvenAtTheBorders) {
  test::TestRandom random;
  for (std::size_t n = 1; n <= 300; ++n) {
    const std::vector<double> values = random_weights(random, n);
    const PiecewiseConstant1D distribution(values);
    std::vector<float> variates = border_variates(values);
    for (int i = 0; i < 100; ++i) variates.push_back(random.unit_float());
    for (const float u : variates) {
      const auto sample = distribution.sample(u);
      ASSERT_TRUE(sample.x >= 0.0f && sample.x < 1.0f);
      ASSERT_GT(values[sample.cell], 0.0);
      ASSERT_EQ(distribution.pdf(sample.x), sample.pdf)
          << "n=" << n << " u=" << u << " x=" << sample.x;
    }
  }
}

RC_GTEST_PROP(PiecewiseConstant1D, InverseUndoesSample,
              (std::uint32_t a, std::vector<std::uint8_t> raw)) {
  std::vector<double> values(raw.begin(), raw.end());
  values.push_back(1.0);
  const PiecewiseConstant1D distribution(values);
  const float u = static_cast<float>(a >> 8) * 0x1p-24f;
  const auto sample = distribution.sample(u);
  // x is rounded to 2^-24 of 1: in u that is as much more as the density is higher.
  RC_ASSERT(std::abs(double{distribution.invert(sample.x)} - double{u}) <
            2e-7 * (1.0 + sample.pdf));
}

TEST(PiecewiseConstant2D, SamplesMatchPdfByChiSquare) {
  test::TestRandom random;
  std::vector<double> values = random_weights(random, 7 * 5);
  for (std::size_t i = 0; i < 7; ++i) values[2 * 7 + i] = 0.0;  // a row of zeros
  values[3 * 7] = 40.0;
  const PiecewiseConstant2D distribution(values, 7, 5);
  std::vector<double> counts(14 * 10, 0.0);
  std::vector<double> expected(14 * 10);
  for (int i = 0; i < kDraws; ++i) {
    const auto sample = distribution.sample(random.variates().u);
    ASSERT_EQ(sample.pdf, distribution.pdf(sample.uv));
    counts[static_cast<std::size_t>(double{sample.uv.y} * 10.0) * 14 +
           static_cast<std::size_t>(double{sample.uv.x} * 14.0)] += 1.0;
  }
  for (std::size_t i = 0; i < 140; ++i) {
    const Vec2 uv((static_cast<float>(i % 14) + 0.5f) / 14.0f,
                  (static_cast<float>(i / 14) + 0.5f) / 10.0f);
    expected[i] = distribution.pdf(uv) * kDraws / 140.0;
  }
  EXPECT_GT(test::chi_square_p(counts, expected), kLevel);
  EXPECT_NEAR(std::accumulate(expected.begin(), expected.end(), 0.0) / kDraws, 1.0, 1e-12);
}

RC_GTEST_PROP(PiecewiseConstant2D, InverseUndoesSample,
              (std::uint32_t a, std::uint32_t b, std::uint8_t hot)) {
  std::vector<double> values(6 * 4, 1.0);
  values[hot % 24] = 50.0;
  values[(hot + 7u) % 24] = 0.0;
  const PiecewiseConstant2D distribution(values, 6, 4);
  const Vec2 u(static_cast<float>(a >> 8) * 0x1p-24f, static_cast<float>(b >> 8) * 0x1p-24f);
  const auto sample = distribution.sample(u);
  const Vec2 v = distribution.invert(sample.uv);
  RC_ASSERT(sample.pdf > 0.0);
  RC_ASSERT(std::abs(double{v.x} - double{u.x}) < 2e-7 * 13.0);
  RC_ASSERT(std::abs(double{v.y} - double{u.y}) < 2e-7 * 13.0);
}

}  // namespace
}  // namespace penumbra
