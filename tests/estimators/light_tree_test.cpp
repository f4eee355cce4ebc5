// The tree of lights: bounds hold what they bound, shares are those of the counts, no light
// that can contribute is left without, and nothing depends on the unit of length.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimators/light_tree/tree.h"
#include "scenes/core/scene.h"
#include "scenes/core/scene_file.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra::light_tree {
namespace {

/// Lights of all kinds around the origin, one-sided and two-sided, large and small.
std::vector<Light> random_lights(int count, test::TestRandom& random) {
  std::vector<Light> lights;
  for (int i = 0; i < count; ++i) {
    const auto size = static_cast<float>(std::pow(10.0, random.uniform(-2.5, 0.0)));
    const Vec3 center = random.direction() * static_cast<float>(random.uniform(0.5, 4.0));
    const bool two_sided = random.uniform() < 0.25;
    const Frame frame(random.direction());
    const Vec3 u = frame.to_world({1, 0, 0}) * size;
    const Vec3 v = frame.to_world({0, 1, 0}) * (size * static_cast<float>(random.uniform(0.1, 1)));
    if (i % 4 < 2) {
      lights.push_back(test::rectangle_light(center, u, v, two_sided));
    } else if (i % 4 == 2) {
      lights.push_back(test::sphere_light(center, size, two_sided));
    } else {
      const TriangleMeshShape mesh =
          test::tetrahedron_mesh(Vec3d(center), static_cast<double>(size));
      lights.push_back(test::mesh_light(mesh, two_sided));
    }
    const auto brightness = static_cast<float>(std::pow(10.0, random.uniform(-1.0, 2.0)));
    lights.back().radiance = Rgb(brightness, 0.5f * brightness, brightness);
  }
  return lights;
}

std::vector<std::uint32_t> all_of(std::span<const Light> lights) {
  std::vector<std::uint32_t> ids(lights.size());
  for (std::uint32_t i = 0; i < ids.size(); ++i) ids[i] = i;
  return ids;
}

struct Receiver {
  Vec3 point, normal;
};

Receiver random_receiver(test::TestRandom& random) {
  return {random.direction() * static_cast<float>(random.uniform(0.0, 5.0)), random.direction()};
}

// Indices of the lights below a node.
void collect(std::span<const Node> nodes, std::uint32_t at, std::vector<std::uint32_t>& lights) {
  if (nodes[at].first_child == 0) return lights.push_back(nodes[at].light);
  collect(nodes, nodes[at].first_child, lights);
  collect(nodes, nodes[at].first_child + 1, lights);
}

// Angle between unit vectors [rad].
double angle_between(const Vec3d& a, const Vec3d& b) {
  return std::atan2(a.cross(b).length(), a.dot(b));
}

TEST(LightTree, BoundsHoldPlacesNormalsAndIntensityOfTheirLights) {
  test::TestRandom random;
  const std::vector<Light> lights = random_lights(200, random);
  const Tree tree(lights, all_of(lights));
  std::vector<std::uint32_t> below;
  int narrow = 0;
  for (std::uint32_t n = 0; n < tree.nodes().size(); ++n) {
    const Bounds& b = tree.nodes()[n].bounds;
    below.clear();
    collect(tree.nodes(), n, below);
    ASSERT_FALSE(below.empty());
    // (0, 1) says nothing of normals.
    const bool bounds_normals = b.cosine > 0.0f;
    narrow += bounds_normals && below.size() > 1 ? 1 : 0;
    const double spread =
        bounds_normals ? std::atan2(static_cast<double>(b.sine), static_cast<double>(b.cosine))
                       : M_PI;
    double intensity = 0.0;
    for (const std::uint32_t id : below) {
      const Light& light = lights[id];
      intensity += intensity_of(light);
      for (int axis = 0; axis < 3; ++axis) {
        const double center{b.center[axis]};
        const double half{b.half_extent[axis]};
        EXPECT_GE(double{light.bounds_min[axis]}, center - half);
        EXPECT_LE(double{light.bounds_max[axis]}, center + half);
      }
      EXPECT_FALSE(bounds_normals && (light.two_sided || light.type == LightType::Sphere));
      if (light.type == LightType::Rectangle) {
        EXPECT_LE(angle_between(light.plane_normal, Vec3d(b.axis)), spread + 1e-6);
      }
      for (std::size_t i = 0; i < light.vertices.size(); i += 3) {
        const Vec3d normal = (Vec3d(light.vertices[i + 1]) - Vec3d(light.vertices[i]))
                                 .cross(Vec3d(light.vertices[i + 2]) - Vec3d(light.vertices[i]));
        EXPECT_LE(angle_between(normal.normalized(), Vec3d(b.axis)), spread + 1e-6);
      }
    }
    EXPECT_NEAR(double{b.intensity}, intensity, 1e-6 * intensity);
  }
  EXPECT_GT(narrow, 5) << "some nodes bound the normals of several lights";
  below.clear();
  collect(tree.nodes(), 0, below);
  std::sort(below.begin(), below.end());
  EXPECT_EQ(below, all_of(lights));
}

// Shares of the lights below a node by plain recursion.
void descend(std::span<const Node> nodes, std::uint32_t at, const Receiver& receiver,
             double probability, std::vector<double>& shares) {
  if (nodes[at].first_child == 0) {
    shares[nodes[at].light] = probability;
    return;
  }
  const std::uint32_t left = nodes[at].first_child;
  const double of_left{importance(nodes[left].bounds, receiver.point, receiver.normal)};
  const double of_right{importance(nodes[left + 1].bounds, receiver.point, receiver.normal)};
  if (!(of_left + of_right > 0.0)) return;
  descend(nodes, left, receiver, probability * of_left / (of_left + of_right), shares);
  descend(nodes, left + 1, receiver, probability * of_right / (of_left + of_right), shares);
}

// Share of the samples that each light gets, where the nodes of a cut get theirs by importance.
std::vector<double> shares(Tree& tree, std::size_t lights, const Receiver& receiver, float split) {
  std::vector<CutNode> cut;
  tree.cut(receiver.point, receiver.normal, split, cut);
  double total = 0.0;
  for (const CutNode& node : cut) total += double{node.importance};
  std::vector<double> result(lights, 0.0);
  for (const CutNode& node : cut) {
    descend(tree.nodes(), node.node, receiver, double{node.importance} / total, result);
  }
  return result;
}

constexpr float kSplits[] = {0.0f, 1.5f, 4.0f, 1e6f};

TEST(LightTree, CountsHaveTheSharesAsExpectation) {
  constexpr int kOffsets = 512;
  constexpr int kSamples = 24;
  test::TestRandom random;
  const std::vector<Light> lights = random_lights(120, random);
  Tree tree(lights, all_of(lights));
  double drawn = 0.0;
  int lit = 0;
  for (int r = 0; r < 40; ++r) {
    const Receiver receiver = random_receiver(random);
    std::vector<CutNode> lights_in_sight;
    tree.cut(receiver.point, receiver.normal, 1e6f, lights_in_sight);
    lit += lights_in_sight.empty() ? 0 : 1;
    const std::vector<double> expected = shares(tree, lights.size(), receiver, 0.0f);
    std::vector<double> mean(lights.size(), 0.0);
    for (int o = 0; o < kOffsets; ++o) {
      int total = 0;
      tree.walk(receiver.point, receiver.normal, 0, kSamples, {kSamples, (o + 0.5) / kOffsets},
                [&](std::uint32_t light, int count, double of_light) {
                  ASSERT_GT(count, 0);
                  ASSERT_LT(std::abs(count - of_light), 1.0 + 1e-9);
                  ASSERT_NEAR(of_light, kSamples * expected[light], 1e-9 * of_light);
                  mean[light] += static_cast<double>(count) / kOffsets;
                  total += count;
                });
      ASSERT_LE(total, kSamples);
      drawn += static_cast<double>(total) / kSamples / kOffsets;
    }
    for (std::size_t light = 0; light < lights.size(); ++light) {
      // A count changes at no more than two of the offsets' borders.
      EXPECT_NEAR(mean[light], kSamples * expected[light], 2.0 / kOffsets);
    }
  }
  EXPECT_GT(drawn, 0.9 * lit) << "few samples end where there is no light";
}

TEST(LightTree, CutsHoldEveryLightOfImportanceOnceAndSharesSumToOne) {
  test::TestRandom random;
  const std::vector<Light> lights = random_lights(150, random);
  Tree tree(lights, all_of(lights));
  std::vector<CutNode> cut;
  std::size_t before = 0;
  for (const float split : kSplits) {
    std::size_t nodes = 0;
    for (int r = 0; r < 50; ++r) {
      const Receiver receiver = random_receiver(random);
      tree.cut(receiver.point, receiver.normal, split, cut);
      nodes += cut.size();
      std::vector<std::uint32_t> held;
      for (const CutNode& node : cut) {
        EXPECT_GT(node.importance, 0.0f);
        collect(tree.nodes(), node.node, held);
      }
      std::sort(held.begin(), held.end());
      EXPECT_EQ(std::adjacent_find(held.begin(), held.end()), held.end());
      double sum = 0.0;
      for (const double share : shares(tree, lights.size(), receiver, split)) sum += share;
      // Less than 1 by what reaches nodes whose children have no importance.
      EXPECT_LE(sum, 1.0 + 1e-9);
      if (split == kSplits[3]) {  // down to single lights, unless all are out of sight
        EXPECT_NEAR(sum, cut.empty() ? 0.0 : 1.0, 1e-9);
      }
    }
    EXPECT_GT(nodes, before);
    before = nodes;
  }
}

// Lights without a share from which light arrives: sampled by area in the light's own way.
int lights_lost(Tree& tree, std::span<const Light> lights, const Receiver& receiver,
                test::TestRandom& random, int& contributing) {
  int lost = 0;
  std::vector<std::vector<double>> by_split;
  for (const float split : kSplits) {
    by_split.push_back(shares(tree, lights.size(), receiver, split));
  }
  for (std::uint32_t id = 0; id < lights.size(); ++id) {
    const Light& light = lights[id];
    if (light.type == LightType::Environment || light.is_delta()) continue;
    LightProposal proposal;
    if (!proposal.set_up(light, LightSampling::Area, receiver.point, receiver.normal)) continue;
    bool arrives = false;
    for (int i = 0; i < 16 && !arrives; ++i) {
      const auto sample = proposal.sample(random.variates());
      if (!sample || !(dot(sample->wi, receiver.normal) > 0.0f)) continue;
      // Of meshes, whose proposals do not tell the sides: any triangle that faces the point.
      arrives = light.type != LightType::Mesh || light.two_sided;
      for (std::size_t t = 0; t + 2 < light.vertices.size() && !arrives; t += 3) {
        const Vec3 n = cross(light.vertices[t + 1] - light.vertices[t],
                             light.vertices[t + 2] - light.vertices[t]);
        const Vec3 middle =
            (light.vertices[t] + light.vertices[t + 1] + light.vertices[t + 2]) / 3.0f;
        arrives = dot(receiver.point - middle, n) > 0.0f &&
                  dot(middle - receiver.point, receiver.normal) > 0.0f;
      }
    }
    if (!arrives) continue;
    ++contributing;
    for (const std::vector<double>& share : by_split) lost += share[id] > 0.0 ? 0 : 1;
  }
  return lost;
}

TEST(LightTree, EveryLightThatCanContributeHasAShare) {
  test::TestRandom random;
  int contributing = 0;
  for (int scene = 0; scene < 20; ++scene) {
    const std::vector<Light> lights = random_lights(3 + 5 * scene, random);
    Tree tree(lights, all_of(lights));
    for (int r = 0; r < 100; ++r) {
      const Receiver receiver = random_receiver(random);
      EXPECT_EQ(lights_lost(tree, lights, receiver, random, contributing), 0) << scene << ' ' << r;
    }
  }
  EXPECT_GT(contributing, 10'000);
}

TEST(LightTree, EveryLightOfTheSceneOfManyLightsThatCanContributeHasAShare) {
  const Scene scene(load_scene_description(PENUMBRA_SOURCE_DIR "/scenes/many_lights/scene.json"));
  ASSERT_GT(scene.lights().size(), 1000u);
  const ShadingPoints points = make_shading_points(scene, 1, 1, 16);
  Tree tree(scene.lights(), scene.sampled_lights());
  test::TestRandom random;
  int contributing = 0;
  for (int r = 0; r < 200; ++r) {
    const ShadingPoint& point = points.points[random.bits() % points.points.size()];
    if (!point.valid()) continue;
    const Receiver receiver{point.position, point.geometric_normal};
    EXPECT_EQ(lights_lost(tree, scene.lights(), receiver, random, contributing), 0) << r;
  }
  EXPECT_GT(contributing, 10'000);
}

// The negative control: bounds that hold the lights' middles only lose lights at the horizon.
TEST(LightTree, BoundsThatForgetTheSizeOfLightsAreCaught) {
  test::TestRandom random;
  const std::vector<Light> lights = random_lights(80, random);
  std::vector<Light> points = lights;
  for (Light& light : points) {
    light.bounds_min = light.bounds_max = (light.bounds_min + light.bounds_max) * 0.5f;
  }
  Tree tree(points, all_of(points));
  int contributing = 0;
  int lost = 0;
  for (int r = 0; r < 100; ++r) {
    lost += lights_lost(tree, lights, random_receiver(random), random, contributing);
  }
  EXPECT_GT(lost, 50) << "of " << contributing;
}

Light scaled(Light light, float scale) {
  for (Vec3* v : {&light.origin, &light.edge_u, &light.edge_v, &light.center, &light.bounds_min,
                  &light.bounds_max}) {
    *v *= scale;
  }
  for (Vec3& v : light.vertices) v *= scale;
  light.radius *= scale;
  light.area *= static_cast<double>(scale) * static_cast<double>(scale);
  return light;
}

TEST(LightTree, SharesDoNotDependOnTheUnitOfLength) {
  test::TestRandom random;
  const std::vector<Light> lights = random_lights(90, random);
  Tree tree(lights, all_of(lights));
  for (const float scale : {0x1p-20f, 0x1p-3f, 0x1p9f, 0x1p20f}) {
    std::vector<Light> others;
    for (const Light& light : lights) others.push_back(scaled(light, scale));
    Tree other(others, all_of(others));
    for (int r = 0; r < 20; ++r) {
      const Receiver receiver = random_receiver(random);
      const Receiver far{receiver.point * scale, receiver.normal};
      for (const float split : kSplits) {
        ASSERT_EQ(shares(tree, lights.size(), receiver, split),
                  shares(other, lights.size(), far, split))
            << scale;
      }
    }
  }
}

}  // namespace
}  // namespace penumbra::light_tree
