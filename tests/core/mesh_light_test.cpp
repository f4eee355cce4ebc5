// Mesh lights of many triangles, whose densities come from a ray scene of their own, against the
// loop over all triangles; and which meshes are left out because they face away.

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "scenes/core/frame.h"
#include "scenes/core/scene.h"
#include "scenes/core/scene_lights.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

const double kLevel = test::sidak(1e-4, 20);

/// A light twice: as the scene would make it, and with the loop.
struct Pair {
  std::string name;
  Light tree, loop;
  std::unique_ptr<RayScene> crossings;
};

Light light_of(const TriangleMeshShape& mesh, bool two_sided) {
  ShapeDescription shape;
  shape.name = "mesh";
  shape.shape = mesh;
  shape.emission = EmissionDescription{Rgb(1.0f), two_sided};
  return make_light(shape, make_geometry(shape));
}

Pair pair_of(std::string name, const TriangleMeshShape& mesh) {
  Pair pair{std::move(name), light_of(mesh, true), light_of(mesh, true), nullptr};
  pair.crossings = make_crossings(pair.tree);
  EXPECT_NE(pair.crossings, nullptr) << pair.name;
  pair.tree.crossings = pair.crossings.get();
  return pair;
}

TriangleMeshShape soup(test::TestRandom& random, int triangles, double size) {
  TriangleMeshShape mesh;
  for (int i = 0; i < triangles; ++i) {
    const Vec3d middle(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1, 3));
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(middle + Vec3d(random.direction()) * size);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

std::vector<Pair> pairs() {
  test::TestRandom random(1);
  std::vector<Pair> result;
  result.push_back(pair_of("sphere", test::sphere_mesh({0.2, 0.1, 2}, 1.0, 12, 16)));
  result.push_back(pair_of("fine sphere", test::sphere_mesh({0.2, 0.1, 2}, 1.0, 60, 80)));
  result.push_back(pair_of("far sphere", test::sphere_mesh({300, 100, 500}, 1.0, 12, 16)));
  result.push_back(pair_of("sphere from inside", test::sphere_mesh({0.2, 0.1, 0.3}, 1, 12, 16)));
  result.push_back(pair_of("coarse soup", soup(random, 100, 0.5)));
  result.push_back(pair_of("fine soup", soup(random, 3000, 0.05)));
  return result;
}

LightProposal proposal_of(const Light& light) {
  LightProposal proposal;
  EXPECT_TRUE(proposal.set_up(light, LightSampling::Area, Vec3(0.0f), Vec3(0, 0, 1)));
  return proposal;
}

/// How near a ray from the origin passes to the outline of a triangle: the smallest barycentric
/// coordinate's magnitude where it passes through or close by.
double nearest_outline(const Light& light, const Vec3& wi) {
  double nearest = 1.0;
  const Vec3d w(wi);
  for (std::size_t i = 0; i < light.vertices.size(); i += 3) {
    const Vec3d a(light.vertices[i]), b(light.vertices[i + 1]), c(light.vertices[i + 2]);
    const double det = w.dot((b - a).cross(c - a));
    const double coordinates[3] = {w.dot(b.cross(c)) / det, w.dot(c.cross(a)) / det,
                                   w.dot(a.cross(b)) / det};
    for (const double x : coordinates) nearest = std::min(nearest, std::abs(x));
  }
  return nearest;
}

TEST(MeshLightTree, DensityIsThatOfTheLoopOverAllTriangles) {
  test::TestRandom random;
  for (const Pair& pair : pairs()) {
    const LightProposal tree = proposal_of(pair.tree);
    const LightProposal loop = proposal_of(pair.loop);
    constexpr int kDraws = 4000;
    int hits = 0;
    int differ = 0;
    double difference = 0.0;
    for (int i = 0; i < kDraws; ++i) {
      const Variates variates = random.variates();
      const auto sample = loop.sample(variates);
      const Vec3 wi = i % 2 == 0 || !sample ? random.direction() : sample->wi;
      const float expected = loop.pdf_w(wi);
      const float found = tree.pdf_w(wi);
      hits += found > 0.0f ? 1 : 0;
      // Triangles seen nearly edge-on lose digits in both forms.
      if (std::abs(found - expected) <= 1e-3f * expected) {
        if (found > 0.0f) difference += double{std::abs(found - expected)} / double{expected};
        continue;
      }
      // Two tests of the same crossing may differ on an outline, to rounding at the distance.
      ++differ;
      EXPECT_LT(nearest_outline(pair.loop, wi), 1e-3)
          << pair.name << ": " << found << ", loop " << expected << ", wi " << wi;
    }
    EXPECT_GT(hits, kDraws / 3) << pair.name;
    EXPECT_LE(differ, kDraws / 200) << pair.name;
    EXPECT_LT(difference / hits, 1e-5) << pair.name;
  }
}

TEST(MeshLightTree, ADensityOfOneTriangleLessIsTold) {  // negative control
  test::TestRandom random;
  TriangleMeshShape mesh = test::sphere_mesh({0.2, 0.1, 2}, 1.0, 12, 16);
  Pair pair = pair_of("sphere", mesh);
  mesh.triangles.erase(mesh.triangles.begin() + 100);
  pair.loop = light_of(mesh, true);
  pair.loop.area = pair.tree.area;
  const LightProposal tree = proposal_of(pair.tree);
  const LightProposal loop = proposal_of(pair.loop);
  int told = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto sample = tree.sample(random.variates());
    if (!sample) continue;
    const float expected = loop.pdf_w(sample->wi);
    told += std::abs(sample->pdf_w - expected) > 1e-3f * expected &&
                    nearest_outline(pair.tree, sample->wi) > 1e-3
                ? 1
                : 0;
  }
  EXPECT_GT(told, 5);
}

TEST(MeshLightTree, DirectionsThatMissHaveNoDensity) {
  test::TestRandom random;
  for (const Pair& pair : pairs()) {
    const LightProposal tree = proposal_of(pair.tree);
    const LightProposal loop = proposal_of(pair.loop);
    int misses = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 wi = random.direction();
      if (loop.pdf_w(wi) > 0.0f || nearest_outline(pair.loop, wi) < 1e-3) continue;
      ++misses;
      ASSERT_EQ(tree.pdf_w(wi), 0.0f) << pair.name << wi;
    }
    EXPECT_TRUE(misses > 100 || pair.name == "sphere from inside" || pair.name == "fine soup")
        << pair.name << misses;
  }
}

// Convex, so that no front face hides another: irradiance by Lambert's formula.
TEST(MeshLightTree, IrradianceIsTheSumOfLambertsFormulaOverItsFrontFaces) {
  test::TestRandom random;
  const Pair pair = pair_of("sphere", test::sphere_mesh({0.4, -0.3, 1.6}, 1.0, 24, 32));
  double exact = 0.0;
  for (std::size_t i = 0; i < pair.tree.vertices.size(); i += 3) {
    const Vec3d corners[3] = {Vec3d(pair.tree.vertices[i]), Vec3d(pair.tree.vertices[i + 1]),
                              Vec3d(pair.tree.vertices[i + 2])};
    const Vec3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if (normal.dot(corners[0]) < 0.0) {
      exact += test::polygon_irradiance(corners, Vec3d(0.0), Vec3d(0, 0, 1));
    }
  }
  const LightProposal proposal = proposal_of(pair.tree);
  test::Moments moments;
  for (int i = 0; i < 100000; ++i) {
    const auto sample = proposal.sample(random.variates());
    moments.add(sample ? std::max(0.0, double{sample->wi.z}) / double{sample->pdf_w} : 0.0);
  }
  EXPECT_LT(moments.z(exact, 1e-5), test::z_bound(kLevel)) << moments.mean() << " " << exact;
}

TEST(MeshLightTree, AnyNumberOfThreadsFindsTheSame) {
  test::TestRandom random;
  const Pair pair = pair_of("fine soup", soup(random, 3000, 0.05));
  const LightProposal proposal = proposal_of(pair.tree);
  std::vector<Vec3> directions(20000);
  for (Vec3& wi : directions) {
    const auto sample = proposal.sample(random.variates());
    wi = sample ? sample->wi : random.direction();
  }
  std::vector<float> one(directions.size()), many(directions.size());
  for (std::size_t i = 0; i < directions.size(); ++i) one[i] = proposal.pdf_w(directions[i]);
  tbb::parallel_for(std::size_t{0}, directions.size(),
                    [&](std::size_t i) { many[i] = proposal.pdf_w(directions[i]); });
  EXPECT_EQ(one, many);
}

TEST(MeshLightTree, OnlyMeshesOfManyTrianglesHaveOne) {
  SceneDescription description = test::small_scene();
  EXPECT_EQ(Scene(description).lights()[1].crossings, nullptr);
  description.shapes[2].shape = test::sphere_mesh({2, 0.5, 0}, 0.25, 12, 16);
  const Scene scene(description);
  EXPECT_EQ(scene.lights()[0].crossings, nullptr);
  EXPECT_NE(scene.lights()[1].crossings, nullptr);
  EXPECT_EQ(scene.lights()[2].crossings, nullptr);
}

/// A patch of a sphere around +z, of an angle up to `width`, turned and moved.
TriangleMeshShape patch(test::TestRandom& random, double width) {
  TriangleMeshShape mesh;
  constexpr std::uint32_t kSide = 6;
  const Frame frame(random.direction());
  const Vec3d place(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2));
  for (std::uint32_t j = 0; j <= kSide; ++j) {
    for (std::uint32_t i = 0; i <= kSide; ++i) {
      const double x = width * (2.0 * i / kSide - 1.0);
      const double y = width * (2.0 * j / kSide - 1.0);
      // The sphere of radius 1/width touches the plane; a width of 0 would be flat.
      const double z = std::sqrt(std::max(0.0, 1.0 - 0.5 * (x * x + y * y))) / width;
      mesh.vertices.push_back(
          place + Vec3d(frame.to_world(Vec3(Vec3d(x / width, y / width, z - 1.0 / width)))));
      if (i == kSide || j == kSide) continue;
      const std::uint32_t at = j * (kSide + 1) + i;
      mesh.triangles.push_back({at, at + 1, at + kSide + 2});
      mesh.triangles.push_back({at, at + kSide + 2, at + kSide + 1});
    }
  }
  return mesh;
}

bool any_triangle_faces(const Light& light, const Vec3& point) {
  for (std::size_t i = 0; i < light.vertices.size(); i += 3) {
    const Vec3d a(light.vertices[i]), b(light.vertices[i + 1]), c(light.vertices[i + 2]);
    if ((b - a).cross(c - a).dot(Vec3d(point) - a) > 0.0) return true;
  }
  return false;
}

TEST(MeshLightFacing, NoMeshThatContributesIsLeftOut) {
  test::TestRandom random;
  int left_out = 0;
  int facing_away = 0;
  for (int i = 0; i < 4000; ++i) {
    const double width = std::pow(10.0, random.uniform(-4.0, 0.0));
    const Light light = light_of(patch(random, width), false);
    const Vec3 point(Vec3d(random.direction()) * std::pow(10.0, random.uniform(-1.0, 2.0)));
    const Vec3 normal((Vec3d(light.bounds_min) + Vec3d(light.bounds_max)) * 0.5 - Vec3d(point));
    LightProposal proposal;
    const bool kept = proposal.set_up(light, LightSampling::Area, point, normal.normalized());
    const bool faces = any_triangle_faces(light, point);
    EXPECT_TRUE(kept || !faces) << width << point;
    facing_away += faces ? 0 : 1;
    left_out += kept ? 0 : 1;
  }
  // The test of bounds finds most of those that can be left out.
  EXPECT_GT(facing_away, 1000);
  EXPECT_GT(left_out, facing_away * 8 / 10) << facing_away;
}

TEST(MeshLightFacing, ClosedAndTwoSidedMeshesAreKept) {
  TriangleMeshShape flat;
  flat.vertices = {{-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, {-1, 1, 2}};
  flat.triangles = {{0, 1, 2}, {0, 2, 3}};  // normal +z, away from the origin
  const auto is_kept = [](const Light& light) {
    LightProposal proposal;
    return proposal.set_up(light, LightSampling::Area, Vec3(0.0f), Vec3(0, 0, 1));
  };
  EXPECT_FALSE(is_kept(light_of(flat, false)));
  EXPECT_TRUE(is_kept(light_of(flat, true)));
  EXPECT_TRUE(is_kept(light_of(test::cube_mesh({0, 0, 2}, 1.0), false)));
  std::swap(flat.triangles[0][1], flat.triangles[0][2]);  // one half turned over
  EXPECT_TRUE(is_kept(light_of(flat, false)));
}

}  // namespace
}  // namespace penumbra
