// Whether something may lie between a point and a light: "no" must be certain, "may be" need not.
// Exact properties on random scenes with fixed seeds; nothing here can fail by chance alone.

#include "scenes/core/occluders.h"

#include <gtest/gtest.h>

#include <cmath>

#include "scenes/core/frame.h"
#include "tests/core/trace.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

constexpr int kScenes = 300;
constexpr int kPoints = 40;
constexpr int kRays = 64;

Vec3d position(test::TestRandom& random, double side) {
  return {random.uniform(-side, side), random.uniform(0.0, side), random.uniform(-side, side)};
}

// Every other one along the axes, where boxes are tight.
RectangleShape random_rectangle(test::TestRandom& random) {
  const bool turned = random.uniform() < 0.5;
  const Frame frame(turned ? random.direction()
                           : Vec3(0.0f, random.uniform() < 0.5 ? 1 : -1, 0.0f));
  const Vec3d u = Vec3d(turned ? frame.to_world({1, 0, 0}) : Vec3(1, 0, 0));
  const Vec3d v =
      Vec3d(turned ? frame.to_world({0, 1, 0}) : Vec3(0, 0, random.uniform() < 0.5 ? 1.0f : -1.0f));
  return {position(random, 2.0), u * random.uniform(0.1, 1.5), v * random.uniform(0.1, 1.5)};
}

QuadMeshShape box(const Vec3d& low, const Vec3d& size) {
  QuadMeshShape result;
  for (int i = 0; i < 8; ++i) {
    result.vertices.push_back(
        low + Vec3d(i & 1 ? size.x : 0.0, i & 2 ? size.y : 0.0, i & 4 ? size.z : 0.0));
  }
  result.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                  {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  return result;
}

SubdivisionShape blob(const QuadMeshShape& cage) {
  SubdivisionShape result{cage.vertices, {}, {}, 3};
  for (const auto& quad : cage.quads) {
    result.face_sizes.push_back(4);
    result.indices.insert(result.indices.end(), quad.begin(), quad.end());
  }
  return result;
}

Shape random_shape(test::TestRandom& random) {
  const Vec3d at = position(random, 2.0);
  const double size = random.uniform(0.1, 0.6);
  switch (static_cast<int>(random.uniform(0, 6))) {
    case 0:
      return SphereShape{at, size};
    case 1:
      return box(at, {size, random.uniform(0.1, 1.0), size});
    case 2:
      return test::sphere_mesh(at, size, 4, 5);
    case 3:
      return blob(box(at, Vec3d(size)));
    default:
      return random_rectangle(random);
  }
}

SceneDescription random_scene(test::TestRandom& random) {
  SceneDescription scene;
  scene.materials = {test::lambert(0.5f)};
  const RectangleShape ground{{-4, 0, 4}, {8, 0, 0}, {0, 0, -8}};
  if (random.uniform() < 0.7) scene.shapes = {test::shape("floor", ground)};
  const auto lights = static_cast<int>(random.uniform(0, 4));
  for (int i = 0; i < lights; ++i) {
    const bool two_sided = random.uniform() < 0.5;
    const Shape shape = random.uniform() < 0.6 ? Shape(random_rectangle(random))
                                               : Shape(SphereShape{position(random, 2.0), 0.3});
    scene.shapes.push_back(test::light("light" + std::to_string(i), shape, Rgb(1.0f), two_sided));
  }
  const auto others = static_cast<int>(random.uniform(0, 4));
  for (int i = 0; i < others; ++i) {
    scene.shapes.push_back(test::shape("shape" + std::to_string(i), random_shape(random)));
  }
  if (scene.shapes.empty()) scene.shapes = {test::shape("floor", ground)};
  if (random.uniform() < 0.5) scene.environment = EnvironmentDescription{"sky", 1, 1, {Rgb(1.0f)}};
  return scene;
}

/// A surface point that a random ray through the scene meets; not valid where it meets nothing.
ShadingPoint random_point(const Scene& scene, test::TestRandom& random) {
  const Vec3 from = test::to_scene(scene, position(random, 3.0));
  const Vec3 to = test::to_scene(scene, position(random, 2.0) - Vec3d(0, 0.5, 0));
  const Vec3 direction = (to - from).normalized();
  const RayHit hit = test::trace(scene, from, direction);
  return hit.hit() ? scene.shading_point(hit, from, direction) : ShadingPoint{};
}

/// Distance to the first point of a light's surface along a direction that it was sampled in.
double distance_to(const Light& light, const Vec3& from, const Vec3& wi) {
  if (light.type == LightType::Environment) return INFINITY;
  const Vec3d w(wi);
  if (light.type == LightType::Rectangle) {
    const Vec3d normal = Vec3d(light.edge_u).cross(Vec3d(light.edge_v));
    return normal.dot(Vec3d(light.origin) - Vec3d(from)) / normal.dot(w);
  }
  const Vec3d d = Vec3d(light.center) - Vec3d(from);
  const double along = d.dot(w);
  const double radius = static_cast<double>(light.radius);
  const double half = std::sqrt(std::max(0.0, along * along - d.dot(d) + radius * radius));
  return d.length() < radius ? along + half : along - half;
}

/// Whether something else than the light stops one of `kRays` random rays to points of it above the
/// horizon.
/// @param shape  index of the light's shape, which is that of its hits
bool is_hidden(const Scene& scene, const Light& light, std::uint32_t shape,
               const ShadingPoint& point, test::TestRandom& random) {
  LightProposal proposal;
  if (!proposal.set_up(light, LightSampling::Area, point.position, point.geometric_normal)) {
    return false;
  }
  for (int i = 0; i < kRays; ++i) {
    const auto sample = proposal.sample(random.variates());
    if (!sample || !(dot(sample->wi, point.geometric_normal) > 0.0f)) continue;
    const RayHit hit = test::trace(scene, point.position, sample->wi);
    const double limit = distance_to(light, point.position, sample->wi) * (1.0 - 1e-5);
    if (hit.hit() && hit.geometry != shape && static_cast<double>(hit.distance) < limit) {
      return true;
    }
  }
  return false;
}

/// Index of the shape of every light; of the environment, no shape.
std::vector<std::uint32_t> shapes_of_lights(const SceneDescription& scene) {
  std::vector<std::uint32_t> result;
  for (std::uint32_t i = 0; i < scene.shapes.size(); ++i) {
    if (scene.shapes[i].emission) result.push_back(i);
  }
  result.push_back(RayHit::kMiss);
  return result;
}

TEST(Occluders, WhatTheyRuleOutIsNeverHidden) {
  test::TestRandom random;
  int ruled_out = 0, ruled_out_sky = 0, hidden = 0, asked = 0;
  for (int s = 0; s < kScenes; ++s) {
    const SceneDescription description = random_scene(random);
    const std::vector<std::uint32_t> shapes = shapes_of_lights(description);
    const Scene scene(description);
    for (int i = 0; i < kPoints; ++i) {
      const ShadingPoint point = random_point(scene, random);
      if (!point.valid()) continue;
      for (std::uint32_t l = 0; l < scene.lights().size(); ++l) {
        const Light& light = scene.lights()[l];
        const bool may_be = scene.may_be_occluded(l, point);
        const bool is = is_hidden(scene, light, shapes[l], point, random);
        EXPECT_TRUE(may_be || !is) << "scene " << s << ", point " << i << ", " << light.name;
        const bool is_sky = light.type == LightType::Environment;
        ruled_out += may_be ? 0 : 1;
        ruled_out_sky += !may_be && is_sky ? 1 : 0;
        hidden += is ? 1 : 0;
        ++asked;
      }
    }
  }
  // Neither answer is rare, so that the property says something.
  EXPECT_GT(ruled_out, asked / 10);
  EXPECT_GT(ruled_out_sky, 100);
  EXPECT_GT(hidden, asked / 10);
}

// Floor y = 0 and a panel above it that faces down.
SceneDescription floor_and_panel() {
  SceneDescription scene;
  scene.materials = {test::lambert(0.5f)};
  scene.shapes = {
      test::shape("floor", RectangleShape{{-4, 0, 4}, {8, 0, 0}, {0, 0, -8}}),
      test::light("panel", RectangleShape{{-0.5, 2, -0.5}, {1, 0, 0}, {0, 0, 1}}, Rgb(1.0f))};
  return scene;
}

// The floor straight below the panel, seen from above and from the side.
ShadingPoint below_panel(const Scene& scene, double x = 0.25) {
  const Vec3 from = test::to_scene(scene, {x - 1.0, 1, 0.5});
  const Vec3 direction = Vec3(1, -1, 0).normalized();
  return scene.shading_point(test::trace(scene, from, direction), from, direction);
}

bool may_be_occluded(const SceneDescription& description, std::uint32_t light = 0) {
  const Scene scene(description);
  return scene.may_be_occluded(light, below_panel(scene));
}

TEST(Occluders, NothingIsBetweenAPlaneAndItsLights) {
  SceneDescription scene = floor_and_panel();
  EXPECT_FALSE(may_be_occluded(scene));
  scene.shapes.push_back(test::light("ball", SphereShape{{3, 1, 0}, 0.5}, Rgb(1.0f)));
  EXPECT_FALSE(may_be_occluded(scene, 0)) << "a light beside";
  EXPECT_FALSE(may_be_occluded(scene, 1)) << "light of the ball";
  scene.shapes.push_back(test::shape("sill", RectangleShape{{-4, -0.5, 4}, {8, 0, 0}, {0, 0, -8}}));
  scene.shapes.push_back(test::shape("roof", RectangleShape{{-4, 3, 4}, {8, 0, 0}, {0, 0, -8}}));
  EXPECT_FALSE(may_be_occluded(scene)) << "shapes below the floor and above the light";
}

TEST(Occluders, APlaneInManySquaresIsStillAPlane) {
  SceneDescription scene = floor_and_panel();
  scene.shapes.erase(scene.shapes.begin());
  for (int i = 0; i < 16; ++i) {
    const Vec3d corner(-4 + 2 * (i % 4), 0, 4 - 2 * (i / 4));
    scene.shapes.push_back(
        test::shape("square" + std::to_string(i), RectangleShape{corner, {2, 0, 0}, {0, 0, -2}}));
  }
  EXPECT_FALSE(may_be_occluded(scene));
}

TEST(Occluders, ALightAloneHidesNothingOfItself) {
  SceneDescription scene;
  scene.materials = {test::lambert(0.5f)};
  scene.shapes = {test::light("ball", SphereShape{{0, 0, 0}, 1.0}, Rgb(1.0f), true)};
  const Scene alone(scene);
  ShadingPoint point;
  point.position = test::to_scene(alone, {0, 3, 0});
  point.geometric_normal = Vec3(0, -1, 0);
  EXPECT_FALSE(alone.may_be_occluded(0, point));
}

TEST(Occluders, ABoardBetweenMayHide) {
  SceneDescription scene = floor_and_panel();
  const RectangleShape board{{0.1, 1, 0.1}, {0.3, 0, 0}, {0, 0, 0.3}};
  scene.shapes.push_back(test::shape("board", board));
  EXPECT_TRUE(may_be_occluded(scene));
  scene.shapes.back().emission = EmissionDescription{Rgb(1.0f)};
  EXPECT_TRUE(may_be_occluded(scene)) << "another light hides like any shape";
}

TEST(Occluders, AMeshMayHideItself) {
  SceneDescription scene = floor_and_panel();
  scene.shapes[1].shape = test::cube_mesh({0, 2, 0}, 1.0);
  EXPECT_TRUE(may_be_occluded(scene));
}

TEST(Occluders, ASkyMayBeHiddenByWhatIsAboveTheHorizon) {
  SceneDescription scene = floor_and_panel();
  scene.environment = EnvironmentDescription{"sky", 1, 1, {Rgb(1.0f)}};
  EXPECT_TRUE(may_be_occluded(scene, 1)) << "by the panel";
  scene.shapes[1].shape = RectangleShape{{-0.5, -2, -0.5}, {1, 0, 0}, {0, 0, 1}};
  EXPECT_FALSE(may_be_occluded(scene, 1)) << "all is below the floor";
}

TEST(Occluders, AmongMoreShapesThanTheyKeepAnythingMayHide) {
  SceneDescription scene = floor_and_panel();
  const auto add_below = [&] {
    const double y = -1.0 - static_cast<double>(scene.shapes.size());
    scene.shapes.push_back(test::shape("below" + std::to_string(scene.shapes.size()),
                                       RectangleShape{{-1, y, 1}, {2, 0, 0}, {0, 0, -2}}));
  };
  while (scene.shapes.size() < Occluders::kMost) add_below();
  EXPECT_FALSE(may_be_occluded(scene));
  add_below();
  EXPECT_TRUE(may_be_occluded(scene));
}

TEST(Occluders, WhereAllIsKeptAnythingMayHide) {
  const Scene kept(floor_and_panel(), SceneOptions{true});
  EXPECT_TRUE(kept.may_be_occluded(0, below_panel(kept)));
}

}  // namespace
}  // namespace penumbra
