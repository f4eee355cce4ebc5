#include "estimators/sir/resampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

namespace penumbra {
namespace {

std::vector<Choice> chosen(const std::vector<double>& weights, std::uint32_t count, double offset) {
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<Choice> choices(count);
  choices.resize(systematic_choice(weights, sum, count, offset, choices));
  return choices;
}

TEST(SystematicChoice, CopiesAreOffTheirExpectationByLessThanOneAndAddUp) {
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> uniform;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<double> weights(1 + trial % 90);
    for (double& w : weights) w = uniform(generator) < 0.3 ? 0.0 : std::pow(uniform(generator), 6);
    weights[static_cast<std::size_t>(trial) % weights.size()] = 1.0;
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    const auto count = static_cast<std::uint32_t>(1 + trial % 40);
    std::uint32_t total = 0;
    std::int64_t last = -1;
    for (const Choice& choice : chosen(weights, count, uniform(generator))) {
      EXPECT_GT(static_cast<std::int64_t>(choice.candidate), last) << "not ascending";
      last = choice.candidate;
      const double expected = count * weights[choice.candidate] / sum;
      EXPECT_GT(weights[choice.candidate], 0.0);
      EXPECT_LT(std::abs(choice.copies - expected), 1.0);
      total += choice.copies;
    }
    EXPECT_EQ(total, count);
  }
}

// Over the offsets of a fine grid every candidate is chosen as often as it should be.
TEST(SystematicChoice, IsRightInTheMeanOverOffsets) {
  const std::vector<double> weights = {0.1, 0.0, 2.0, 0.7, 1e-9, 0.2};
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<double> copies(weights.size(), 0.0);
  constexpr int kOffsets = 100'000;
  for (int i = 0; i < kOffsets; ++i) {
    for (const Choice& c : chosen(weights, 3, (i + 0.5) / kOffsets))
      copies[c.candidate] += c.copies;
  }
  for (std::size_t j = 0; j < weights.size(); ++j) {
    EXPECT_NEAR(copies[j] / kOffsets, 3.0 * weights[j] / sum, 2e-5) << j;
  }
}

// The sum of the weights, added up in another order, may be larger than where the marks end.
TEST(SystematicChoice, ASumThatIsRoundedUpLosesNothing) {
  const std::vector<double> weights = {0.1, 0.2, 0.3};
  std::vector<Choice> choices(4);
  const std::size_t n = systematic_choice(weights, 0.6000000001, 4, 1.0 - 0x1p-53, choices);
  std::uint32_t total = 0;
  for (std::size_t i = 0; i < n; ++i) total += choices[i].copies;
  EXPECT_EQ(total, 4u);
}

}  // namespace
}  // namespace penumbra
