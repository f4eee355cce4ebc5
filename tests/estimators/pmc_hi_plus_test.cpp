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
  Population population;

  explicit Block(int estimates = kEstimates, int camera_samples = 1)
      : population(kSlots, estimates) {
    population.begin(8, 8, estimates, camera_samples);
    for (int pixel = 0; pixel < population.pixels(); ++pixel) {
      for (int e = 0; e < estimates; ++e) use(pixel, e, 0.1);
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
  const int estimates = population.estimates();
  Allocation allocation(kSlots, population.most_places(), rules);
  population.gather();
  allocation.decide(population, [](const Population::Member&) { return LightAndLobeCounts{4, 0}; });
  std::vector<double> all;
  for (int pixel = 0; pixel < population.pixels(); ++pixel) {
    for (int e = 0; e < estimates; ++e) {
      const std::span<const double> samples = allocation.samples(population.place_of(pixel, e));
      all.insert(all.end(), samples.begin(), samples.end());
    }
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
  constexpr int kOfPixel = 4;
  for (const int camera_samples : {1, 2}) {
    for (const int budget : {4, 1000}) {
      Block before(kOfPixel, camera_samples), after(kOfPixel, camera_samples);
      int changed_other = 0;
      for (int pixel = 0; pixel < 64; ++pixel) {
        for (int e = 0; e < kOfPixel; ++e) {
          if (after.population.half(pixel, e) == 0) after.use(pixel, e, 0.01 * (1 + pixel));
        }
      }
      const std::vector<double> a = decided(before.population, rules_with(budget));
      const std::vector<double> b = decided(after.population, rules_with(budget));
      for (int pixel = 0; pixel < 64; ++pixel) {
        for (int e = 0; e < kOfPixel; ++e) {
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
  // One of the two columns within the block varies: of weights 1 and 1/2 twice, beside 1/2 and 1/3
  // twice. A tenth of the luminance counts as dark.
  EXPECT_NEAR(of_light(15), rules.rays * std::pow(12.0 / 19.0 / 1.01, rules.exponent) - 4, 1e-9);
}

// Estimates of one parity are often those of one camera sample; where it is the only one on a small
// piece of surface, nobody else could tell what is there.
TEST(Population, EachPointWithSeveralEstimatesIsInBothHalves) {
  for (const int camera_samples : {1, 2, 3, 4}) {
    const Block block(8, camera_samples);
    for (int pixel = 0; pixel < 2; ++pixel) {
      for (int point = 0; point < camera_samples; ++point) {
        int in_half[2] = {0, 0};
        for (int e = point; e < 8; e += camera_samples) ++in_half[block.population.half(pixel, e)];
        EXPECT_GT(in_half[0], 0) << camera_samples << " points, point " << point;
        EXPECT_GT(in_half[1], 0) << camera_samples << " points, point " << point;
      }
    }
  }
}

TEST(Allocation, APointIsToldByItsOwnEstimatesOfTheOtherHalf) {
  Block block(8, 2);
  const int pixel = 27;
  for (int e = 0; e < 8; ++e) {
    for (int p = 0; p < 64; ++p) block.use(p, e, 0.0);
  }
  // A camera sample that alone lies on its surface varies in half 0.
  for (int e = 0; e < 8; e += 2) {
    block.use(pixel, e, block.population.half(pixel, e) == 0 ? 1.0 : 0.0, 7);
  }
  const AllocationRules rules = rules_with(1000);
  const std::vector<double> samples = decided(block.population, rules);
  for (int e = 0; e < 8; e += 2) {
    const double expected = block.population.half(pixel, e) == 0
                                ? 0.0
                                : rules.rays * std::pow(1.0 / 1.01, rules.exponent) - 4;
    EXPECT_NEAR(samples[block.population.index(pixel, e) * kSlots], expected, 1e-9) << e;
  }
}

// The mean over the neighbourhood would hide what one point found.
TEST(Allocation, NeighboursDoNotOutvoteAPointsOwnEstimates) {
  Block block(4);
  const int pixel = 27;
  for (int p = 0; p < 64; ++p) {
    for (int e = 0; e < 4; ++e) block.use(p, e, p == pixel ? 1.0 : 0.0);
  }
  const AllocationRules rules = rules_with(1000);
  const std::vector<double> samples = decided(block.population, rules);
  EXPECT_NEAR(samples[block.population.index(pixel, 0) * kSlots],
              rules.rays * std::pow(1.0 / 1.01, rules.exponent) - 4, 1e-9);
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
