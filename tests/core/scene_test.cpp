#include "scenes/core/scene.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "scenes/core/error.h"
#include "scenes/core/frame.h"
#include "scenes/core/normalise.h"
#include "scenes/core/warp.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

// All statistical checks of this file together (fewer than 20) raise a false alarm with probability
// 1e-4.
const double kLevel = test::sidak(1e-4, 20);

// World to scene coordinates.
Vec3 to_scene(const Scene& scene, const Vec3d& world) {
  return Vec3((world - scene.traits().center) * scene.traits().scale);
}

RayHit trace(const Scene& scene, const Vec3& origin, const Vec3& direction) {
  RayBatch batch(1);
  batch.add(origin, direction);
  scene.intersect(batch);
  return batch.hits[0];
}

std::int32_t light_index(const Scene& scene, const std::string& name) {
  for (std::size_t i = 0; i < scene.lights().size(); ++i) {
    if (scene.lights()[i].name == name) return static_cast<std::int32_t>(i);
  }
  return kNoLight;
}

// ---- Embree against brute force

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

// ---- Emission and orientation

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
      const RayHit hit = trace(scene, to_scene(scene, c.from), c.direction);
      ASSERT_TRUE(hit.hit());
      EXPECT_EQ(scene.emitter(hit, c.direction), c.front || two_sided ? c.light : kNoLight)
          << c.from << c.direction;
      EXPECT_EQ(scene.shading_point(hit, c.direction).light, scene.emitter(hit, c.direction));
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

// ---- Shading points

TEST(Scene, ShadingPointsLieOnTheRayAndFaceTheViewer) {
  test::TestRandom random;
  const Scene scene(test::small_scene());
  int points = 0;
  int backs = 0;
  for (int i = 0; i < 30000; ++i) {
    const Vec3 origin = random.direction() * 1.5f;
    const Vec3d target(random.uniform(-1.0, 1.0), random.uniform(-0.4, 0.4),
                       random.uniform(-1.0, 1.0));
    const Vec3 direction = (Vec3(target) - origin).normalized();
    const RayHit hit = trace(scene, origin, direction);
    if (!hit.hit()) continue;
    const ShadingPoint p = scene.shading_point(hit, direction);
    const Vec3 on_ray = origin + direction * hit.distance;
    const float slope = -dot(p.geometric_normal, direction);
    ASSERT_GE(slope, 0.0f);
    ASSERT_LT((p.position - on_ray).length(), 2e-4f + 4e-6f / slope) << "u+v=" << hit.u + hit.v;
    ASSERT_NEAR(p.geometric_normal.length(), 1.0f, 1e-6f);
    ASSERT_GT(std::abs(dot(p.geometric_normal, hit.normal.normalized())), 0.9999f);
    ASSERT_EQ(p.shading_normal, p.geometric_normal);
    ASSERT_EQ(p.wo, -direction);
    // The offset goes to the side of the viewer.
    ASSERT_GT(dot(p.position - on_ray, p.geometric_normal), -4e-6f);
    backs += dot(hit.normal, direction) > 0.0f ? 1 : 0;
    ++points;
  }
  EXPECT_GT(points, 10000);
  EXPECT_GT(backs, 500);
}

TEST(Scene, SecondHalfOfAQuadrilateralHasItsOwnPlane) {
  SceneDescription description;
  description.materials = {test::lambert(0.5f)};
  QuadMeshShape quads;
  quads.vertices = {{-1, 0, 1}, {1, 0, 1}, {1, 0.5, -1}, {-1, 0, -1}};
  quads.quads = {{0, 1, 2, 3}};
  description.shapes = {test::shape("bent", quads)};
  const Scene scene(description);
  test::TestRandom random;
  int halves[2] = {0, 0};
  for (int i = 0; i < 5000; ++i) {
    const Vec3d target(random.uniform(-0.99, 0.99), 0.0, random.uniform(-0.99, 0.99));
    if (std::abs(target.x - target.z) < 1e-3) continue;  // the diagonal 1-3 is x = z
    const Vec3 down(0, -1, 0);
    const RayHit hit = trace(scene, to_scene(scene, target + Vec3d(0, 2, 0)), down);
    ASSERT_TRUE(hit.hit());
    const ShadingPoint p = scene.shading_point(hit, down);
    const bool second = target.x > target.z;
    ++halves[second ? 1 : 0];
    // First half: the plane y = 0. Second half: y = (x - z)/4 through (1, 0, 1), (1, 1/2, -1), (-1,
    // 0, -1).
    const double height = second ? (target.x - target.z) / 4.0 : 0.0;
    const Vec3d normal = second ? Vec3d(-1, 4, 1).normalized() : Vec3d(0, 1, 0);
    const Vec3 expected = to_scene(scene, {target.x, height, target.z});
    ASSERT_LT((p.position - expected).length(), 1e-4f) << target;
    ASSERT_LT((p.geometric_normal - Vec3(normal)).length(), 1e-5f) << target;
  }
  EXPECT_GT(halves[0], 1000);
  EXPECT_GT(halves[1], 1000);
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
    const ShadingPoint p = scene.shading_point(hit, direction);
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
    const ShadingPoint p = scene.shading_point(trace(scene, inside, direction), direction);
    batch.add(p.position, (random.direction() + p.geometric_normal * 1.001f).normalized());
  }
  scene.intersect(batch);
  int leaks = 0;
  for (std::size_t i = 0; i < batch.size(); ++i) leaks += batch.hits[i].geometry == 0 ? 0 : 1;
  EXPECT_EQ(leaks, 0);
}

// ---- Analytic scene

TEST(Scene, IrradianceThroughRaysIsLambertsPolygonFormula) {
  SceneDescription description = test::small_scene();
  description.shapes.resize(2);  // floor and panel
  const Scene scene(description);
  const Vec3 direction(0.6f, -0.8f, 0.0f);
  const ShadingPoint p =
      scene.shading_point(trace(scene, to_scene(scene, {-1, 2, 0.5}), direction), direction);
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

// ---- Normalisation, hash, camera and the points of an image: exact claims

void transform(SceneDescription& scene, double factor, const Vec3d& shift) {
  const auto point = [&](Vec3d& p) { p = p * factor + shift; };
  point(scene.camera.position);
  point(scene.camera.look_at);
  for (ShapeDescription& s : scene.shapes) {
    if (auto* r = std::get_if<RectangleShape>(&s.shape)) {
      point(r->origin);
      r->edge_u *= factor;
      r->edge_v *= factor;
    } else if (auto* b = std::get_if<SphereShape>(&s.shape)) {
      point(b->center);
      b->radius *= factor;
    } else if (auto* m = std::get_if<TriangleMeshShape>(&s.shape)) {
      for (Vec3d& v : m->vertices) point(v);
    } else {
      for (Vec3d& v : std::get<QuadMeshShape>(s.shape).vertices) point(v);
    }
  }
}

bool same(const ShadingPoint& a, const ShadingPoint& b) {
  return a.position == b.position && a.geometric_normal == b.geometric_normal &&
         a.shading_normal == b.shading_normal && a.wo == b.wo && a.material == b.material &&
         a.light == b.light;
}

::testing::AssertionResult same(const ShadingPoints& a, const ShadingPoints& b) {
  if (a.points.size() != b.points.size() || a.valid_count != b.valid_count) {
    return ::testing::AssertionFailure() << "sizes differ";
  }
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    if (!same(a.points[i], b.points[i])) {
      return ::testing::AssertionFailure()
             << "point " << i << ": " << a.points[i].position << " and " << b.points[i].position;
    }
  }
  return ::testing::AssertionSuccess();
}

TEST(Normalisation, PowersOfTwoAndTranslationsGiveTheSameBits) {
  const SceneDescription original = test::small_scene();
  const Scene scene(original);
  const ShadingPoints points = make_shading_points(scene, 4, 1, 16);
  EXPECT_GT(points.valid_count, points.points.size() / 2);
  for (const int k : {-17, -3, 1, 20}) {
    for (const Vec3d& shift : {Vec3d(0, 0, 0), Vec3d(1024, -512, 1 << 20)}) {
      SceneDescription changed = original;
      transform(changed, std::ldexp(1.0, k), shift * std::ldexp(1.0, std::max(k, -3)));
      const Scene other(changed);
      EXPECT_TRUE(same(points, make_shading_points(other, 4, 1, 16)))
          << "2^" << k << " shift " << shift;
      EXPECT_EQ(other.traits().scale * std::ldexp(1.0, k), scene.traits().scale);
      EXPECT_EQ(other.traits().diagonal, scene.traits().diagonal);
      ASSERT_EQ(other.lights().size(), scene.lights().size());
      for (std::size_t i = 0; i < scene.lights().size(); ++i) {
        EXPECT_EQ(other.lights()[i].radiance, scene.lights()[i].radiance);
        EXPECT_EQ(other.lights()[i].area, scene.lights()[i].area);
      }
    }
  }
}

TEST(Normalisation, AnyUnitGivesADiagonalOfOrderOneByAPowerOfTwo) {
  for (const double factor : {1e-5, 0.3, 1.0, 7.0, 1e6}) {
    SceneDescription scene = test::small_scene();
    transform(scene, factor, Vec3d(3.0, -2e3 * factor, 0.0));
    const Normalisation n = normalise(scene);
    int exponent = 0;
    EXPECT_EQ(std::frexp(n.scale, &exponent), 0.5) << factor;
    EXPECT_GT(n.diagonal, 2.8) << factor;
    EXPECT_LT(n.diagonal, 5.7) << factor;
  }
}

TEST(ContentHash, ChangesWithEverythingThatDecidesTheImage) {
  using Change = std::function<void(SceneDescription&)>;
  const auto material = [](auto model) {
    return Change([model](SceneDescription& s) { s.materials[1].model = model; });
  };
  const std::vector<Change> changes = {
      [](auto& s) { s.camera.position.x += 1e-9; },
      [](auto& s) { s.camera.look_at.y += 1e-9; },
      [](auto& s) { s.camera.up.z += 1e-9; },
      [](auto& s) { s.camera.vertical_fov_deg += 1e-9; },
      [](auto& s) { s.camera.resolution[0] += 1; },
      [](auto& s) { s.camera.resolution[1] += 1; },
      [](auto& s) { std::get<LambertMaterial>(s.materials[0].model).reflectance.y = 0.50001f; },
      material(LambertMaterial{Rgb(0.2f)}),
      material(ConductorMaterial{Rgb(0.3f), Rgb(3.9f), 0.1f, Rgb(1.0f)}),
      material(ConductorMaterial{Rgb(0.2f), Rgb(3.8f), 0.1f, Rgb(1.0f)}),
      material(ConductorMaterial{Rgb(0.2f), Rgb(3.9f), 0.2f, Rgb(1.0f)}),
      material(ConductorMaterial{Rgb(0.2f), Rgb(3.9f), 0.1f, Rgb(0.9f)}),
      material(PhongMaterial{}),
      material(PhongMaterial{Rgb(0.5f), Rgb(0.1f), 20.0f}),
      material(PhongMaterial{Rgb(0.5f), Rgb(0.0f), 21.0f}),
      material(MixtureMaterial{}),
      material(MixtureMaterial{{}, {}, 0.25f}),
      material(MixtureMaterial{{Rgb(0.1f)}, {}, 0.5f}),
      [](auto& s) { s.shapes[0].material = 1; },
      [](auto& s) { std::get<RectangleShape>(s.shapes[0].shape).origin.x += 1e-9; },
      [](auto& s) { std::get<RectangleShape>(s.shapes[0].shape).edge_u.x += 1e-9; },
      [](auto& s) { std::get<RectangleShape>(s.shapes[0].shape).edge_v.z += 1e-9; },
      [](auto& s) { std::get<TriangleMeshShape>(s.shapes[2].shape).vertices[3].y += 1e-9; },
      [](auto& s) {
        std::swap(std::get<TriangleMeshShape>(s.shapes[2].shape).triangles[0][1],
                  std::get<TriangleMeshShape>(s.shapes[2].shape).triangles[0][2]);
      },
      [](auto& s) { std::get<SphereShape>(s.shapes[3].shape).center.z += 1e-9; },
      [](auto& s) { std::get<SphereShape>(s.shapes[3].shape).radius += 1e-9; },
      [](auto& s) { std::get<QuadMeshShape>(s.shapes[4].shape).vertices[2].z += 1e-9; },
      [](auto& s) {
        std::get<QuadMeshShape>(s.shapes[4].shape).quads[0] = {1, 2, 3, 0};
      },
      [](auto& s) { s.shapes[1].emission->radiance.z = 2.0001f; },
      [](auto& s) { s.shapes[1].emission->two_sided = true; },
      [](auto& s) { s.shapes[1].emission.reset(); },
      [](auto& s) { s.shapes[0].emission = EmissionDescription{}; },
      [](auto& s) { s.shapes.pop_back(); },
      [](auto& s) { s.shapes.push_back(s.shapes[0]); },
      [](auto& s) { std::swap(s.shapes[0], s.shapes[4]); }};
  std::set<std::string> hashes = {content_hash(test::small_scene())};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    SceneDescription scene = test::small_scene();
    changes[i](scene);
    EXPECT_TRUE(hashes.insert(content_hash(scene)).second) << "change " << i;
  }
}

TEST(ContentHash, DoesNotChangeWithNamesAndIsThatOfTheScene) {
  SceneDescription scene = test::small_scene();
  const std::string hash = content_hash(scene);
  EXPECT_EQ(hash.size(), 32u);
  EXPECT_EQ(hash.find_first_not_of("0123456789abcdef"), std::string::npos);
  scene.name = "other";
  scene.summary = "text";
  scene.warnings = {"text"};
  scene.materials[0].name = "white";
  scene.shapes[1].name = "lamp";
  EXPECT_EQ(content_hash(scene), hash);
  EXPECT_EQ(Scene(scene).content_hash(), hash);
}

TEST(Camera, CentreRayGoesThroughLookAtAndTheImageStandsUpright) {
  SceneDescription description = test::small_scene();
  description.camera.resolution = {64, 48};
  description.camera.vertical_fov_deg = 50.0;
  const Scene scene(description);
  const Camera& camera = scene.camera();
  const auto w = static_cast<float>(camera.width());
  const auto h = static_cast<float>(camera.height());
  const Vec3d ahead = (description.camera.look_at - description.camera.position).normalized();
  EXPECT_LT((camera.direction(w / 2, h / 2) - Vec3(ahead)).length(), 2e-7f);
  const Vec3d right = ahead.cross(description.camera.up).normalized();
  EXPECT_GT(Vec3d(camera.direction(w, h / 2)).dot(right), 0.0);
  EXPECT_GT(Vec3d(camera.direction(w / 2, 0)).dot(right.cross(ahead)), 0.0) << "y goes downwards";
  const float cosine = dot(camera.direction(w / 2, 0), camera.direction(w / 2, h));
  EXPECT_NEAR(std::acos(double{cosine}) * 180.0 / M_PI, 50.0, 1e-4);
  // Square pixels: half the width over half the height in tangents is the aspect ratio.
  const auto tangent = [&](float x, float y) {
    const double c = Vec3d(camera.direction(x, y)).dot(ahead);
    return std::sqrt(1.0 - c * c) / c;
  };
  EXPECT_NEAR(tangent(w, h / 2) / tangent(w / 2, h), 64.0 / 48.0, 1e-5);
}

TEST(ShadingPoints, OneSampleIsThePixelsCentre) {
  const Scene scene(test::small_scene());
  const ShadingPoints points = make_shading_points(scene, 1, 99, 7);
  std::size_t valid = 0;
  std::set<int> seen;
  for (const TileRect& tile : points.tiles) {
    const auto span = points.of(tile);
    for (std::size_t i = 0; i < span.size(); ++i) {
      const int x = tile.x0 + static_cast<int>(i) % tile.width;
      const int y = tile.y0 + static_cast<int>(i) / tile.width;
      EXPECT_TRUE(seen.insert(y * points.width + x).second);
      EXPECT_EQ(span[i].wo, -scene.camera().direction(static_cast<float>(x) + 0.5f,
                                                      static_cast<float>(y) + 0.5f));
      valid += span[i].valid() ? 1 : 0;
    }
  }
  EXPECT_EQ(seen.size(), static_cast<std::size_t>(points.width * points.height));
  EXPECT_EQ(valid, points.valid_count);
}

TEST(ShadingPoints, AreTheSameOnAnyNumberOfThreads) {
  const Scene scene(test::small_scene());
  std::optional<ShadingPoints> first;
  for (const std::size_t threads : {1u, 2u, 5u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    ShadingPoints points = make_shading_points(scene, 3, 42, 8);
    if (first) {
      EXPECT_TRUE(same(*first, points)) << threads << " threads";
    } else {
      first = std::move(points);
    }
  }
  EXPECT_FALSE(same(*first, make_shading_points(scene, 3, 43, 8))) << "another seed";
}

TEST(ShadingPoints, DoNotDependOnTheTilesSide) {
  const Scene scene(test::small_scene());
  constexpr std::size_t kSamples = 3;
  const auto by_pixel = [&](int tile_side) {
    const ShadingPoints points = make_shading_points(scene, kSamples, 7, tile_side);
    std::vector<ShadingPoint> image(points.points.size());
    for (const TileRect& tile : points.tiles) {
      const auto span = points.of(tile);
      for (std::size_t i = 0; i < span.size(); ++i) {
        const std::size_t x =
            static_cast<std::size_t>(tile.x0) + i / kSamples % static_cast<std::size_t>(tile.width);
        const std::size_t y =
            static_cast<std::size_t>(tile.y0) + i / kSamples / static_cast<std::size_t>(tile.width);
        image[(y * static_cast<std::size_t>(points.width) + x) * kSamples + i % kSamples] = span[i];
      }
    }
    return image;
  };
  const auto small = by_pixel(5);
  const auto large = by_pixel(64);
  ASSERT_EQ(small.size(), large.size());
  for (std::size_t i = 0; i < small.size(); ++i) {
    ASSERT_TRUE(same(small[i], large[i])) << i << " " << small[i].position << large[i].position;
  }
}

TEST(Scene, TraitsCountWhatTheSceneHas) {
  const Scene scene(test::small_scene());
  const SceneTraits& t = scene.traits();
  EXPECT_EQ(t.triangles, 2u + 2u + 12u + 2u);
  EXPECT_EQ(t.spheres, 1u);
  EXPECT_EQ(t.materials, 2u);
  EXPECT_EQ(t.rectangle_lights, 1u);
  EXPECT_EQ(t.sphere_lights, 1u);
  EXPECT_EQ(t.mesh_lights, 1u);
  EXPECT_FALSE(t.all_diffuse);
  EXPECT_EQ(t.min_alpha, 0.1f);
  EXPECT_GT(t.ray_scene_bytes, 0u);
  const double s = t.scale;
  EXPECT_NEAR(scene.lights()[0].area, 1.0 * s * s, 1e-12);
  EXPECT_NEAR(scene.lights()[1].area, 6.0 * 0.25 * s * s, 1e-6);
  EXPECT_NEAR(scene.lights()[2].area, 4.0 * M_PI * 0.0625 * s * s, 1e-12);
}

TEST(Scene, RefusesAnEmptyDescription) {
  SceneDescription scene = test::small_scene();
  scene.shapes.clear();
  EXPECT_THROW(Scene{scene}, InputError);
}

}  // namespace
}  // namespace penumbra
