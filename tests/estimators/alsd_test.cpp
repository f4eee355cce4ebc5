// ALSD: the probabilities of the second pass by hand, what they follow, and the negative control
// without a uniform share. Unbiasedness with the defaults is tested with all estimators
// (fixtures_test.cpp, conformance).
//
// False alarms: 1e-5 for each of the two z tests, whose seeds follow from their names.

#include "estimators/alsd/evidence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/support/fixtures.h"

namespace penumbra::fixtures {
namespace {

using alsd::Evidence;

constexpr double kLimit = 4.4;  // two-sided 1e-5

std::vector<double> probabilities(const Evidence& evidence, int pixel, std::size_t lights) {
  std::vector<double> pmf(lights);
  evidence.probabilities(pixel, pmf);
  return pmf;
}

TEST(AlsdEvidence, WeightsUniformBlockAndPixelAsStated) {
  Evidence evidence(2, 4, {0.2, 64.0});
  evidence.add(0, 0, 3.0);
  evidence.add(0, 1, 1.0);
  evidence.add_samples(0, 64);  // as much as kappa: pixel and block share 0.8
  evidence.add(1, 1, 4.0);
  evidence.add_samples(1, 192);  // three quarters of 0.8 to the pixel
  evidence.finish();
  // Block: 3 to 5. Pixel 0: 3 to 1. Pixel 1: 0 to 4.
  EXPECT_NEAR(probabilities(evidence, 0, 2)[0], 0.1 + 0.4 * 3.0 / 8.0 + 0.4 * 0.75, 1e-15);
  EXPECT_NEAR(probabilities(evidence, 1, 2)[0], 0.1 + 0.2 * 3.0 / 8.0, 1e-15);
  for (const int pixel : {0, 1, 2}) {
    const std::vector<double> pmf = probabilities(evidence, pixel, 2);
    EXPECT_NEAR(std::accumulate(pmf.begin(), pmf.end(), 0.0), 1.0, 1e-15);
  }
}

TEST(AlsdEvidence, PixelWithoutLightFollowsItsBlock) {
  Evidence evidence(3, 4, {0.3, 64.0});
  evidence.add(0, 2, 5.0);
  evidence.add_samples(0, 100);
  evidence.add_samples(3, 100);
  evidence.finish();
  const std::vector<double> pmf = probabilities(evidence, 3, 3);
  EXPECT_NEAR(pmf[0], 0.1, 1e-15);
  EXPECT_NEAR(pmf[2], 0.1 + 0.7, 1e-15);
}

TEST(AlsdEvidence, BlockWithoutLightIsUniform) {
  Evidence evidence(4, 2, {0.0, 64.0});
  evidence.add_samples(0, 100);
  evidence.finish();
  for (const double p : probabilities(evidence, 0, 4)) EXPECT_EQ(p, 0.25);
}

TEST(AlsdEvidence, ClearForgetsTheBlockBefore) {
  Evidence evidence(2, 2, {0.2, 64.0});
  evidence.add(0, 0, 1.0);
  evidence.add_samples(0, 10);
  evidence.finish();
  evidence.clear();
  evidence.finish();
  EXPECT_EQ(probabilities(evidence, 0, 2)[0], 0.5);
}

// Estimates of one point in blocks of 64 pixels that all see it, few per pixel.
struct TileRun {
  double mean{0}, standard_error{0}, variance{0};
  std::vector<double> maps;  // means
};

TileRun run_tiles(const PlacedPoint& placed, const ParamSet::Map& given, int srl, int spp,
                  int tiles, std::uint64_t seed) {
  const EstimatorEntry& entry = *find_estimator("alsd");
  const std::unique_ptr<Estimator> estimator =
      entry.create(*placed.scene, params_with(entry, given), {SamplerKind::Independent, srl, 0});
  const std::vector<ShadingPoint> points(64, placed.point);
  Tile tile;
  tile.width = tile.height = tile.image_width = 8;
  tile.spp = spp;
  tile.points = points;
  std::vector<Rgb> radiance(tile.estimate_count());
  const std::size_t maps = estimator->maps().size();
  std::vector<float> map_values(tile.estimate_count() * maps);
  TileRun result;
  result.maps.resize(maps);
  double square_sum = 0.0;
  for (int t = 0; t < tiles; ++t) {
    TileOutput out{radiance, map_values, {}};
    estimator->estimate(tile, seed + static_cast<std::uint64_t>(t), out);
    double mean = 0.0;
    for (const Rgb& value : radiance) mean += static_cast<double>(value.x);
    mean /= static_cast<double>(radiance.size());
    result.mean += mean / tiles;
    square_sum += mean * mean / tiles;
    for (std::size_t i = 0; i < map_values.size(); ++i) {
      result.maps[i % maps] += static_cast<double>(map_values[i]) /
                               static_cast<double>(map_values.size() / maps) / tiles;
    }
  }
  result.variance = square_sum - result.mean * result.mean;
  result.standard_error = std::sqrt(result.variance / (tiles - 1));
  return result;
}

TEST(Alsd, SecondPassPrefersTheLightThatContributes) {
  // Fixture C: a strip of the large light is all that is seen.
  const Fixture& f = fixture('C');
  const TileRun run = run_tiles(build(f), {}, 16, 8, 200, test_seed("C"));
  ASSERT_EQ(run.maps.size(), 2u);
  EXPECT_GT(run.maps[0], 0.85);
  EXPECT_NEAR(run.maps[0] + run.maps[1], 1.0, 1e-6);
  EXPECT_LT(std::abs(run.mean - exact_radiance(f)), kLimit * run.standard_error);
  // With all probabilities equal the same samples say less.
  const TileRun uniform =
      run_tiles(build(f), {{"uniform_weight", 1.0}}, 16, 8, 200, test_seed("C"));
  EXPECT_LT(run.variance, 0.85 * uniform.variance);
}

TEST(Alsd, WithoutUniformShareLightsAreLost) {
  // The small light of fixture B is 10 % visible: four samples often miss it, and then a pixel that
  // trusts itself alone never asks it again.
  const Fixture& f = fixture('B');
  const ParamSet::Map trusting = {{"uniform_weight", 0.0}, {"kappa", 0.0}};
  const EstimatorEntry& entry = *find_estimator("alsd");
  EXPECT_FALSE(entry.bias_reason(params_with(entry, trusting)).empty());
  const TileRun lost = run_tiles(build(f), trusting, 4, 2, 3000, test_seed("B"));
  EXPECT_LT(lost.mean - exact_radiance(f), -kLimit * lost.standard_error);
  EXPECT_LT(lost.mean, 0.97 * exact_radiance(f));
  // The defensive share alone repairs it.
  const TileRun kept = run_tiles(build(f), {{"kappa", 0.0}}, 4, 2, 3000, test_seed("B"));
  EXPECT_LT(std::abs(kept.mean - exact_radiance(f)), kLimit * kept.standard_error);
}

}  // namespace
}  // namespace penumbra::fixtures
