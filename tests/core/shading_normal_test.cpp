#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "estimators/estimator.h"
#include "scenes/core/scene.h"
#include "tests/core/reflected.h"
#include "tests/core/trace.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using test::trace;

constexpr float kAlbedo = 0.8f;

// A coarse sphere whose vertex normals are those of the sphere, times `length`.
TriangleMeshShape smooth_sphere(float length = 1.0f) {
  TriangleMeshShape mesh = test::sphere_mesh({0, 0, 0}, 1.0, 6, 8);
  for (const Vec3d& v : mesh.vertices) mesh.normals.push_back(Vec3(v) * length);
  return mesh;
}

SceneDescription under_a_white_sky(Shape shape, MaterialDescription material) {
  SceneDescription scene;
  scene.materials = {std::move(material)};
  scene.shapes = {test::shape("body", std::move(shape))};
  scene.environment = EnvironmentDescription{"sky", 1, 1, {Rgb(1.0f)}};
  return scene;
}

// A vector in the half space of n.
Vec3 beside(test::TestRandom& random, const Vec3& n) {
  const Vec3 w = random.direction();
  return dot(w, n) < 0.0f ? -w : w;
}

TEST(ShadingNormal, IsUnitAndOnTheSideOfViewerAndFace) {
  test::TestRandom random;
  int bent = 0;
  int naive_fails = 0;  // the control: what interpolation gives, normalised as it stands
  for (int i = 0; i < 200000; ++i) {
    const Vec3 face = random.direction();
    Vec3 wo = beside(random, face);
    if (i % 3 == 0) {  // grazing
      wo = (wo - face * (dot(wo, face) * (1.0f - 1e-4f))).normalized();
    }
    if (!(dot(wo, face) > 0.0f)) continue;
    const Vec3 interpolated = random.direction() * static_cast<float>(random.uniform(1e-6, 10.0));
    const Vec3 n = make_shading_normal(interpolated, face, wo);
    ASSERT_NEAR(n.length(), 1.0f, 1e-5f);
    ASSERT_GT(dot(n, face), 0.0f) << interpolated << face << wo;
    ASSERT_GT(dot(n, wo), 0.0f) << interpolated << face << wo;
    const Vec3 naive = interpolated.normalized();
    naive_fails += dot(naive, face) > 0.0f && dot(naive, wo) > 0.0f ? 0 : 1;
    const Vec3 given = interpolated.normalized() * (dot(interpolated, face) < 0.0f ? -1.0f : 1.0f);
    if (dot(given, wo) > 1.1e-3f) {
      ASSERT_LT((n - given).length(), 1e-6f) << "a normal that needs no change";
    } else if (dot(given, wo) < 0.9e-3f && n != face) {
      ++bent;
      ASSERT_NEAR(dot(n, wo), 1e-3f, 1e-5f);
      ASSERT_NEAR(dot(n, cross(given, wo).normalized()), 0.0f, 1e-3f) << "in the plane of both";
    }
  }
  EXPECT_GT(bent, 20000);
  EXPECT_GT(naive_fails, 100000) << "half of all directions lie below the face";
}

TEST(ShadingNormal, WithoutADirectionIsTheFaces) {
  const Vec3 face(0, 0, 1);
  const Vec3 wo = Vec3(1, 0, 1).normalized();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const Vec3& none : {Vec3(0.0f), Vec3(nan, 0, 1), Vec3(infinity, 0, 0), Vec3(1, 0, 0)}) {
    EXPECT_EQ(make_shading_normal(none, face, wo), face) << none;
  }
}

TEST(ShadingNormal, OfASmoothSphereIsTheSpheres) {
  const Scene scene(under_a_white_sky(smooth_sphere(), test::lambert(kAlbedo)));
  test::TestRandom random;
  int points = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 origin = random.direction() * 4.0f;
    const Vec3 direction = (random.direction() * 0.8f - origin).normalized();
    const RayHit hit = trace(scene, origin, direction);
    if (!hit.hit()) continue;
    const ShadingPoint p = scene.shading_point(hit, origin, direction);
    const Vec3 sphere = p.position.normalized();
    if (dot(sphere, p.wo) < 0.3f) continue;
    // Linear interpolation of the corners' normals, normalised, is the direction of the flat point.
    ASSERT_LT((p.shading_normal - sphere).length(), 1e-4f);
    ASSERT_NE(p.shading_normal, p.geometric_normal);
    ++points;
  }
  EXPECT_GT(points, 5000);
}

// Seen from all around, with a share of grazing views.
std::vector<ShadingPoint> points_around(const Scene& scene, int count) {
  test::TestRandom random;
  std::vector<ShadingPoint> points;
  while (points.size() < static_cast<std::size_t>(count)) {
    const Vec3 origin = random.direction() * 6.0f;
    const auto half = static_cast<float>(scene.traits().scale);
    const Vec3 target =
        cross(random.direction(), origin).normalized() * half *
        static_cast<float>(random.uniform(points.size() % 2 == 0 ? 0.85 : 0.0, 1.0));
    const Vec3 direction = (target - origin).normalized();
    const RayHit hit = trace(scene, origin, direction);
    if (!hit.hit()) continue;
    const ShadingPoint p = scene.shading_point(hit, origin, direction);
    if (p.valid()) points.push_back(p);
  }
  return points;
}

TEST(ShadingNormal, NeverReflectsMoreThanTheAlbedo) {
  // BSDF sampling of a diffuse surface under a white sky estimates the albedo, or 0 where
  // a direction is lost below the face: without noise from above.
  const Scene scene(under_a_white_sky(smooth_sphere(), test::lambert(kAlbedo)));
  const std::vector<ShadingPoint> points = points_around(scene, 4096);
  const std::vector<test::Reflected> reflected = test::reflect(scene, points, "bsdf", 64);
  double sum = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_LE(reflected[i].largest, kAlbedo * (1.0f + 1e-5f)) << points[i].shading_normal;
    ASSERT_GE(reflected[i].mean, 0.0);
    sum += reflected[i].mean;
  }
  const double mean = sum / static_cast<double>(points.size()) / static_cast<double>(kAlbedo);
  // The mesh's faces are up to 20 degrees off the sphere, which costs (1 - cos 20 deg)/2 = 3 %.
  EXPECT_LT(mean, 1.0);
  EXPECT_GT(mean, 0.95);
}

TEST(ShadingNormal, OfAGlossySurfaceNeverReflectsMoreThanItsLargestAlbedo) {
  // No absorption at all: a real surface of GGX facets reflects up to 1 and loses what would be
  // reflected twice.
  MaterialDescription mirror_like;
  mirror_like.name = "silver";
  mirror_like.model = ConductorMaterial{Rgb(1.0f), Rgb(1000.0f), 0.3f, Rgb(1.0f)};
  const Scene scene(under_a_white_sky(smooth_sphere(), mirror_like));
  const std::vector<ShadingPoint> points = points_around(scene, 512);
  const std::vector<test::Reflected> reflected = test::reflect(scene, points, "bsdf", 1024);
  const double bound = test::z_bound(test::sidak(1e-6, static_cast<int>(points.size())));
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_LE(reflected[i].mean, 1.0 + bound * reflected[i].standard_error + 1e-4)
        << points[i].shading_normal << points[i].wo;
  }
}

TEST(ShadingNormal, InwardNormalsShadeLikeOutwardOnes) {
  const Scene outward(under_a_white_sky(smooth_sphere(), test::lambert(kAlbedo)));
  const Scene inward(under_a_white_sky(smooth_sphere(-3.0f), test::lambert(kAlbedo)));
  const std::vector<ShadingPoint> a = points_around(outward, 2000);
  const std::vector<ShadingPoint> b = points_around(inward, 2000);
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].position, b[i].position);
    ASSERT_LT((a[i].shading_normal - b[i].shading_normal).length(), 1e-6f);
  }
}

TEST(ShadingNormal, VerticesWithoutADirectionTakeTheFaces) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Vec3& none : {Vec3(0.0f), Vec3(nan, 0, 0)}) {
    TriangleMeshShape mesh = smooth_sphere();
    std::fill(mesh.normals.begin(), mesh.normals.end(), none);
    const Scene scene(under_a_white_sky(mesh, test::lambert(kAlbedo)));
    for (const ShadingPoint& p : points_around(scene, 500)) {
      ASSERT_LT((p.shading_normal - p.geometric_normal).length(), 1e-6f);
    }
  }
}

TEST(SurfaceUv, IsInterpolatedLinearly) {
  TriangleMeshShape mesh;
  mesh.vertices = {{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto uv_at = [](const Vec3d& p) {
    return Vec2(static_cast<float>(0.25 + 0.5 * p.x), static_cast<float>(2.0 - p.z));
  };
  for (const Vec3d& v : mesh.vertices) mesh.uvs.push_back(uv_at(v));
  SceneDescription description = under_a_white_sky(mesh, test::lambert(kAlbedo));
  description.shapes.push_back(test::shape("ball", SphereShape{{5, 0, 0}, 1.0}));
  // No image needs the coordinates here.
  const Scene scene(description, SceneOptions{.keep_all = true});
  test::TestRandom random;
  for (int i = 0; i < 1000; ++i) {
    const Vec3d target(random.uniform(-1, 1), 0.0, random.uniform(-1, 1));
    const RayHit hit = trace(scene, test::to_scene(scene, target + Vec3d(0, 1, 0)), Vec3(0, -1, 0));
    ASSERT_TRUE(hit.hit());
    ASSERT_LT((scene.surface_uv(hit) - uv_at(target)).length(), 1e-5f) << target;
  }
  const RayHit ball = trace(scene, test::to_scene(scene, {5, 3, 0}), Vec3(0, -1, 0));
  EXPECT_EQ(scene.surface_uv(ball), Vec2(0.0f));
}

}  // namespace
}  // namespace penumbra
