#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "scenes/core/error.h"
#include "scenes/core/scene.h"
#include "tests/core/reflected.h"
#include "tests/core/trace.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using test::to_scene;
using test::trace;

constexpr float kAlbedo = 0.8f;

// The cube [-1, 1]^3 as a cage.
SubdivisionShape cube_cage(int level) {
  SubdivisionShape cage;
  for (int i = 0; i < 8; ++i) {
    cage.vertices.push_back({i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0});
  }
  cage.face_sizes.assign(6, 4);
  cage.indices = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  cage.level = level;
  return cage;
}

SubdivisionShape tetrahedron_cage(int level) {
  const TriangleMeshShape mesh = test::tetrahedron_mesh({0, 0, 0}, 1.0);
  SubdivisionShape cage;
  cage.vertices = mesh.vertices;
  for (const auto& t : mesh.triangles) {
    cage.face_sizes.push_back(3);
    cage.indices.insert(cage.indices.end(), t.begin(), t.end());
  }
  cage.level = level;
  return cage;
}

SceneDescription under_a_white_sky(Shape shape) {
  SceneDescription scene;
  scene.materials = {test::lambert(kAlbedo)};
  scene.shapes = {test::shape("body", std::move(shape))};
  scene.environment = EnvironmentDescription{"sky", 1, 1, {Rgb(1.0f)}};
  return scene;
}

// Where a ray towards the origin from direction `from` meets the surface, in world units.
double distance_along(const Scene& scene, const Vec3d& from) {
  const Vec3 origin = to_scene(scene, from * 5.0);
  const RayHit hit = trace(scene, origin, Vec3(-from));
  return hit.hit() ? 5.0 - static_cast<double>(hit.distance) / scene.traits().scale : -1.0;
}

// Limit positions of Catmull-Clark: a vertex of valence n goes to
// (n^2 v + 4 (sum of its edge neighbours) + (sum of the faces' opposite corners)) / (n (n + 5)).
// Source: Halstead, Kass and DeRose 1993, "Efficient, fair interpolation using Catmull-Clark
// surfaces".
TEST(Subdivision, OfACubeMeetsItsLimitPositions) {
  const Scene scene(under_a_white_sky(cube_cage(16)));
  // Corner (1, 1, 1), n = 3: neighbours sum to (1, 1, 1), opposite corners to (-1, -1, -1):
  // (9 + 4 - 1)/24 = 1/2 per coordinate, so sqrt(3)/2 along the diagonal.
  // Beside it, because single rays through a point where three patches meet may slip through.
  EXPECT_NEAR(distance_along(scene, Vec3d(1, 1, 1.001).normalized()), std::sqrt(3.0) / 2.0, 1e-3);
  // Centre of the face z = 1 after one step, n = 4: itself at height 1, edge points at
  // (1 + 1 + 1 + 0)/4 = 3/4, corners' points at (1/3 + 2 * 2/3)/3 = 5/9 (mean of face points, edge
  // midpoints): (16 + 4 * 4 * 3/4 + 4 * 5/9)/36 = 68/81.
  for (const Vec3d& axis : {Vec3d(0, 0, 1), Vec3d(0, -1, 0), Vec3d(1, 0, 0)}) {
    EXPECT_NEAR(distance_along(scene, axis), 68.0 / 81.0, 1e-4) << axis;
  }
}

TEST(Subdivision, NormalsAreOutwardUnitAndThoseOfTheLimitSurface) {
  const Scene scene(under_a_white_sky(cube_cage(32)));
  test::TestRandom random;
  double largest = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 from = random.direction();
    const Vec3 origin = from * 5.0f;
    const RayHit hit = trace(scene, origin, -from);
    ASSERT_TRUE(hit.hit());
    ASSERT_GT(dot(hit.normal, from), 0.0f) << "right-handed";
    const ShadingPoint p = scene.shading_point(hit, origin, -from);
    ASSERT_NEAR(p.shading_normal.length(), 1.0f, 1e-5f);
    ASSERT_GT(dot(p.shading_normal, from), 0.5f);
    largest =
        std::max(largest, static_cast<double>((p.shading_normal - p.geometric_normal).length()));
  }
  // A quad of the tessellation spans 1/32 of a quarter turn, 2.8 degrees: half of it and of its
  // neighbour's bend at most.
  EXPECT_LT(largest, 0.06);
  EXPECT_GT(largest, 0.005) << "the shading normal is not the face's";
  const RayHit top = trace(scene, Vec3(0, 0, 5), Vec3(0, 0, -1));
  const ShadingPoint p = scene.shading_point(top, Vec3(0, 0, 5), Vec3(0, 0, -1));
  EXPECT_LT((p.shading_normal - Vec3(0, 0, 1)).length(), 1e-5f) << "by symmetry";
}

TEST(Subdivision, SurfacesOfTrianglesAreClosed) {
  for (const int level : {1, 3, 8}) {
    const Scene scene(under_a_white_sky(tetrahedron_cage(level)));
    test::TestRandom random;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 direction = random.direction();
      ASSERT_TRUE(trace(scene, to_scene(scene, {0.01, 0.02, 0.03}), direction).hit()) << direction;
    }
  }
}

std::vector<ShadingPoint> points_around(const Scene& scene, int count) {
  test::TestRandom random;
  std::vector<ShadingPoint> points;
  while (points.size() < static_cast<std::size_t>(count)) {
    const Vec3 origin = random.direction() * 7.0f;
    const Vec3 direction = (random.direction() * 1.5f - origin).normalized();
    const RayHit hit = trace(scene, origin, direction);
    if (!hit.hit()) continue;
    const ShadingPoint p = scene.shading_point(hit, origin, direction);
    if (p.valid()) points.push_back(p);
  }
  return points;
}

TEST(Subdivision, ConvexBodiesDoNotShadowThemselves) {
  for (const bool cube : {true, false}) {
    const Scene scene(under_a_white_sky(cube ? cube_cage(32) : tetrahedron_cage(32)));
    const std::vector<ShadingPoint> points = points_around(scene, 2000);
    const std::vector<test::Reflected> reflected = test::reflect(scene, points, "bsdf", 256);
    double sum = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_LE(reflected[i].largest, kAlbedo * (1.0f + 1e-5f));
      // Shading and geometric normal differ by up to 3.5 degrees, which loses (1 - cos)/2 = 0.1 %
      // of the directions. 0 to 5 of 256 may be lost by chance; a self-shadowed point loses more.
      ASSERT_GT(reflected[i].mean, 0.97 * static_cast<double>(kAlbedo)) << points[i].position;
      sum += reflected[i].mean;
    }
    EXPECT_NEAR(sum / static_cast<double>(points.size()), static_cast<double>(kAlbedo),
                2e-3 * static_cast<double>(kAlbedo));
  }
}

TEST(Subdivision, CountsTheTrianglesOfItsLevel) {
  EXPECT_EQ(Scene(under_a_white_sky(cube_cage(8))).traits().triangles, 6u * 8u * 8u * 2u);
  EXPECT_EQ(Scene(under_a_white_sky(cube_cage(8))).traits().spheres, 0u);
  EXPECT_EQ(Scene(under_a_white_sky(tetrahedron_cage(8))).traits().triangles, 4u * 3u * 16u * 2u);
}

TEST(Subdivision, CannotEmit) {
  SceneDescription scene = under_a_white_sky(cube_cage(2));
  scene.shapes[0].emission = EmissionDescription{};
  EXPECT_THROW(Scene{scene}, InputError);
}

}  // namespace
}  // namespace penumbra
