// ReSTIR: reuse between pixels that differ leaves the mean alone, equal weights do not; lights that
// hide parts of themselves; reservoirs without candidates; what reuse does to the correlation of
// pixels.
//
// False alarms of the positive cases: 1e-4 for all of this file together (Sidak, 40 tests).
// Standard errors come from the estimates of different indices, which share nothing.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "tests/support/correlation.h"
#include "tests/support/fixtures.h"

namespace penumbra::fixtures {
namespace {

using Text = std::string;
using Integer = std::int64_t;

constexpr int kSide = 16;  // [pixels]

const EstimatorEntry& restir() { return *find_estimator("restir_di"); }
const EstimatorEntry& mis() { return *find_estimator("mis"); }
double limit() { return family_limit(1e-4, 40); }

// A floor point sees a bright panel to the left and a dim one above; a wall point has the bright
// one below its horizon.
struct Corner {
  std::unique_ptr<Scene> scene;
  std::vector<ShadingPoint> points;  // [pixel]: floor and wall in the pattern of a chessboard
};

Corner corner() {
  SceneDescription scene;
  scene.name = "corner";
  scene.camera = {{0.0, -4.0, 2.5}, {0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, 60.0, {8, 8}};
  scene.materials = {lambert("grey", 0.6),
                     lambert("black", 0.0),
                     {"phong", PhongMaterial{Rgb(0.3f), Rgb(0.4f), 10.0f}}};
  scene.shapes.push_back(rectangle("panel", 1, {-2, -0.5, 0.2}, {0, 1, 0}, {0, 0, 1}, 5.0));
  scene.shapes.push_back(rectangle("lid", 1, {0, -0.5, 2}, {0, 1, 0}, {1, 0, 0}, 1.0));
  scene.shapes.push_back(rectangle("post", 1, {-1.0, -0.6, 0.3}, {0, 0.7, 0}, {0, 0, 0.3}, 0.0));
  Corner result;
  result.scene = std::make_unique<Scene>(std::move(scene));
  const Vec3d wo = Vec3d(1, 0, 1).normalized();
  const ShadingPoint floor = place(*result.scene, {0, 0, 0}, {0, 0, 1}, wo, 2);
  const ShadingPoint wall = place(*result.scene, {0.1, 0, 0.2}, {1, 0, 0}, wo, 0);
  for (int i = 0; i < kSide * kSide; ++i) {
    result.points.push_back((i / kSide + i % kSide) % 2 == 0 ? floor : wall);
  }
  return result;
}

struct Mean {
  double value{0.0}, error{0.0};  // standard error
  std::size_t zeros{0};
};

// Mean over the floor's or the wall's pixels, with the standard error of means over the pixels of
// one estimate index.
struct Means {
  Mean floor, wall;
};

Mean mean_of(const std::vector<Rgb>& radiance, int spp, int parity) {
  std::vector<double> means(static_cast<std::size_t>(spp), 0.0);
  Mean result;
  for (int i = 0; i < kSide * kSide; ++i) {
    if ((i / kSide + i % kSide) % 2 != parity) continue;
    for (int s = 0; s < spp; ++s) {
      const auto x = static_cast<double>(radiance[static_cast<std::size_t>(i * spp + s)].x);
      EXPECT_TRUE(std::isfinite(x) && x >= 0.0) << x;
      result.zeros += x == 0.0 ? 1u : 0u;
      means[static_cast<std::size_t>(s)] += x / (kSide * kSide / 2);
    }
  }
  for (const double m : means) result.value += m / spp;
  for (const double m : means) result.error += (m - result.value) * (m - result.value);
  result.error = std::sqrt(result.error / (spp - 1.0) / spp);
  return result;
}

Means run(const EstimatorEntry& entry, const ParamSet::Map& params, int spp,
          SamplerKind sampler = SamplerKind::Independent) {
  const Corner c = corner();
  Tile tile;
  tile.width = tile.height = tile.image_width = kSide;
  tile.spp = spp;
  tile.points = c.points;
  std::vector<Rgb> radiance(tile.estimate_count());
  TileOutput out;
  out.radiance = radiance;
  entry.create(*c.scene, params_with(entry, params), Budget{sampler, 4, 0})
      ->estimate(tile, test_seed(entry.name), out);
  EXPECT_EQ(out.counters.uncovered + out.counters.untraced, 0u);
  return {mean_of(radiance, spp, 0), mean_of(radiance, spp, 1)};
}

double z(const Mean& a, const Mean& b) {
  return (a.value - b.value) / std::hypot(a.error, b.error);
}

class RestirReuse : public ::testing::TestWithParam<SamplerKind> {};

TEST_P(RestirReuse, BetweenPixelsThatDifferLeavesTheMeanAlone) {
  const Means truth = run(mis(), {{"light_sampling", Text("solid_angle")}}, 400);
  for (const ParamSet::Map& params :
       {ParamSet::Map{}, ParamSet::Map{{"neighbours", Integer{0}}},
        ParamSet::Map{{"neighbours", Integer{8}}, {"radius", Integer{1}}},
        ParamSet::Map{{"candidates", Integer{1}}}}) {
    const ParamSet set = params_with(restir(), params);
    const std::string name = set.differences(restir().params());
    EXPECT_EQ(restir().bias_reason(set), "") << name;
    const Means means = run(restir(), params, 400, GetParam());
    EXPECT_LT(std::abs(z(means.floor, truth.floor)), limit()) << name << " floor";
    EXPECT_LT(std::abs(z(means.wall, truth.wall)), limit()) << name << " wall";
  }
}

INSTANTIATE_TEST_SUITE_P(AllSamplers, RestirReuse,
                         ::testing::Values(SamplerKind::Independent, SamplerKind::Stratified,
                                           SamplerKind::Sobol),
                         [](const auto& test) { return std::string(to_string(test.param)); });

// The control: a member that can not offer a light point counts all the same.
TEST(RestirReuseControl, EqualWeightsDarkenWhereNeighboursHaveALightBelowTheirHorizon) {
  const ParamSet::Map params = {{"reuse_weights", Text("one_over_m")}};
  EXPECT_NE(restir().bias_reason(params_with(restir(), params)), "");
  const Means truth = run(mis(), {{"light_sampling", Text("solid_angle")}}, 400);
  const Means means = run(restir(), params, 400);
  std::printf("floor: bias %+.1f %%, z %+.0f\n",
              100.0 * (means.floor.value / truth.floor.value - 1), z(means.floor, truth.floor));
  EXPECT_LT(z(means.floor, truth.floor), -limit());
}

// One candidate often has nothing to offer: the estimate is 0 then, and no number is lost.
TEST(RestirReservoirs, WithoutACandidateGiveZero) {
  const Means means = run(restir(), {{"candidates", Integer{1}}, {"neighbours", Integer{0}}}, 50);
  EXPECT_GT(means.floor.zeros + means.wall.zeros, 0u);
  EXPECT_GT(means.floor.value, 0.0);
}

/// Lights that emit on both sides and hide parts of themselves, seen from outside and from inside.
PlacedPoint among_closed_lights(bool inside) {
  SceneDescription scene;
  scene.name = "closed";
  scene.camera = {{0.0, -4.0, 2.5}, {0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, 60.0, {8, 8}};
  scene.materials = {lambert("grey", 0.6), lambert("black", 0.0)};
  ShapeDescription ball;
  ball.name = "ball";
  ball.material = 1;
  ball.shape = SphereShape{{0.0, 0.0, inside ? 0.2 : 1.5}, inside ? 4.0 : 0.5};
  ball.emission = EmissionDescription{Rgb(2.0f), true};
  scene.shapes.push_back(ball);
  ShapeDescription shard;
  shard.name = "shard";
  shard.material = 1;
  TriangleMeshShape mesh;
  mesh.vertices = {{-1.8, 0.5, 0.5}, {-1.2, 0.8, 0.5}, {-1.5, 0.5, 1.5}, {-1.5, 0.0, 0.7}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  shard.shape = mesh;
  shard.emission = EmissionDescription{Rgb(6.0f), true};
  scene.shapes.push_back(shard);
  PlacedPoint placed;
  placed.scene = std::make_unique<Scene>(std::move(scene));
  placed.point = place(*placed.scene, {0, 0, 0}, {0, 0, 1}, Vec3d(0.6, 0.0, 0.8), 0);
  return placed;
}

TEST(RestirLightPoints, OnTheFarSideOfALightAreHiddenByIt) {
  for (const bool inside : {false, true}) {
    const PlacedPoint placed = among_closed_lights(inside);
    const Budget budget{SamplerKind::Independent, 8, 0};
    const RunStatistics truth = estimate_many(mis(), params_with(mis(), {}), budget, placed, 1.0,
                                              test_seed("mis"), 100'000);
    const RunStatistics run = estimate_many(restir(), params_with(restir(), {}), budget, placed,
                                            1.0, test_seed("restir"), 100'000);
    const double error = std::hypot(truth.standard_error(), run.standard_error());
    EXPECT_LT(std::abs(run.mean - truth.mean), limit() * error)
        << (inside ? "inside" : "outside") << ": " << run.mean << " against " << truth.mean;
    EXPECT_LT(error, 2e-3 * truth.mean) << "the test has power";
  }
}

double neighbours_z(const ParamSet::Map& params) {
  const Budget budget{SamplerKind::Independent, 4, 0};
  return correlation_z(errors_of_a_tile(restir(), params_with(restir(), params), budget,
                                        build(fixture('F')), test_seed("pixels")),
                       kCorrelationSpp);
}

// What the entry says of itself: reuse correlates pixels. Without neighbours it does not.
TEST(RestirCorrelation, IsThatOfNeighboursThatShare) {
  EXPECT_TRUE(restir().correlates_pixels);
  EXPECT_GT(neighbours_z({{"neighbours", Integer{8}}, {"radius", Integer{1}}}), limit());
  EXPECT_LT(std::abs(neighbours_z({{"neighbours", Integer{0}}})), limit());
}

}  // namespace
}  // namespace penumbra::fixtures
