// Rays: lights that are smaller than the rounding of a direction, blockers next to a light, walls
// next to a point, rays that are no rays. Each with the naive rule, which has to fail.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tests/core/trace.h"
#include "tests/support/fixtures.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using fixtures::PlacedPoint;
using fixtures::RunStatistics;

constexpr double kReflectance = 0.5;
const Vec3d kPosition(0.3, 0.2, 0.0);

// Floor of 4 x 4 under a light of a given size in a height of 1, whose irradiance is about 1.
SceneDescription lit_floor(bool is_sphere, double size) {
  SceneDescription scene;
  scene.materials = {test::lambert(static_cast<float>(kReflectance)), test::lambert(0.0f)};
  scene.shapes = {test::shape("floor", RectangleShape{{-2, -2, 0}, {4, 0, 0}, {0, 4, 0}})};
  const auto radiance = static_cast<float>(1.0 / (size * size));
  if (is_sphere) {
    scene.shapes.push_back(
        test::light("ball", SphereShape{{-0.1, 0.1, 1}, 0.5 * size}, Rgb(radiance)));
  } else {
    scene.shapes.push_back(test::light(
        "panel", RectangleShape{{-0.1, 0.1, 1}, {0, size, 0}, {size, 0, 0}}, Rgb(radiance)));
  }
  scene.shapes.back().material = 1;
  return scene;
}

PlacedPoint on_floor(const SceneDescription& description) {
  PlacedPoint placed{std::make_unique<Scene>(description), {}};
  placed.point = fixtures::place(*placed.scene, kPosition, {0, 0, 1}, {0, 0, 1}, 0);
  placed.point.position = offset_ray_origin(placed.point.position, placed.point.geometric_normal);
  return placed;
}

// Radiance by the light in the floats of the scene.
double exact_radiance(const PlacedPoint& placed) {
  const Light& light = placed.scene->lights()[0];
  const Vec3& normal = placed.point.geometric_normal;
  if (light.type == LightType::Rectangle) {
    double irradiance = test::rectangle_irradiance(light, placed.point.position, normal);
    if (light.area < 1e-5) {
      // Lambert's formula cancels; the cosine varies by the square of the size.
      const Vec3d to_middle = Vec3d(light.origin) +
                              (Vec3d(light.edge_u) + Vec3d(light.edge_v)) * 0.5 -
                              Vec3d(placed.point.position);
      irradiance = static_cast<double>(test::rectangle_solid_angle(light, placed.point.position)) *
                   to_middle.normalized().dot(Vec3d(normal));
    }
    return kReflectance / M_PI * static_cast<double>(light.radiance.x) * irradiance;
  }
  const Vec3d to_center = Vec3d(light.center) - Vec3d(placed.point.position);
  const auto radius = static_cast<double>(light.radius);
  const double distance2 = to_center.length2();
  return kReflectance * static_cast<double>(light.radiance.x) * radius * radius / distance2 *
         to_center.dot(Vec3d(normal)) / std::sqrt(distance2);
}

// Estimators that draw directions to lights; the other two hardly ever meet a small one.
std::vector<const EstimatorEntry*> estimators_of_lights() {
  std::vector<const EstimatorEntry*> result;
  for (const EstimatorEntry* entry : all_estimators()) {
    if (entry->name != "bsdf" && entry->name != "uniform") result.push_back(entry);
  }
  return result;
}

RunStatistics estimates(const EstimatorEntry& entry, const PlacedPoint& placed, double exact,
                        std::uint64_t count, const ParamSet::Map& params = {}) {
  const Budget budget = entry.adaptive ? Budget{SamplerKind::Independent, 4, 12}
                                       : Budget{SamplerKind::Independent, 16, 0};
  return estimate_many(entry, fixtures::params_with(entry, params), budget, placed, exact,
                       fixtures::test_seed(entry.name), count);
}

// Share of the rays towards a light that miss it.
double missed_share(const PlacedPoint& placed) {
  test::TestRandom random;
  LightProposal proposal;
  EXPECT_TRUE(proposal.set_up(placed.scene->lights()[0], LightSampling::Area, placed.point.position,
                              placed.point.geometric_normal));
  RayBatch batch(20000);
  while (batch.size() < batch.capacity()) {
    batch.add(placed.point.position, proposal.sample(random.variates())->wi);
  }
  placed.scene->intersect(batch);
  double missed = 0.0;
  for (std::size_t i = 0; i < batch.size(); ++i) {
    missed += placed.scene->emitter(batch.hits[i], batch.direction(i)) == 0 ? 0.0 : 1.0;
  }
  return missed / static_cast<double>(batch.size());
}

// Samples towards a light all have the same weight where the light is small, so that an estimate is
// exact to a rounding; 5 standard errors of what is left, for the larger ones.
TEST(TinyLight, GivesItsRadianceDownToASizeOf1eMinus8) {
  double most_missed = 0.0;
  for (const bool is_sphere : {false, true}) {
    for (int k = 1; k <= 8; ++k) {
      const PlacedPoint placed = on_floor(lit_floor(is_sphere, std::pow(10.0, -k)));
      const double exact = exact_radiance(placed);
      for (const EstimatorEntry* entry : estimators_of_lights()) {
        // Positions of samples decide on others there: a bias that is declared.
        if (k < 4 && !entry->bias_reason(fixtures::params_with(*entry, {})).empty()) continue;
        const RunStatistics run = estimates(*entry, placed, exact, 4096);
        EXPECT_EQ(run.non_finite + run.counters.uncovered, 0u) << entry->name;
        EXPECT_NEAR(run.mean / exact, 1.0, 1e-5 + 5.0 * run.standard_error() / exact)
            << entry->name << (is_sphere ? " sphere" : " square") << " of size 1e-" << k;
      }
      most_missed = std::max(most_missed, missed_share(placed));
    }
  }
  EXPECT_GT(most_missed, 0.1) << "negative control: what rays meet would do";
}

TEST(TinyLight, OneComponentForAllLightsGivesItToo) {
  const EstimatorEntry& entry = *find_estimator("pmc_hi");
  const PlacedPoint placed = on_floor(lit_floor(false, 1e-7));
  const double exact = exact_radiance(placed);
  const RunStatistics run =
      estimates(entry, placed, exact, 4096, {{"light_mode", std::string("all_as_one")}});
  EXPECT_NEAR(run.mean / exact, 1.0, 1e-5 + 5.0 * run.standard_error() / exact);
}

// Whether the ray to the light's middle ends within 1 % of it: what a test of visibility with such
// a tolerance would take for light.
bool reaches_to_one_percent(const PlacedPoint& placed) {
  const Light& light = placed.scene->lights()[0];
  const Vec3 d = (light.bounds_min + light.bounds_max) * 0.5f - placed.point.position;
  const RayHit hit = test::trace(*placed.scene, placed.point.position, d.normalized());
  return hit.distance > 0.99f * d.length();
}

// A blocker a thousandth of the distance in front of the light hides it, however small it is.
TEST(TinyLight, IsHiddenByABlockerCloseToIt) {
  for (const bool is_sphere : {false, true}) {
    for (int k = 2; k <= 8; ++k) {
      const double size = std::pow(10.0, -k);
      SceneDescription description = lit_floor(is_sphere, size);
      const double below = 1.0 - (is_sphere ? 0.5 * size : 0.0) - 1e-3;
      const double side = 4.0 * size + 1e-2;
      description.shapes.push_back(test::shape(
          "blocker",
          RectangleShape{{-0.1 - side, 0.1 - side, below}, {2 * side, 0, 0}, {0, 2 * side, 0}}, 1));
      const PlacedPoint placed = on_floor(description);
      EXPECT_TRUE(reaches_to_one_percent(placed)) << "negative control";
      for (const EstimatorEntry* entry : estimators_of_lights()) {
        const RunStatistics run = estimates(*entry, placed, 1.0, 1024);
        EXPECT_EQ(run.mean, 0.0) << entry->name << " size 1e-" << k;
        EXPECT_EQ(run.counters.lit, 0u) << entry->name;
      }
    }
  }
}

// Two squares one above the other: each ray brings the light of the lower one only.
TEST(TinyLight, HidesTheOneBehindIt) {
  // Below 1e-3 the difference of their outlines is lost in the rounding of directions.
  for (int k = 1; k <= 3; ++k) {
    const double size = std::pow(10.0, -k);
    SceneDescription description = lit_floor(false, size);
    description.shapes.push_back(
        test::light("upper", RectangleShape{{-0.1, 0.1, 1.001}, {0, size, 0}, {size, 0, 0}},
                    Rgb(static_cast<float>(1.0 / (size * size)))));
    // Seen from straight below.
    PlacedPoint below = on_floor(description);
    const Vec3d middle(-0.1 + 0.5 * size, 0.1 + 0.5 * size, 0.0);
    below.point.position =
        offset_ray_origin(test::to_scene(*below.scene, middle), below.point.geometric_normal);
    const Light& lower = below.scene->lights()[0];
    const double exact = kReflectance / M_PI * static_cast<double>(lower.radiance.x) *
                         test::rectangle_irradiance(lower, below.point.position, {0, 0, 1});
    const EstimatorEntry& entry = *find_estimator("mis");
    const RunStatistics run = estimates(entry, below, exact, 4096);
    // The upper one is seen under an angle that is smaller by 0.1 %: what is left beside the lower
    // one is nothing but the outline.
    EXPECT_NEAR(run.mean / exact, 1.0, 2e-5 + 5.0 * run.standard_error() / exact) << k;
  }
}

// A thin wall on the floor, a light on its other side.
SceneDescription wall(double scale) {
  SceneDescription scene;
  scene.materials = {test::lambert(0.5f)};
  const double s = scale;
  TriangleMeshShape board = test::cube_mesh({0, 0, 0}, 1.0);
  for (Vec3d& v : board.vertices) v = Vec3d(v.x * 1e-4, v.y * 4.0, v.z * 0.5 + 0.25) * s;
  scene.shapes = {
      test::shape("floor",
                  RectangleShape{Vec3d(-2, -2, 0) * s, Vec3d(4, 0, 0) * s, Vec3d(0, 4, 0) * s}),
      test::shape("board", board),
      test::light("panel",
                  RectangleShape{Vec3d(1, -0.5, 0.1) * s, Vec3d(0, 0, 0.3) * s, Vec3d(0, 1, 0) * s},
                  Rgb(1.0f), true)};
  return scene;
}

// Share of rays from points close behind the wall that get to the light in front of it.
// @param epsilon_world  distance by which rays start off the surface; nullopt: as Scene says
double leaks(double scale, std::optional<double> epsilon_world) {
  const Scene scene(wall(scale));
  test::TestRandom random;
  const Light& light = scene.lights()[0];
  RayBatch batch(20000);
  while (batch.size() < batch.capacity()) {
    const double beside = -5e-5 - std::pow(10.0, random.uniform(-4.0, -1.0));
    const Vec3d on_floor(beside, random.uniform(-0.5, 0.5), 0.0);
    const Vec3 surface = test::to_scene(scene, on_floor * scale);
    const Vec3 normal(0, 0, 1);
    LightProposal proposal;
    EXPECT_TRUE(proposal.set_up(light, LightSampling::Area, surface, normal));
    const Vec3 wi = proposal.sample(random.variates())->wi;
    const auto step = static_cast<float>(epsilon_world.value_or(0.0) * scene.traits().scale);
    batch.add(epsilon_world ? surface + wi * step : offset_ray_origin(surface, normal), wi);
  }
  scene.intersect(batch);
  double lit = 0.0;
  for (std::size_t i = 0; i < batch.size(); ++i) {
    lit += scene.emitter(batch.hits[i], batch.direction(i)) == 0 ? 1.0 : 0.0;
  }
  return lit / static_cast<double>(batch.size());
}

TEST(ContactShadow, OfAThinWallIsCompleteInEveryUnit) {
  for (const double scale : {1e-5, 1.0, 1e6}) EXPECT_EQ(leaks(scale, std::nullopt), 0.0) << scale;
  EXPECT_GT(leaks(1e-5, 1e-6), 0.5) << "negative control: an absolute epsilon";
  EXPECT_GT(leaks(1.0, 1e-2), 0.05) << "negative control: a hundredth of the scene";
}

// Rays from inside a closed mesh, through its faces and along its edges.
TEST(Watertight, NoRayLeavesAClosedMesh) {
  const TriangleMeshShape mesh = test::sphere_mesh({0.1, -0.2, 0.3}, 1.0, 32, 64);
  SceneDescription description;
  description.materials = {test::lambert(0.5f)};
  description.shapes = {test::shape("ball", mesh)};
  const Scene scene(description);
  test::TestRandom random;
  RayBatch batch(1'000'000);
  while (batch.size() < batch.capacity()) {
    const Vec3 from = test::to_scene(
        scene, Vec3d(0.1, -0.2, 0.3) + Vec3d(random.direction()) * random.uniform(0, 0.8));
    const auto& triangle = mesh.triangles[random.bits() % mesh.triangles.size()];
    const Vec3d a = mesh.vertices[triangle[0]];
    const Vec3d b = mesh.vertices[triangle[1]];
    // A vertex, a place on an edge, or anywhere.
    const double share = batch.size() % 3 == 0 ? 0.0 : random.uniform();
    const Vec3 direction = batch.size() % 3 == 2
                               ? random.direction()
                               : (test::to_scene(scene, a + (b - a) * share) - from).normalized();
    batch.add(from, direction);
  }
  scene.intersect(batch);
  int escaped[3] = {0, 0, 0};
  for (std::size_t i = 0; i < batch.size(); ++i) escaped[i % 3] += batch.hits[i].hit() ? 0 : 1;
  // At vertices Embree is not watertight, robust or not (embree issues 181 and 387): one in 600 of
  // the rays that are aimed at one. No other ray meets one.
  EXPECT_LE(escaped[0], 2000);
  EXPECT_LE(escaped[1], 1);
  EXPECT_LE(escaped[2], 1);
}

TEST(Watertight, AMissingTriangleIsFound) {  // negative control
  TriangleMeshShape mesh = test::sphere_mesh({0, 0, 0}, 1.0, 32, 64);
  mesh.triangles.pop_back();
  SceneDescription description;
  description.materials = {test::lambert(0.5f)};
  description.shapes = {test::shape("ball", mesh)};
  const Scene scene(description);
  test::TestRandom random;
  RayBatch batch(100'000);
  while (batch.size() < batch.capacity()) batch.add(Vec3(0.0f), random.direction());
  scene.intersect(batch);
  int escaped = 0;
  for (std::size_t i = 0; i < batch.size(); ++i) escaped += batch.hits[i].hit() ? 0 : 1;
  EXPECT_GT(escaped, 1);
}

TEST(RayBatch, RaysThatAreNoRaysAreCountedAndNotTraced) {
  const Scene scene(lit_floor(false, 0.1));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const Vec3 down(0, 0, -1);
  RayBatch batch(32);
  int faulty = 0;
  for (const float bad : {nan, inf, -inf}) {
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 origin(0.1f, 0.1f, 0.5f);
      Vec3 direction = down;
      origin[axis] = bad;
      batch.add(origin, down);
      direction[axis] = bad;
      batch.add(Vec3(0.1f, 0.1f, 0.5f), direction);
      batch.add(Vec3(0.1f, 0.1f, 0.5f), down);
      faulty += 2;
    }
  }
  batch.add(Vec3(0.1f, 0.1f, 0.5f), Vec3(0.0f));
  batch.add(Vec3(0.1f, 0.1f, 0.5f), Vec3(-0.0f, 0.0f, 1e-40f));  // a direction, if a short one
  ++faulty;
  scene.intersect(batch);
  EXPECT_EQ(batch.untraced(), static_cast<std::size_t>(faulty));
  std::size_t naive = 0;  // the control: a guard that looks for NaN alone
  for (std::size_t i = 0; i < batch.size(); ++i) {
    naive += batch.origin(i) == batch.origin(i) && batch.direction(i) == batch.direction(i) ? 0 : 1;
  }
  EXPECT_LT(2 * naive, batch.untraced()) << "infinities and zero directions pass it";
  for (std::size_t i = 0; i + 2 < batch.size(); ++i) {
    EXPECT_EQ(batch.hits[i].hit(), i % 3 == 2) << i;
    if (i % 3 != 2) {
      EXPECT_EQ(batch.hits[i].distance, inf) << i;
    }
  }
  batch.clear();
  batch.add(Vec3(0.1f, 0.1f, 0.5f), down);
  scene.intersect(batch);
  EXPECT_EQ(batch.untraced(), 0u) << "of the last query";
}

TEST(RayBatch, MeshLightsHaveNoDensityForWhatIsNoDirection) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  SceneDescription description = lit_floor(false, 0.1);
  description.shapes.push_back(
      test::light("mesh", test::sphere_mesh({0, 0, 1}, 0.3, 16, 32), Rgb(1.0f)));
  description.shapes.push_back(test::light("cube", test::cube_mesh({1, 0, 1}, 0.3), Rgb(1.0f)));
  const Scene scene(description);
  for (const Light& light : scene.lights()) {
    LightProposal proposal;
    ASSERT_TRUE(proposal.set_up(light, LightSampling::Area, Vec3(0.1f, 0.1f, -0.4f), {0, 0, 1}));
    for (const Vec3& wi : {Vec3(nan), Vec3(0.0f), Vec3(0, nan, 1)}) {
      EXPECT_EQ(proposal.pdf_w(wi), 0.0f) << light.name;
    }
  }
}

}  // namespace
}  // namespace penumbra
