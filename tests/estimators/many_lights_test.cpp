// Shortcuts for many lights, against what they stand for: the grid over directions, a mixture's
// densities, the raising of counts.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "estimators/mixture/light_grid.h"
#include "estimators/mixture/mixture.h"
#include "estimators/pmc_hi/adaptation.h"
#include "tests/support/fixtures.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

/// Lights of all kinds over the floor y = 0, from far away to close by, small and large.
SceneDescription many_lights(int count, std::uint64_t salt) {
  test::TestRandom random(salt);
  SceneDescription scene;
  scene.materials = {test::lambert(0.5f),
                     {"plastic", MetallicRoughnessMaterial{Rgb(0.5f), 0.3f, 0.6f}}};
  scene.shapes = {test::shape("floor", RectangleShape{{-9, 0, 9}, {18, 0, 0}, {0, 0, -18}})};
  for (int i = 0; i < count; ++i) {
    const double size = std::pow(10.0, random.uniform(-2.5, 0.3));
    const Vec3d center(random.uniform(-8, 8), 2.0 + size + random.uniform(0, 3),
                       random.uniform(-8, 8));
    const std::string name = "light" + std::to_string(i);
    const Rgb radiance(1.0f);
    if (i % 3 == 0) {
      const Frame frame(random.direction());
      const Vec3d u = Vec3d(frame.to_world({1, 0, 0})) * size;
      const Vec3d v = Vec3d(frame.to_world({0, 1, 0})) * (size * random.uniform(0.1, 1.0));
      scene.shapes.push_back(
          test::light(name, RectangleShape{center - (u + v) * 0.5, u, v}, radiance, i % 2 == 0));
    } else if (i % 3 == 1) {
      scene.shapes.push_back(test::light(name, SphereShape{center, size}, radiance));
    } else {
      const TriangleMeshShape mesh = i % 2 == 0 ? test::tetrahedron_mesh(center, size)
                                                : test::sphere_mesh(center, size, 8, 10);
      scene.shapes.push_back(test::light(name, mesh, radiance, true));
    }
  }
  return scene;
}

ShadingPoint floor_point(const Scene& scene, test::TestRandom& random) {
  return fixtures::place(scene, {random.uniform(-8, 8), 1e-3, random.uniform(-8, 8)}, {0, 1, 0},
                         Vec3d(random.uniform(-0.5, 0.5), 1, 0.3).normalized(), 1);
}

void expect_grid_to_visit_the_lights_met(int lights, int points, int directions_each,
                                         double most_visited) {
  test::TestRandom random;
  const Scene scene(many_lights(lights, 1));
  std::vector<LightProposal> proposals;
  LightGrid grid(scene.lights().size());
  double visited_share = 0.0;
  int directions = 0;
  int met = 0;
  for (int p = 0; p < points; ++p) {
    const ShadingPoint point = floor_point(scene, random);
    proposals.clear();
    for (const Light& light : scene.lights()) {
      LightProposal proposal;
      const LightSampling sampling = p % 2 == 0 ? LightSampling::Area : LightSampling::SolidAngle;
      if (proposal.set_up(light, sampling, point.position, point.geometric_normal)) {
        proposals.push_back(proposal);
      }
    }
    grid.build(proposals);
    for (int i = 0; i < directions_each; ++i) {
      Vec3 w = random.direction();
      if (i % 10 == 0) w = Vec3(0, 0, i % 20 == 0 ? 1.0f : -1.0f);  // the poles of the grid
      if (i % 2 == 1) {
        const auto l = static_cast<std::size_t>(random.bits()) % proposals.size();
        if (const auto sample = proposals[l].sample(random.variates())) w = sample->wi;
      }
      std::vector<std::uint32_t> visited;
      grid.for_each(w, [&](std::uint32_t l) { visited.push_back(l); });
      ASSERT_TRUE(std::is_sorted(visited.begin(), visited.end()));
      ASSERT_EQ(std::adjacent_find(visited.begin(), visited.end()), visited.end());
      for (std::uint32_t l = 0; l < proposals.size(); ++l) {
        if (!(proposals[l].pdf_w(w) > 0.0f)) continue;
        ++met;
        EXPECT_TRUE(std::binary_search(visited.begin(), visited.end(), l))
            << scene.lights()[l].name << w;
      }
      visited_share += static_cast<double>(visited.size()) / static_cast<double>(proposals.size());
      ++directions;
    }
  }
  EXPECT_GT(met, directions);
  EXPECT_LT(visited_share / directions, most_visited);
}

TEST(LightGrid, VisitsEveryLightThatADirectionMeetsAndFewOthers) {
  expect_grid_to_visit_the_lights_met(300, 20, 2000, 0.05);
}

// Finer cells, and lights that touch many of them.
TEST(LightGrid, OfThousandsOfLightsVisitsEveryLightMetAndFewOthers) {
  expect_grid_to_visit_the_lights_met(3000, 4, 500, 0.03);
}

// Bit for bit the densities of every component, although only those that are not 0 are kept.
TEST(ManyLights, DensitiesOfAMixtureAreThoseOfEveryLight) {
  test::TestRandom random;
  for (const int lights : {40, 150}) {  // with few lights all densities are kept
    for (const bool as_one : {false, true}) {
      const Scene scene(many_lights(lights, 2));
      ASSERT_EQ(scene.lights().size() >= kManyLights, lights == 150);
      Mixture mixture(scene, LightSampling::Area, as_one, scene.lights().size() * 4);
      std::size_t samples = 0;
      for (int p = 0; p < 10; ++p) {
        const ShadingPoint point = floor_point(scene, random);
        mixture.set_up(point);
        mixture.cone() = {Vec3(0, 1, 0), 0.3f};
        std::vector<LightProposal> proposals;
        for (int l = 0; l < mixture.active_lights(); ++l) {
          proposals.emplace_back().set_up(scene.lights()[mixture.light_index(l)],
                                          LightSampling::Area, point.position,
                                          point.geometric_normal);
        }
        const int m = mixture.components();
        std::vector<int> counts(static_cast<std::size_t>(m), as_one ? 50 : 1);
        StreamKey key;
        key.pixel = static_cast<std::uint32_t>(p);
        mixture.draw(SamplerKind::Independent, key, counts);
        samples += mixture.size();
        std::vector<double> coefficients(static_cast<std::size_t>(m));
        for (double& c : coefficients) c = random.uniform();
        std::vector<double> density(mixture.size() + kLaneGroup);
        mixture.mixture_pdfs_w(0, coefficients, density);
        for (std::size_t i = 0; i < mixture.size(); ++i) {
          double sum = 0.0;
          for (const LightProposal& proposal : proposals) {
            sum += static_cast<double>(proposal.pdf_w(mixture.wi(i)));
          }
          double total = 0.0;
          for (int k = 0; k < m; ++k) {
            float expected = mixture.pdf_w(i, k);  // BSDF and cone
            if (k == mixture.component(i)) {
              expected = mixture.own_pdf(i);
            } else if (k < mixture.light_components()) {
              expected = as_one ? static_cast<float>(sum / static_cast<double>(proposals.size()))
                                : proposals[static_cast<std::size_t>(k)].pdf_w(mixture.wi(i));
            }
            ASSERT_EQ(mixture.pdf_w(i, k), expected) << i << " " << k;
            total += coefficients[static_cast<std::size_t>(k)] * static_cast<double>(expected);
          }
          ASSERT_EQ(density[i], total) << i;
          double visited = 0.0;
          mixture.for_each_pdf_w(i, [&](int k, float pdf) {
            visited += coefficients[static_cast<std::size_t>(k)] * static_cast<double>(pdf);
          });
          ASSERT_EQ(visited, total) << i;
        }
      }
      EXPECT_GT(samples, 100u);
    }
  }
}

// One sample at a time from the largest count that may give, the first of equals.
void raise_step_by_step(std::vector<int>& counts, int minimum) {
  const std::size_t cone = counts.size() - 1;
  for (std::size_t k = 0; k < cone; ++k) {
    while (counts[k] < minimum) {
      std::size_t giver = counts.size();
      for (std::size_t j = 0; j < counts.size(); ++j) {
        const bool can_give = counts[j] > (j == cone ? 0 : minimum);
        if (can_give && (giver == counts.size() || counts[j] > counts[giver])) giver = j;
      }
      ASSERT_LT(giver, counts.size());
      --counts[giver];
      ++counts[k];
    }
  }
}

RC_GTEST_PROP(RaiseToMinimum, IsOneSampleAtATimeFromTheLargest,
              (const std::vector<std::uint8_t>& given, std::uint8_t cone, bool two)) {
  const int minimum = two ? 2 : 1;
  std::vector<int> counts;
  int total = cone % 8;
  for (const std::uint8_t c : given) {
    // Many zeros and ties, some large.
    counts.push_back(c % 3 == 0 ? 0 : c % 3 == 1 ? c % 8 : c);
    total += counts.back();
  }
  RC_PRE(!counts.empty() && total >= minimum * static_cast<int>(counts.size()));
  counts.push_back(cone % 8);
  std::vector<int> expected = counts;
  raise_step_by_step(expected, minimum);
  pmc_hi::raise_to_minimum(counts, minimum);
  RC_ASSERT(counts == expected);
}

}  // namespace
}  // namespace penumbra
