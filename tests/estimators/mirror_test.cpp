// Mirrors through every registered estimator, biased ones too: no matter of chance, so every
// estimate is the reflectance times the radiance of what the mirrored ray meets, whatever the seed.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/core/trace.h"
#include "tests/support/fixtures.h"
#include "tests/support/scenes_support.h"

namespace penumbra {
namespace {

constexpr std::uint64_t kSeeds[] = {1, 77};
constexpr int kSpp = 3;
const Rgb kReflectance(0.9f, 0.6f, 0.3f);

/// A mirror floor below two lights, a black board and a ball light with a black side; its camera
/// sees the floor and, black, the board.
SceneDescription mirror_floor() {
  SceneDescription scene;
  scene.name = "mirror floor";
  scene.materials = {{"mirror", MirrorMaterial{kReflectance}}, test::lambert(0.0f, "black")};
  scene.camera = {{0, 3, 6}, {0, 0, 0}, {0, 1, 0}, 45.0, {32, 24}};
  const auto black = [](ShapeDescription shape) {
    shape.material = 1;
    return shape;
  };
  scene.shapes = {
      test::shape("floor", RectangleShape{{-6, 0, 6}, {12, 0, 0}, {0, 0, -12}}),
      black(test::light("panel", RectangleShape{{-2, 3, -4}, {2, 0, 0}, {0, 0, 2}}, Rgb(3, 2, 1))),
      black(test::light("back", RectangleShape{{1, 1, -3}, {1, 0, 0}, {0, 0, -1}}, Rgb(7, 7, 7))),
      black(test::light("lamp", SphereShape{{1, 2, -1}, 0.6}, Rgb(1, 5, 9))),
      test::shape("board", RectangleShape{{-3, 1, -1}, {2, 0, 0}, {0, 0.5, 0}}, 1)};
  return scene;
}

void add_sky(SceneDescription& scene) {
  scene.environment = EnvironmentDescription{"sky", 3, 2, {}, 20.0};
  for (int i = 0; i < 6; ++i) {
    const auto value = 0.25f * static_cast<float>(i + 1);
    scene.environment->texels.emplace_back(value, 1.0f, 2.0f - value);
  }
}

struct View {
  Scene scene;
  ShadingPoints points;

  explicit View(const SceneDescription& description, Quantity quantity = Quantity::Radiance,
                const SceneOptions& options = {})
      : scene(description, options), points(make_shading_points(scene, 1, 1, 16, quantity)) {}
};

struct Estimates {
  std::vector<Rgb> radiance;  ///< [tile][pixel][estimate]
  EstimateCounters counters;
};

Estimates estimate(const View& view, const EstimatorEntry& entry, std::uint64_t seed) {
  const Budget budget{SamplerKind::Independent, 4, entry.adaptive ? 12 : 0};
  const auto estimator = entry.create(view.scene, fixtures::params_with(entry, {}), budget);
  Estimates result;
  for (const TileRect& rect : view.points.tiles) {
    Tile tile{rect.x0,           rect.y0, rect.width, rect.height,
              view.points.width, 1,       kSpp,       view.points.of(rect)};
    std::vector<Rgb> radiance(tile.estimate_count(), Rgb(std::numeric_limits<float>::quiet_NaN()));
    TileOutput out;
    out.radiance = radiance;
    estimator->estimate(tile, seed, out);
    result.radiance.insert(result.radiance.end(), radiance.begin(), radiance.end());
    result.counters += out.counters;
  }
  return result;
}

/// What the mirrored ray of a point meets, by the scene's description.
Rgb seen_in_mirror(const SceneDescription& description, const Scene& scene,
                   const ShadingPoint& point) {
  const Vec3d n(point.shading_normal);
  const Vec3d wo(point.wo);
  const Vec3 w((n * (2.0 * n.dot(wo)) - wo).normalized());
  if (dot(w, point.geometric_normal) <= 0.0f) return Rgb(0.0f);
  const RayHit hit = test::trace(scene, point.position, w);
  if (!hit.hit()) {
    const auto& sky = description.environment;
    if (!sky) return Rgb(0.0f);
    return Environment(sky->texels, sky->columns, sky->rows, sky->rotation_deg).radiance(w);
  }
  const auto& emission = description.shapes[hit.geometry].emission;
  const bool from_front = dot(hit.normal, w) < 0.0f;
  return emission && (emission->two_sided || from_front) ? emission->radiance : Rgb(0.0f);
}

// The order of multiplication is that of the estimators: one rounding to float.
Rgb reflected(const Rgb& radiance) {
  Rgb result;
  for (int c = 0; c < 3; ++c) {
    result[c] =
        static_cast<float>(static_cast<double>(kReflectance[c]) * static_cast<double>(radiance[c]));
  }
  return result;
}

struct Expected {
  std::vector<Rgb> radiance;  ///< [point]
  std::uint64_t valid{0}, lit{0};
};

Expected expected(const SceneDescription& description, const View& view) {
  Expected result;
  for (const ShadingPoint& point : view.points.points) {
    const Rgb seen = point.valid() ? seen_in_mirror(description, view.scene, point) : Rgb(0.0f);
    result.radiance.push_back(reflected(seen));
    result.valid += point.valid() ? 1u : 0u;
    result.lit += is_black(seen) ? 0u : 1u;
  }
  return result;
}

std::uint64_t count_wrong(const Estimates& estimates, const Expected& exact) {
  std::uint64_t wrong = 0;
  for (std::size_t i = 0; i < estimates.radiance.size(); ++i) {
    wrong += estimates.radiance[i] == exact.radiance[i / kSpp] ? 0u : 1u;
  }
  return wrong;
}

/// Every estimate of every estimator and seed is exact, with one sample, and with one ray where
/// `all_traced`.
void expect_exact(const SceneDescription& description, bool all_traced = true) {
  const View view(description);
  const Expected exact = expected(description, view);
  for (const EstimatorEntry* entry : all_estimators()) {
    for (const std::uint64_t seed : kSeeds) {
      const Estimates run = estimate(view, *entry, seed);
      EXPECT_EQ(count_wrong(run, exact), 0u) << description.name << ", " << entry->name;
      const EstimateCounters& counters = run.counters;
      EXPECT_EQ(counters.estimates, kSpp * exact.valid) << entry->name;
      EXPECT_EQ(counters.samples, counters.estimates) << entry->name;
      EXPECT_EQ(counters.lit, kSpp * exact.lit) << entry->name;
      EXPECT_LE(counters.rays, counters.samples) << entry->name;
      if (all_traced) {
        EXPECT_EQ(counters.rays, counters.samples) << entry->name;
      }
    }
  }
}

// How many points see something of each kind, so that the tests above it are about all of them.
std::uint64_t count_seeing(const SceneDescription& description, const Rgb& radiance) {
  const View view(description);
  const Expected exact = expected(description, view);
  return static_cast<std::uint64_t>(
      std::count(exact.radiance.begin(), exact.radiance.end(), reflected(radiance)));
}

TEST(Mirrors, ShowLightsAndBlackExactly) {
  const SceneDescription scene = mirror_floor();
  for (const Rgb& seen : {Rgb(3, 2, 1), Rgb(1, 5, 9), Rgb(0.0f)}) {
    EXPECT_GT(count_seeing(scene, seen), 10u) << seen.x;
  }
  EXPECT_EQ(count_seeing(scene, Rgb(7, 7, 7)), 0u) << "a light seen from behind";
  expect_exact(scene);
}

TEST(Mirrors, ShowTheSkyWhereTheyMeetNothing) {
  SceneDescription scene = mirror_floor();
  add_sky(scene);
  expect_exact(scene);
}

TEST(Mirrors, ShowTheSameWhereAllIsKept) {
  const SceneDescription description = mirror_floor();
  const Expected exact = expected(description, View(description));
  const View kept(description, Quantity::Radiance, SceneOptions{true});
  for (const EstimatorEntry* entry : all_estimators()) {
    EXPECT_EQ(count_wrong(estimate(kept, *entry, kSeeds[0]), exact), 0u) << entry->name;
  }
}

TEST(Mirrors, DoNotShowLightsWithoutExtent) {
  SceneDescription scene = mirror_floor();
  for (ShapeDescription& shape : scene.shapes) shape.emission.reset();
  scene.point_lights = {{"bulb", {0, 2, -2}, Rgb(5.0f)}};
  scene.spot_lights = {{"spot", {0, 3, -3}, {0, -1, 0}, Vec3d(5.0), 30, 60}};
  scene.directional_lights = {{"sun", {0, -3, 6}, Rgb(4.0f)}};
  EXPECT_EQ(expected(scene, View(scene)).lit, 0u);
  expect_exact(scene);
}

TEST(Mirrors, FollowInterpolatedNormals) {
  SceneDescription scene = mirror_floor();
  add_sky(scene);
  TriangleMeshShape ball = test::sphere_mesh({0, 1.2, 1.5}, 1.2, 5, 6);
  for (const Vec3d& vertex : ball.vertices) {
    ball.normals.push_back(Vec3(vertex - Vec3d(0, 1.2, 1.5)));
  }
  ball.normals[3] = Vec3(0.0f);  // a vertex without a normal
  scene.shapes.push_back(test::shape("ball", ball));
  const View view(scene);
  const auto below = std::count_if(
      view.points.points.begin(), view.points.points.end(), [](const ShadingPoint& p) {
        const Vec3 w = p.shading_normal * (2.0f * dot(p.shading_normal, p.wo)) - p.wo;
        return p.valid() && dot(w, p.geometric_normal) <= 0.0f;
      });
  EXPECT_GT(below, 0) << "normals that mirror into the surface";
  expect_exact(scene, false);
}

// Irradiance does not ask for the material, so a mirror has the bits of a diffuse surface.
TEST(Mirrors, HaveTheIrradianceOfAnySurface) {
  const SceneDescription mirror = mirror_floor();
  SceneDescription diffuse = mirror;
  diffuse.materials[0].model = LambertMaterial{Rgb(0.5f)};
  const View a(mirror, Quantity::Irradiance);
  const View b(diffuse, Quantity::Irradiance);
  for (const EstimatorEntry* entry : all_estimators()) {
    const Estimates of_mirror = estimate(a, *entry, 1);
    const Estimates of_diffuse = estimate(b, *entry, 1);
    EXPECT_TRUE(of_mirror.radiance == of_diffuse.radiance) << entry->name;
    EXPECT_EQ(of_mirror.counters.rays, of_diffuse.counters.rays) << entry->name;
    const auto lit = std::count_if(of_mirror.radiance.begin(), of_mirror.radiance.end(),
                                   [](const Rgb& e) { return e.x > 0.0f; });
    EXPECT_GT(lit, 100) << entry->name;
  }
}

}  // namespace
}  // namespace penumbra
