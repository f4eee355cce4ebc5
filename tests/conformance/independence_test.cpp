// Estimates of neighbouring pixels, and those of one pixel, have uncorrelated errors: nothing ties
// the random numbers of one estimate to those of another.
//
// False alarms: the correlation of n pairs of independent errors is normal with variance 1/n; the
// tests of all estimators, samplers and neighbourhoods together raise an alarm with probability
// 1e-4 (Sidak). Seeds follow from the tests' names.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/conformance/conformance_support.h"
#include "tests/support/fixtures.h"

namespace penumbra::conformance {
namespace {

constexpr int kSide = 16;  // [pixels]
constexpr int kSpp = 64;
constexpr double kFamilyLevel = 1e-4;

struct Sampled {
  Variant variant;
  SamplerKind sampler;
};

void PrintTo(const Sampled& s, std::ostream* out) {
  *out << s.variant.name << '_' << to_string(s.sampler);
}

std::vector<Sampled> with_all_samplers() {
  std::vector<Sampled> result;
  for (const Variant& variant : defaults()) {
    for (const SamplerKind sampler :
         {SamplerKind::Independent, SamplerKind::Stratified, SamplerKind::Sobol}) {
      result.push_back({variant, sampler});
    }
  }
  return result;
}

// Errors of all estimates of one point, seen by every pixel of a tile: [pixel][estimate].
std::vector<double> errors(const Sampled& s) {
  const fixtures::PlacedPoint placed = fixtures::build(fixtures::fixture('F'));
  Budget budget = budget_of(*s.variant.entry);
  budget.sampler = s.sampler;
  const std::vector<ShadingPoint> points(std::size_t{kSide} * kSide, placed.point);
  Tile tile;
  tile.width = tile.height = tile.image_width = kSide;
  tile.spp = kSpp;
  tile.points = points;
  std::vector<Rgb> radiance(tile.estimate_count());
  TileOutput out;
  out.radiance = radiance;
  s.variant.entry->create(*placed.scene, s.variant.params, budget)
      ->estimate(tile, fixtures::test_seed("errors"), out);
  double mean = 0.0;
  for (const Rgb& value : radiance) mean += static_cast<double>(value.x);
  mean /= static_cast<double>(radiance.size());
  std::vector<double> result;
  for (const Rgb& value : radiance) result.push_back(static_cast<double>(value.x) - mean);
  return result;
}

// Correlation between every error and the one `step` behind it, in units of its standard deviation
// for independent errors.
double correlation_z(const std::vector<double>& errors, std::size_t step) {
  double product = 0.0;
  double square = 0.0;
  double pairs = 0.0;
  for (std::size_t i = 0; i + step < errors.size(); ++i) {
    product += errors[i] * errors[i + step];
    square += 0.5 * (errors[i] * errors[i] + errors[i + step] * errors[i + step]);
    pairs += 1.0;
  }
  return product / square * std::sqrt(pairs);
}

class Independence : public ::testing::TestWithParam<Sampled> {
 protected:
  const double limit_ =
      fixtures::family_limit(kFamilyLevel, 2 * static_cast<int>(with_all_samplers().size()));
};

TEST_P(Independence, OfNeighbouringPixels) {
  if (GetParam().variant.entry->correlates_pixels) {
    GTEST_SKIP() << "shares samples between pixels, and its entry says so";
  }
  const double z = correlation_z(errors(GetParam()), kSpp);
  EXPECT_LT(std::abs(z), limit_);
}

TEST_P(Independence, OfTheEstimatesOfAPixel) {
  const double z = correlation_z(errors(GetParam()), 1);
  EXPECT_LT(std::abs(z), limit_);
}

INSTANTIATE_TEST_SUITE_P(AllEstimators, Independence, ::testing::ValuesIn(with_all_samplers()),
                         [](const auto& test) {
                           return test.param.variant.name + "_" +
                                  std::string(to_string(test.param.sampler));
                         });

// The negative control: pixels that share their random numbers.
TEST(IndependenceControl, SharedNumbersAreFound) {
  const Sampled s{defaults().front(), SamplerKind::Independent};
  std::vector<double> shared = errors(s);
  for (std::size_t i = kSpp; i < shared.size(); ++i) {
    if (i / kSpp % 8 == 0)
      shared[i] = shared[i - kSpp];  // every eighth pixel repeats the one before
  }
  EXPECT_GT(correlation_z(shared, kSpp), fixtures::family_limit(kFamilyLevel, 1));
}

}  // namespace
}  // namespace penumbra::conformance
