#include "scenes/core/ray_batch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "scenes/core/frame.h"
#include "scenes/core/light.h"
#include "scenes/core/scene.h"
#include "scenes/core/warp.h"
#include "tests/core/trace.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using test::to_scene;
using test::trace;

// All statistical checks of this file together (fewer than 20) raise a false alarm with probability
// 1e-4.
const double kLevel = test::sidak(1e-4, 20);

std::int32_t light_index(const Scene& scene, const std::string& name) {
  for (std::size_t i = 0; i < scene.lights().size(); ++i) {
    if (scene.lights()[i].name == name) return static_cast<std::int32_t>(i);
  }
  return kNoLight;
}

struct Soup {
  std::vector<Vec3> triangles, quads;  // corners in a row
  std::vector<Vec3> centers;
  std::vector<float> radii;
};

Soup random_soup(test::TestRandom& random) {
  Soup soup;
  const auto point = [&] {
    return Vec3(static_cast<float>(random.uniform(-2, 2)),
                static_cast<float>(random.uniform(-2, 2)),
                static_cast<float>(random.uniform(-2, 2)));
  };
  for (int i = 0; i < 150; ++i) {
    const Vec3 o = point();
    soup.triangles.insert(soup.triangles.end(),
                          {o, o + random.direction() * 0.7f, o + random.direction() * 0.7f});
  }
  for (int i = 0; i < 80; ++i) {  // not flat: the two halves are told apart
    const Vec3 o = point();
    const Vec3 u = random.direction() * 0.6f;
    const Vec3 v = cross(u, random.direction()).normalized() * 0.6f;
    soup.quads.insert(soup.quads.end(), {o, o + u, o + u + v + random.direction() * 0.1f, o + v});
  }
  for (int i = 0; i < 20; ++i) {
    soup.centers.push_back(point());
    soup.radii.push_back(static_cast<float>(random.uniform(0.05, 0.4)));
  }
  return soup;
}

struct Closest {
  std::uint32_t geometry{RayHit::kMiss}, primitive{0};
  double distance{1e30};
  double margin{
      0};  // of the barycentric coordinates to the border: next to 0 the hit is open to dispute
  Vec3d normal{0.0};
};

void try_triangle(const Vec3d& o, const Vec3d& d, const Vec3d& a, const Vec3d& b, const Vec3d& c,
                  std::uint32_t geometry, std::uint32_t primitive, Closest& best,
                  double& nearest_border) {
  const Vec3d n = (b - a).cross(c - a);
  const double t = n.dot(a - o) / n.dot(d);
  if (!(t > 0.0)) return;
  const Vec3d p = o + d * t;
  const double inv = 1.0 / n.dot(n);
  const double v0 = (c - b).cross(p - b).dot(n) * inv;
  const double v1 = (a - c).cross(p - c).dot(n) * inv;
  const double v2 = (b - a).cross(p - a).dot(n) * inv;
  const double margin = std::min({v0, v1, v2});
  if (t < best.distance * 1.00001) nearest_border = std::min(nearest_border, std::abs(margin));
  if (margin >= 0.0 && t < best.distance) best = {geometry, primitive, t, margin, n};
}

Closest brute_force(const Soup& soup, const Vec3& origin, const Vec3& direction,
                    double& nearest_border) {
  const Vec3d o(origin);
  const Vec3d d(direction);
  Closest best;
  nearest_border = 1.0;
  for (std::size_t i = 0; i < soup.triangles.size(); i += 3) {
    const auto* p = &soup.triangles[i];
    try_triangle(o, d, Vec3d(p[0]), Vec3d(p[1]), Vec3d(p[2]), 0, static_cast<std::uint32_t>(i / 3),
                 best, nearest_border);
  }
  for (std::size_t i = 0; i < soup.quads.size(); i += 4) {
    const auto* p = &soup.quads[i];
    const auto id = static_cast<std::uint32_t>(i / 4);
    try_triangle(o, d, Vec3d(p[0]), Vec3d(p[1]), Vec3d(p[3]), 1, id, best, nearest_border);
    try_triangle(o, d, Vec3d(p[2]), Vec3d(p[3]), Vec3d(p[1]), 1, id, best, nearest_border);
  }
  for (std::size_t i = 0; i < soup.centers.size(); ++i) {
    const Vec3d m = o - Vec3d(soup.centers[i]);
    const double r = double{soup.radii[i]};
    const double b = m.dot(d) / d.dot(d);
    const double discriminant = b * b - (m.dot(m) - r * r) / d.dot(d);
    if (std::abs(discriminant) < 1e-5) nearest_border = 0.0;
    if (discriminant < 0.0) continue;
    for (const double t : {-b - std::sqrt(discriminant), -b + std::sqrt(discriminant)}) {
      if (!(t > 0.0)) continue;
      if (t < best.distance) best = {static_cast<std::uint32_t>(2 + i), 0, t, 1.0, m + d * t};
      break;
    }
  }
  return best;
}

TEST(RayScene, ClosestHitsEqualBruteForce) {
  test::TestRandom random;
  const Soup soup = random_soup(random);
  RayScene rays;
  const auto indices = [](std::size_t n) {
    std::vector<std::uint32_t> v(n);
    for (std::uint32_t i = 0; i < n; ++i) v[i] = i;
    return v;
  };
  ASSERT_EQ(rays.add_triangles(soup.triangles, indices(soup.triangles.size())), 0u);
  ASSERT_EQ(rays.add_quads(soup.quads, indices(soup.quads.size())), 1u);
  for (std::size_t i = 0; i < soup.centers.size(); ++i) {
    ASSERT_EQ(rays.add_sphere(soup.centers[i], soup.radii[i]), 2 + i);
  }
  rays.commit();
  EXPECT_GT(rays.memory_bytes(), 0u);

  constexpr std::size_t kRays = 20003;  // not a multiple of the packet's width
  RayBatch batch(kRays);
  for (std::size_t i = 0; i < kRays; ++i)
    batch.add(random.direction() * static_cast<float>(random.uniform(0, 4)), random.direction());
  rays.intersect(batch);
  int hits = 0;
  int disputed = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    double border = 1.0;
    const Closest exact = brute_force(soup, batch.origin(i), batch.direction(i), border);
    const RayHit& hit = batch.hits[i];
    hits += hit.hit() ? 1 : 0;
    if (hit.geometry != exact.geometry ||
        (hit.hit() && hit.geometry < 2 && hit.primitive != exact.primitive)) {
      ++disputed;
      const double gap = std::abs(double{hit.distance} - exact.distance);
      EXPECT_TRUE(border < 1e-4 || (hit.hit() && gap < 1e-4))
          << "ray " << i << ": " << hit.geometry << " for " << exact.geometry;
      continue;
    }
    if (!hit.hit()) continue;
    ASSERT_NEAR(double{hit.distance}, exact.distance,
                1e-5 * (1.0 + exact.distance) + (border < 1e-3 ? 1e-3 : 0.0))
        << i;
    ASSERT_GT(Vec3d(hit.normal).normalized().dot(exact.normal.normalized()),
              hit.geometry == 1 && border < 1e-4 ? 0.5 : 0.999)
        << "orientation of geometry " << hit.geometry;
    if (hit.geometry != 0) continue;
    const auto* p = &soup.triangles[std::size_t{hit.primitive} * 3];
    const Vec3 by_uv = p[0] * (1.0f - hit.u - hit.v) + p[1] * hit.u + p[2] * hit.v;
    const Vec3 by_distance = batch.origin(i) + batch.direction(i) * hit.distance;
    // Nearly edge-on triangles magnify roundings in the plane.
    const float slope = std::abs(dot(hit.normal.normalized(), batch.direction(i)));
    ASSERT_LT((by_uv - by_distance).length(), 1e-5f + 2e-6f / slope) << i;
  }
  EXPECT_GT(hits, static_cast<int>(kRays) / 3);
  EXPECT_LT(disputed, 20);
}

TEST(RayScene, PaddingLanesAndReusedBatchesDoNotMatter) {
  test::TestRandom random;
  const Scene scene(test::small_scene());
  RayBatch large(64);
  for (int i = 0; i < 64; ++i) large.add(random.direction() * 2.0f, random.direction());
  scene.intersect(large);
  RayBatch reused(64);
  for (std::size_t size = 1; size <= 20; ++size) {
    reused.clear();
    for (std::size_t i = 0; i < size; ++i) reused.add(large.origin(i), large.direction(i));
    scene.intersect(reused);
    for (std::size_t i = 0; i < size; ++i) {
      EXPECT_EQ(reused.hits[i].geometry, large.hits[i].geometry);
      EXPECT_EQ(reused.hits[i].distance, large.hits[i].distance);
    }
  }
}

TEST(Scene, EmitterFollowsTheFrontSideOfEveryLight) {
  for (const bool two_sided : {false, true}) {
    SceneDescription description = test::small_scene();
    for (ShapeDescription& shape : description.shapes) {
      if (shape.emission) shape.emission->two_sided = two_sided;
    }
    const Scene scene(description);
    const std::int32_t panel = light_index(scene, "panel");
    const std::int32_t cube = light_index(scene, "cube");
    const std::int32_t ball = light_index(scene, "ball");
    struct Case {
      Vec3d from;
      Vec3 direction;
      std::int32_t light;
      bool front;
    };
    const std::vector<Case> cases = {
        {{0.2, 2, 0.1}, {0, 1, 0}, panel, true},         {{0.2, 4, 0.1}, {0, -1, 0}, panel, false},
        {{2, 0.5, 3}, {0, 0, -1}, cube, true},           {{2, 0.5, 0}, {0, 0, -1}, cube, false},
        {{2.05, 3, 0.1}, {0, -1, 0}, cube, true},        {{5, 0.55, 0.1}, {-1, 0, 0}, cube, true},
        {{0.5, 0.75, 4}, {0, 0, -1}, ball, true},        {{0.5, 0.75, 1}, {0, 0, -1}, ball, false},
        {{0.6, 0.75, 1.1}, {0.6f, 0.8f, 0}, ball, false}};
    for (const Case& c : cases) {
      const Vec3 from = to_scene(scene, c.from);
      const RayHit hit = trace(scene, from, c.direction);
      ASSERT_TRUE(hit.hit());
      EXPECT_EQ(scene.emitter(hit, c.direction), c.front || two_sided ? c.light : kNoLight)
          << c.from << c.direction;
      EXPECT_EQ(scene.shading_point(hit, from, c.direction).light, scene.emitter(hit, c.direction));
    }
    const Light& light = scene.lights()[static_cast<std::size_t>(panel)];
    EXPECT_LT((light.normal - Vec3(0, -1, 0)).length(), 1e-6f) << "edge_u x edge_v";
    EXPECT_EQ(light.emits_against({0, 1, 0}, light.normal), true);
    EXPECT_EQ(light.emits_against({0, -1, 0}, light.normal), two_sided);
    EXPECT_EQ(scene.emitter(RayHit{}, {0, 1, 0}), kNoLight);
  }
}

TEST(Scene, DirectionsSampledTowardsALightMeetIt) {
  test::TestRandom random;
  const Scene scene(test::small_scene());
  const Vec3 from = to_scene(scene, {1.0, 1.5, 2.5});
  for (std::size_t i = 0; i < scene.lights().size(); ++i) {
    LightProposal proposal;
    ASSERT_TRUE(
        proposal.set_up(scene.lights()[i], LightSampling::SolidAngle, from, Vec3(0, 1, 0)) ||
        proposal.set_up(scene.lights()[i], LightSampling::SolidAngle, from, Vec3(0, -1, 0)));
    int missed = 0;
    for (int k = 0; k < 2000; ++k) {
      const auto sample = proposal.sample(random.variates());
      ASSERT_TRUE(sample.has_value());
      const RayHit hit = trace(scene, from, sample->wi);
      missed += scene.emitter(hit, sample->wi) == static_cast<std::int32_t>(i) ? 0 : 1;
    }
    EXPECT_LE(missed, 2) << scene.lights()[i].name;
  }
}

// Share of rays from points of a convex body into the hemisphere outside that hit the body.
double self_hits(const SceneDescription& description, int rays, bool offset) {
  test::TestRandom random;
  const Scene scene(description);
  RayBatch batch(static_cast<std::size_t>(rays));
  while (batch.size() < batch.capacity()) {
    const Vec3 origin = random.direction() * 8.0f;
    const Vec3 direction = (random.direction() * 0.9f - origin).normalized();
    const RayHit hit = trace(scene, origin, direction);
    if (!hit.hit()) continue;
    const ShadingPoint p = scene.shading_point(hit, origin, direction);
    const float cosine =
        static_cast<float>(random.uniform() < 0.5 ? random.uniform() : random.uniform() * 1e-3);
    const double phi = random.uniform(0.0, 6.28);
    const double r = std::sqrt(1.0 - double{cosine} * double{cosine});
    const Vec3 local(static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)),
                     cosine);
    batch.add(offset ? p.position : origin + direction * hit.distance,
              Frame(p.geometric_normal).to_world(local));
  }
  scene.intersect(batch);
  int hits = 0;
  for (std::size_t i = 0; i < batch.size(); ++i) hits += batch.hits[i].hit() ? 1 : 0;
  return static_cast<double>(hits) / rays;
}

SceneDescription convex_body(Shape shape) {
  SceneDescription description;
  description.materials = {test::lambert(0.5f)};
  description.shapes = {test::shape("body", std::move(shape))};
  return description;
}

TEST(SelfIntersectionLong, OutwardRaysOfAConvexBodyNeverHitIt) {
  for (const double scale : {1e-5, 1.0, 1e6}) {
    // A small body's offset is in its own sizes: at 1e6 the doubles of the description round it to
    // 1e-5.
    for (const double shift : {0.0, 1e6 * std::min(scale, 1.0)}) {
      const Vec3d center(shift, -shift, 0.5 * shift);
      EXPECT_EQ(self_hits(convex_body(test::sphere_mesh(center, scale, 24, 48)), 100000, true), 0.0)
          << "scale " << scale << " offset " << shift;
    }
  }
}

TEST(SelfIntersection, OutwardRaysOfConvexBodiesNeverHitThem) {
  EXPECT_EQ(self_hits(convex_body(test::sphere_mesh({0, 0, 0}, 1.0, 24, 48)), 20000, true), 0.0);
  EXPECT_EQ(self_hits(convex_body(test::cube_mesh({1e6, 0, 0}, 1.0)), 20000, true), 0.0);
  EXPECT_EQ(self_hits(convex_body(SphereShape{{3, 4, 5}, 0.01}), 20000, true), 0.0);
}

TEST(SelfIntersection, PointsWithoutTheOffsetDoHitTheirOwnSurface) {  // negative control
  EXPECT_GT(self_hits(convex_body(test::sphere_mesh({0, 0, 0}, 1.0, 24, 48)), 20000, false), 0.05);
}

TEST(SelfIntersection, SealedBoxLetsNoRayOut) {
  SceneDescription description = convex_body(test::cube_mesh({0, 0, 0}, 2.0));
  description.shapes.push_back(test::light("sun", SphereShape{{0, 0, 3}, 1.0}, Rgb(1.0f)));
  const Scene scene(description);
  test::TestRandom random;
  RayBatch batch(100000);
  const Vec3 inside = to_scene(scene, {0.1, 0.2, 0.3});
  while (batch.size() < batch.capacity()) {
    const Vec3 direction = random.direction();
    const ShadingPoint p = scene.shading_point(trace(scene, inside, direction), inside, direction);
    batch.add(p.position, (random.direction() + p.geometric_normal * 1.001f).normalized());
  }
  scene.intersect(batch);
  int leaks = 0;
  for (std::size_t i = 0; i < batch.size(); ++i) leaks += batch.hits[i].geometry == 0 ? 0 : 1;
  EXPECT_EQ(leaks, 0);
}

TEST(Scene, IrradianceThroughRaysIsLambertsPolygonFormula) {
  SceneDescription description = test::small_scene();
  description.shapes.resize(2);  // floor and panel
  const Scene scene(description);
  const Vec3 direction(0.6f, -0.8f, 0.0f);
  const Vec3 from = to_scene(scene, {-1, 2, 0.5});
  const ShadingPoint p = scene.shading_point(trace(scene, from, direction), from, direction);
  ASSERT_TRUE(p.valid());
  test::TestRandom random;
  test::Moments moments;
  RayBatch batch(200000);
  while (batch.size() < batch.capacity()) {
    batch.add(p.position,
              Frame(p.geometric_normal).to_world(sample_cosine_hemisphere(random.variates().u)));
  }
  scene.intersect(batch);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    moments.add(scene.emitter(batch.hits[i], batch.direction(i)) == 0 ? std::numbers::pi : 0.0);
  }
  const double exact =
      test::rectangle_irradiance(scene.lights()[0], p.position, p.geometric_normal);
  EXPECT_LT(moments.z(exact), test::z_bound(kLevel)) << moments.mean() << " for " << exact;
  EXPECT_GT(moments.z(1.1 * exact), test::z_bound(kLevel)) << "negative control";
}

}  // namespace
}  // namespace penumbra
