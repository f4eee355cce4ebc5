// What decides how many samples an estimate of pmc_hi_plus draws. That its mean is right is shown
// by the tests of every estimator; here, why it can be.

#include <gtest/gtest.h>

#include <cmath>

#include "estimators/pmc_hi_plus/allocation.h"
#include "estimators/pmc_hi_plus/samples.h"
#include "tests/support/fixtures.h"

namespace penumbra::pmc_hi_plus {
namespace {

constexpr std::size_t kSlots = 3;  // two lights, BSDF
constexpr int kEstimates = 2;

struct Block {
  Population population{kSlots, kEstimates};

  explicit Block(int width = 8, int height = 8) {
    population.begin(width, height, kEstimates);
    for (int pixel = 0; pixel < width * height; ++pixel) {
      for (int e = 0; e < kEstimates; ++e) use(pixel, e, 0.1);
    }
  }

  void use(int pixel, int e, double variance, std::uint32_t material = 0) {
    ShadingPoint point;
    point.material = material;
    point.shading_normal = Vec3(0.0f, 0.0f, 1.0f);
    const std::size_t i = population.index(pixel, e);
    Population::Member& member = population.use(i, point);
    member.lights = 2;
    member.luminance = 1.0;
    population.variance(i)[0] = variance;
  }
};

std::vector<double> decided(Population& population, const AllocationRules& rules) {
  Allocation allocation(kSlots, kBlockPixels * kEstimates, rules);
  population.gather();
  allocation.decide(population, [](const Population::Member&) {
    return LightAndLobeCounts{4, 0};
  });
  std::vector<double> all;
  for (std::size_t i = 0; i < population.index(population.pixels(), 0); ++i) {
    const std::span<const double> samples = allocation.samples(i);
    all.insert(all.end(), samples.begin(), samples.end());
  }
  return all;
}

AllocationRules rules_with(int srl_adaptive) {
  AllocationRules rules;
  rules.srl_adaptive = srl_adaptive;
  return rules;
}

// The claim on which unbiasedness rests, also where the budget binds.
TEST(Allocation, NoEstimateOfAHalfDecidesNumbersOfItsHalf) {
  for (const int budget : {4, 1000}) {
    Block before, after;
    int changed_other = 0;
    for (int pixel = 0; pixel < 64; ++pixel) {
      for (int e = 0; e < kEstimates; ++e) {
        if (after.population.half(pixel, e) == 0) after.use(pixel, e, 0.01 * (1 + pixel));
      }
    }
    const std::vector<double> a = decided(before.population, rules_with(budget));
    const std::vector<double> b = decided(after.population, rules_with(budget));
    for (int pixel = 0; pixel < 64; ++pixel) {
      for (int e = 0; e < kEstimates; ++e) {
        const std::size_t i = before.population.index(pixel, e);
        for (std::size_t k = 0; k < kSlots; ++k) {
          if (before.population.half(pixel, e) == 0) {
            EXPECT_EQ(a[i * kSlots + k], b[i * kSlots + k]) << "its own half decided";
          } else if (a[i * kSlots + k] != b[i * kSlots + k]) {
            ++changed_other;
          }
        }
      }
    }
    EXPECT_GT(changed_other, 50) << "the other half must decide, or this test shows nothing";
  }
}

TEST(Allocation, SamplesGoWhereNeighboursVaryAndNoFurther) {
  Block block;
  for (int pixel = 0; pixel < 64; ++pixel) {
    for (int e = 0; e < kEstimates; ++e) block.use(pixel, e, pixel % 8 == 7 ? 1.0 : 0.0);
  }
  AllocationRules rules = rules_with(1000);
  rules.radius = 1;
  const std::vector<double> samples = decided(block.population, rules);
  const auto of_light = [&](int pixel) {
    return samples[block.population.index(pixel, 0) * kSlots];
  };
  EXPECT_EQ(of_light(0), 0.0);
  EXPECT_EQ(of_light(5), 0.0);
  EXPECT_GT(of_light(6), 0.0);
  // One of the two columns within the block varies; a tenth of the luminance counts as dark.
  EXPECT_NEAR(of_light(15), rules.rays * std::pow(0.5 / 1.01, rules.exponent) - 4, 1e-9);
}

TEST(Allocation, TheMeanStaysWithinTheBudget) {
  Block block;
  const std::vector<double> samples = decided(block.population, rules_with(3));
  double total = 0.0;
  for (const double n : samples) total += n;
  EXPECT_NEAR(total / (64 * kEstimates), 3.0 * 2, 1e-9);
}

TEST(Allocation, OtherSurfacesSayNothing) {
  Block block;
  const int pixel = 27;
  block.use(pixel, 0, 0.1, 7);
  const std::vector<double> samples = decided(block.population, rules_with(1000));
  const std::size_t i = block.population.index(pixel, 0) * kSlots;
  EXPECT_EQ(samples[i], 1000.0) << "its share of the budget, because it has no neighbours";
}

TEST(MisWeight, BothHeuristicsByHand) {
  const int counts[] = {4, 2};
  MisWeight balance(Heuristic::Balance, counts, 0, 0.5f), power(Heuristic::Power2, counts, 0, 0.5f);
  for (MisWeight* weight : {&balance, &power}) {
    weight->add(0, 0.5f);
    weight->add(1, 3.0f);
  }
  EXPECT_DOUBLE_EQ(balance.value(), 1.0 / 8.0);
  EXPECT_DOUBLE_EQ(power.value(), 2.0 / 40.0);
}

}  // namespace
}  // namespace penumbra::pmc_hi_plus
