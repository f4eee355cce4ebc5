// One- and two-sided emitters of every shape, from both sides: what is seen, what samples and
// densities say of it, and what every registered estimator makes of it.
//
// False alarms: all comparisons of this file together raise one with probability 1e-4 (Sidak, 600
// tests).

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/core/trace.h"
#include "tests/support/fixtures.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra::fixtures {
namespace {

constexpr double kAlbedo = 0.7;
constexpr double kRadiance = 2.0;
const Vec3d kUp(0, 0, 1);

/// A closed or open surface, and a point on each side of it with its irradiance from the emitting
/// side that it sees.
struct Emitter {
  std::string name;
  Shape shape;
  Vec3d front, front_normal, back, back_normal;
  double front_irradiance, back_irradiance;  ///< of radiance 1, when that side emits
};

/// The square as a quad mesh of 2 x 2 and as triangles, normal +z.
QuadMeshShape square_quads() {
  QuadMeshShape mesh;
  for (int i = 0; i < 9; ++i) mesh.vertices.push_back({i % 3 * 0.5 - 0.5, i / 3 * 0.5 - 0.5, 0.0});
  mesh.quads = {{0, 1, 4, 3}, {1, 2, 5, 4}, {3, 4, 7, 6}, {4, 5, 8, 7}};
  return mesh;
}

TriangleMeshShape square_triangles() {
  const QuadMeshShape quads = square_quads();
  TriangleMeshShape mesh;
  mesh.vertices = quads.vertices;
  for (const auto& q : quads.quads) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  return mesh;
}

std::vector<Emitter> emitters() {
  const RectangleShape square{{-0.5, -0.5, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Vec3d> corners = {
      {-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}};
  const Vec3d above(0.2, 0.1, 1.0), below(0.2, 0.1, -1.0);
  const double flat = test::polygon_irradiance(corners, below, kUp);
  std::vector<Emitter> result;
  for (const auto& [name, shape] : std::vector<std::pair<std::string, Shape>>{
           {"rectangle", square}, {"quads", square_quads()}, {"triangles", square_triangles()}}) {
    result.push_back({name, shape, above, -kUp, below, kUp, flat, flat});
  }
  // Inside a closed surface of radiance 1 the irradiance is pi at every point.
  const Vec3d outside(0.3, 0.0, -2.0), inside(0.1, 0.2, -0.3);
  const Vec3d to_center = -outside.normalized();
  result.push_back({"sphere", SphereShape{{0, 0, 0}, 1.0}, outside, kUp, inside, kUp,
                    M_PI / outside.length2() * to_center.dot(kUp), M_PI});
  const TriangleMeshShape cube = test::cube_mesh({0, 0, 0}, 1.6);
  double faces = 0.0;
  for (const auto& t : cube.triangles) {
    const Vec3d triangle[3] = {cube.vertices[t[0]], cube.vertices[t[1]], cube.vertices[t[2]]};
    const Vec3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    if (normal.dot(outside - triangle[0]) > 0.0) {
      faces += test::polygon_irradiance(triangle, outside, kUp);
    }
  }
  result.push_back({"cube", cube, outside, kUp, inside, kUp, faces, M_PI});
  return result;
}

SceneDescription scene_of(const Emitter& emitter, bool two_sided) {
  SceneDescription scene;
  scene.materials = {lambert("grey", kAlbedo), lambert("black", 0.0)};
  ShapeDescription shape;
  shape.name = emitter.name;
  shape.material = 1;
  shape.shape = emitter.shape;
  shape.emission = EmissionDescription{Rgb(static_cast<float>(kRadiance)), two_sided};
  scene.shapes = {shape};
  return scene;
}

PlacedPoint placed(const SceneDescription& scene, const Vec3d& position, const Vec3d& normal) {
  PlacedPoint result{std::make_unique<Scene>(scene), {}};
  result.point = place(*result.scene, position, normal, normal, 0);
  return result;
}

TEST(EmitterSides, ARaySeesTheEmissionOfTheSideThatItMeets) {
  for (const Emitter& e : emitters()) {
    for (const bool two_sided : {false, true}) {
      const Scene scene(scene_of(e, two_sided));
      const Vec3 front = Vec3(e.front_normal), back = Vec3(e.back_normal);
      const Vec3 from_front = test::to_scene(scene, e.front);
      const Vec3 from_back = test::to_scene(scene, e.back);
      const RayHit a = test::trace(scene, from_front, front);
      const RayHit b = test::trace(scene, from_back, back);
      ASSERT_TRUE(a.hit() && b.hit()) << e.name;
      EXPECT_EQ(scene.emitter(a, front), 0) << e.name;
      EXPECT_EQ(scene.emitter(b, back), two_sided ? 0 : kNoLight) << e.name;
      EXPECT_EQ(scene.shading_point(a, from_front, front).light, 0) << e.name;
      EXPECT_EQ(scene.shading_point(b, from_back, back).light, two_sided ? 0 : kNoLight) << e.name;
    }
  }
}

// Every direction that a light is sampled in has the density it was drawn with, and its ray meets
// the light; random directions have a density exactly where their ray meets it.
TEST(EmitterSides, SamplesDensitiesAndRaysAgreeFromBothSides) {
  test::TestRandom random;
  for (const Emitter& e : emitters()) {
    for (const bool from_front : {true, false}) {
      for (const LightSampling sampling : {LightSampling::Area, LightSampling::SolidAngle}) {
        const Scene scene(scene_of(e, true));
        const Vec3 from = test::to_scene(scene, from_front ? e.front : e.back);
        const Vec3 normal(from_front ? e.front_normal : e.back_normal);
        LightProposal proposal;
        ASSERT_TRUE(proposal.set_up(scene.lights()[0], sampling, from, normal)) << e.name;
        int missed = 0;
        int differ = 0;
        for (int i = 0; i < 2000; ++i) {
          const auto sample = proposal.sample(random.variates());
          ASSERT_TRUE(sample.has_value()) << e.name;
          missed += test::trace(scene, from, sample->wi).hit() ? 0 : 1;
          differ += std::abs(proposal.pdf_w(sample->wi) / sample->pdf_w - 1.0f) > 1e-4f ? 1 : 0;
          const Vec3 any = random.direction();
          differ += (proposal.pdf_w(any) > 0.0f) != test::trace(scene, from, any).hit() ? 1 : 0;
        }
        // Roundings next to the outline.
        EXPECT_LE(missed, 1) << e.name;
        EXPECT_LE(differ, 1) << e.name;
      }
    }
  }
}

TEST(EmitterSides, EveryEstimatorSeesTheEmittingSidesOnly) {
  for (const Emitter& e : emitters()) {
    for (const bool two_sided : {false, true}) {
      const SceneDescription scene = scene_of(e, two_sided);
      const PlacedPoint front = placed(scene, e.front, e.front_normal);
      const PlacedPoint back = placed(scene, e.back, e.back_normal);
      const double front_exact = kAlbedo / M_PI * kRadiance * e.front_irradiance;
      const double back_exact = kAlbedo / M_PI * kRadiance * e.back_irradiance;
      for (const EstimatorEntry* entry : all_estimators()) {
        const ParamSet params = params_with(*entry, {});
        if (!entry->bias_reason(params).empty()) continue;
        const Budget budget{SamplerKind::Independent, 4, 12};
        const std::string label = e.name + (two_sided ? "2" : "1") + std::string(entry->name);
        const double limit = family_limit(1e-4, 600);
        const auto seen =
            estimate_many(*entry, params, budget, front, front_exact, test_seed(label), 10'000);
        EXPECT_TRUE(is_unbiased(seen, front_exact, limit))
            << label << " front: " << seen.mean << ", exact " << front_exact;
        const double exact = two_sided ? back_exact : 0.0;
        const auto behind = estimate_many(*entry, params, budget, back, back_exact,
                                          test_seed(label + " back"), 10'000);
        EXPECT_TRUE(is_unbiased(behind, exact, limit))
            << label << " back: " << behind.mean << ", exact " << exact;
        EXPECT_TRUE(two_sided || behind.mean == 0.0) << label;
      }
    }
  }
}

}  // namespace
}  // namespace penumbra::fixtures
