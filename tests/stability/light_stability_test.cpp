// Lights at the ends of what float can hold, each against a long double oracle, and next to it the
// naive formula, which has to fail the same check.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "scenes/core/light.h"
#include "scenes/core/scene.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using Real = long double;

constexpr double kTolerance = 1e-5;
const Vec3 kOrigin(0.0f);
const Vec3 kUp(0.0f, 0.0f, 1.0f);

bool agrees(double value, double exact) {
  return std::abs(value - exact) <= kTolerance * std::abs(exact);
}

LightProposal proposal(const Light& light, LightSampling sampling, const Vec3& from = kOrigin) {
  LightProposal p;
  EXPECT_TRUE(p.set_up(light, sampling, from, kUp, true));
  return p;
}

// Mean of 1/pdf by the midpoint rule.
double mean_inverse_pdf(const LightProposal& p, int side) {
  double sum = 0.0;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const Vec2 u((static_cast<float>(i) + 0.5f) / static_cast<float>(side),
                   (static_cast<float>(j) + 0.5f) / static_cast<float>(side));
      const auto sample = p.sample({u, 0.5f});
      EXPECT_TRUE(sample && sample->pdf_w > 0.0f && std::isfinite(sample->pdf_w));
      sum += 1.0 / static_cast<double>(sample->pdf_w);
    }
  }
  return sum / side / side;
}

// The solid angle that the light's samples stand for, without the rule's error of second order.
double sampled_solid_angle(const LightProposal& p) {
  return (4.0 * mean_inverse_pdf(p, 128) - mean_inverse_pdf(p, 64)) / 3.0;
}

// Square of side 10^-k over the origin, facing down.
Light square(int k) {
  const auto side = static_cast<float>(std::pow(10.0, -k));
  return test::rectangle_light(Vec3(0.3f, 0.2f, 1.0f), {0, side, 0}, {side, 0, 0});
}

// Girard's theorem as in the paper on spherical rectangles: four dihedral angles minus 2 pi.
float solid_angle_by_arccosines(const Light& light) {
  const float x0 = light.origin.x;
  const float y0 = light.origin.y;
  const float x1 = x0 + light.edge_v.x;
  const float y1 = y0 + light.edge_u.y;
  const float z2 = light.origin.z * light.origin.z;
  const float n0 = -y0 / std::sqrt(z2 + y0 * y0);
  const float n1 = x1 / std::sqrt(z2 + x1 * x1);
  const float n2 = y1 / std::sqrt(z2 + y1 * y1);
  const float n3 = -x0 / std::sqrt(z2 + x0 * x0);
  return std::acos(-n0 * n1) + std::acos(-n1 * n2) + std::acos(-n2 * n3) + std::acos(-n3 * n0) -
         2.0f * std::numbers::pi_v<float>;
}

TEST(TinyRectangle, SamplesStandForItsSolidAngleDownToASideOf1eMinus8) {
  for (const LightSampling sampling : {LightSampling::Area, LightSampling::SolidAngle}) {
    for (int k = 0; k <= 8; ++k) {
      const Light light = square(k);
      const auto exact = static_cast<double>(test::rectangle_solid_angle(light, kOrigin));
      const double sampled = sampled_solid_angle(proposal(light, sampling));
      EXPECT_TRUE(agrees(sampled, exact))
          << "side 1e-" << k << " by " << to_string(sampling) << ": " << sampled / exact - 1.0;
    }
  }
}

TEST(TinyRectangle, ArccosinesInFloatFail) {  // negative control
  for (int k = 2; k <= 8; ++k) {
    const Light light = square(k);
    const auto exact = static_cast<double>(test::rectangle_solid_angle(light, kOrigin));
    EXPECT_FALSE(agrees(double{solid_angle_by_arccosines(light)}, exact)) << "side 1e-" << k;
  }
}

// A rectangle of any orientation and a point beside it, a given height over its plane.
struct EdgeOn {
  Light light;
  Vec3 from;
};

EdgeOn edge_on(test::TestRandom& random, double height) {
  const Vec3d normal(random.direction());
  const Vec3d across = normal.cross(Vec3d(random.direction())).normalized();
  const Vec3d along = normal.cross(across);
  EdgeOn view;
  view.light = test::rectangle_light(Vec3(random.direction()), Vec3(across), Vec3(along), true);
  const Vec3d beside = across * random.uniform(1.5, 3.0) + along * random.uniform(-1.0, 2.0);
  view.from = Vec3(Vec3d(view.light.origin) + beside + view.light.plane_normal * height);
  return view;
}

// Height of the point over the plane in the precision of the vectors.
float height_in_float(const EdgeOn& view) {
  return std::abs(dot(view.light.normal, view.light.origin - view.from));
}

Real exact_height(const EdgeOn& view) {
  using Vec3l = Imath::Vec3<Real>;
  const Vec3l n = Vec3l(view.light.edge_u).cross(Vec3l(view.light.edge_v));
  return std::abs(n.dot(Vec3l(view.light.origin) - Vec3l(view.from))) / n.length();
}

TEST(EdgeOnRectangle, SamplesStandForItsSolidAngleDownToAHeightOf1eMinus5) {
  test::TestRandom random;
  int naive_failures = 0;
  for (int k = 1; k <= 5; ++k) {
    for (int i = 0; i < 20; ++i) {
      const EdgeOn view = edge_on(random, std::pow(10.0, -k));
      const auto exact = static_cast<double>(test::rectangle_solid_angle(view.light, view.from));
      const double sampled =
          sampled_solid_angle(proposal(view.light, LightSampling::Area, view.from));
      EXPECT_TRUE(agrees(sampled, exact)) << "height 1e-" << k << ": " << sampled / exact - 1.0;
      // The solid angle is in proportion to the height that the density has: negative control.
      naive_failures +=
          agrees(double{height_in_float(view)}, static_cast<double>(exact_height(view))) ? 0 : 1;
    }
  }
  EXPECT_GT(naive_failures, 50) << "of 100: a height in float would do";
}

TEST(EdgeOnRectangle, InItsOwnPlaneItIsLeftOut) {
  for (const LightSampling sampling : {LightSampling::Area, LightSampling::SolidAngle}) {
    LightProposal p;
    const Light light = test::rectangle_light({1, 0, -1}, {1, 0, 0}, {0, 0, 2}, true);
    EXPECT_FALSE(p.set_up(light, sampling, kOrigin, kUp));
    EXPECT_FALSE(p.set_up(light, sampling, kOrigin, kUp, true))
        << "no density, even if all is kept";
  }
}

// Distance 1, radius r: 1 - cos of the cone's half angle.
Real sphere_depth(float radius) {
  const Real r = radius;
  return r * r / (1.0L + std::sqrt((1.0L - r) * (1.0L + r)));
}

float sphere_depth_by_cosine(float radius) { return 1.0f - std::sqrt(1.0f - radius * radius); }

TEST(SphereLight, DensityIsOneOverItsSolidAngleFromTinyToTouching) {
  std::vector<float> radii;
  for (int k = 1; k <= 8; ++k) radii.push_back(static_cast<float>(std::pow(10.0, -k)));
  for (int k = 1; k <= 24; ++k) radii.push_back(static_cast<float>(1.0 - std::ldexp(1.0, -k)));
  int naive_failures = 0;
  for (const float radius : radii) {
    const LightProposal p = proposal(test::sphere_light(kUp, radius), LightSampling::SolidAngle);
    const auto exact = static_cast<double>(2.0L * std::numbers::pi_v<Real> * sphere_depth(radius));
    EXPECT_TRUE(agrees(1.0 / double{p.sample({Vec2(0.5f), 0.5f})->pdf_w}, exact)) << radius;
    naive_failures +=
        agrees(double{sphere_depth_by_cosine(radius)}, static_cast<double>(sphere_depth(radius)))
            ? 0
            : 1;
  }
  EXPECT_GT(naive_failures, 5) << "a cosine in float would do";
}

// A sphere that is two roundings away, in any direction: distance and radius cancel.
TEST(SphereLight, DensityIsOneOverItsSolidAngleNextToItsSurface) {
  test::TestRandom random;
  int naive_failures = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 center = random.direction() * 1.7f;
    const Real x = center.x, y = center.y, z = center.z;
    const Real distance2 = x * x + y * y + z * z;
    const Real distance = std::sqrt(distance2);
    const float radius = std::nextafter(static_cast<float>(distance * (1.0L - 0x1p-24L)), 0.0f);
    const Real r = radius;
    const Real depth = r * r / (distance * (distance + std::sqrt(distance2 - r * r)));
    const auto exact = static_cast<double>(2.0L * std::numbers::pi_v<Real> * depth);
    const LightProposal p = proposal(test::sphere_light(center, radius), LightSampling::SolidAngle);
    EXPECT_TRUE(agrees(1.0 / double{p.sample({Vec2(0.5f), 0.5f})->pdf_w}, exact)) << center;
    const float sine2 = radius * radius / center.length2();
    const float naive = sine2 / (1.0f + std::sqrt(std::max(0.0f, 1.0f - sine2)));
    naive_failures += agrees(double{naive}, static_cast<double>(depth)) ? 0 : 1;
  }
  EXPECT_GT(naive_failures, 500) << "negative control: in float";
}

TEST(SphereLight, OnItsSurfaceAndInsideOnlyATwoSidedOneLights) {
  for (const float radius : {1.0f, std::nextafter(1.0f, 2.0f), 2.0f, 1e6f}) {
    LightProposal p;
    EXPECT_FALSE(
        p.set_up(test::sphere_light(kUp, radius), LightSampling::SolidAngle, kOrigin, kUp));
    ASSERT_TRUE(
        p.set_up(test::sphere_light(kUp, radius, true), LightSampling::SolidAngle, kOrigin, kUp));
    EXPECT_TRUE(agrees(double{p.pdf_w(kUp)}, 0.25 / std::numbers::pi)) << radius;
  }
}

// A quad that stands on the floor, seen from 10^-k beside its foot: the weights of samples by solid
// angle stay bounded, those by area do not.
TEST(TouchingRectangle, WeightsBySolidAngleAreBoundedAndTheirMeanIsExact) {
  test::TestRandom random;
  const double bound = test::z_bound(test::sidak(1e-4, 16));
  double largest_by_area = 0.0;
  for (int k = 0; k <= 7; ++k) {
    const auto gap = static_cast<float>(std::pow(10.0, -k));
    const Light light = test::rectangle_light({gap, 1, 0}, {0, -2, 0}, {0, 0, 1}, true);
    const double exact = test::rectangle_irradiance(light, kOrigin, kUp);
    const LightProposal by_angle = proposal(light, LightSampling::SolidAngle);
    const LightProposal by_area = proposal(light, LightSampling::Area);
    test::Moments moments;
    for (int i = 0; i < 20000; ++i) {
      const Variates v = random.variates();
      const auto sample = by_angle.sample(v);
      const double weight = double{sample->wi.z} / double{sample->pdf_w};
      ASSERT_LE(weight, 2.0 * std::numbers::pi * (1.0 + kTolerance)) << gap;
      moments.add(weight);
      const auto other = by_area.sample(v);
      largest_by_area =
          std::max(largest_by_area, double{other->wi.z} / double{other->pdf_w} / exact);
    }
    EXPECT_LT(moments.z(exact, 1e-6), bound) << gap << ": " << moments.mean() / exact;
  }
  EXPECT_GT(largest_by_area, 1e3) << "negative control";
}

std::vector<Light> consistent_lights() {
  return {test::rectangle_light({-0.5f, -0.5f, 1}, {0, 1, 0}, {1, 0, 0}),
          test::rectangle_light({0.3f, 0.2f, 1}, {0, 1e-2f, 0}, {1e-2f, 0, 0}),
          test::rectangle_light({0.5f, -1.0f, 0.2f}, {0.0f, 0.6f, 0.8f}, {0.0f, 1.6f, -1.2f}),
          test::rectangle_light({-2, -3, 4}, {0, 3, 0}, {7, 0, 0}),
          test::sphere_light({0.5f, 0.2f, 2.0f}, 0.5f),
          test::sphere_light({0, 0, 100}, 1.0f)};
}

// The density evaluated for a sample's direction against the one it was drawn with.
TEST(LightDensity, EvaluatedAndDrawnAgreeToOneInAHundredThousand) {
  test::TestRandom random;
  for (const Light& light : consistent_lights()) {
    for (const LightSampling sampling : {LightSampling::Area, LightSampling::SolidAngle}) {
      const LightProposal p = proposal(light, sampling);
      int over_the_outline = 0;
      for (int i = 0; i < 100'000; ++i) {
        const auto sample = p.sample(random.variates());
        const float evaluated = p.pdf_w(sample->wi);
        if (evaluated == 0.0f) {
          ++over_the_outline;
          continue;
        }
        ASSERT_TRUE(agrees(double{evaluated}, double{sample->pdf_w}))
            << sample->wi << ": " << evaluated << " and " << sample->pdf_w;
      }
      // Rounding moves directions by 1e-7; the narrowest light is 1e-2 wide.
      EXPECT_LT(over_the_outline, 100) << to_string(sampling);
    }
  }
}

// The same far from the origin in float, without recentring: what a scene would be like that is not
// normalised.
TEST(LightDensity, WorldCoordinatesInFloatFail) {  // negative control
  test::TestRandom random;
  const Vec3 far(1e4f, -3e4f, 2e4f);
  const Light near = consistent_lights()[1];
  const Light light = test::rectangle_light(near.origin + far, near.edge_u, near.edge_v);
  const LightProposal p = proposal(light, LightSampling::Area, far);
  const LightProposal exact = proposal(near, LightSampling::Area);
  int failures = 0;
  for (int i = 0; i < 10'000; ++i) {
    const auto sample = exact.sample(random.variates());
    failures += agrees(double{p.pdf_w(sample->wi)}, double{sample->pdf_w}) ? 0 : 1;
  }
  EXPECT_GT(failures, 500);
}

TriangleMeshShape sliver(double aspect) {
  TriangleMeshShape mesh;
  mesh.vertices = {{-0.61, -0.37, 1.13}, {0.53, 0.71, 1.41}, {0.0, 0.0, 0.0}};
  const Vec3d along = mesh.vertices[1] - mesh.vertices[0];
  const Vec3d across = along.cross(Vec3d(0.3, -0.2, 0.9)).normalized();
  mesh.vertices[2] = mesh.vertices[0] + along * 0.37 + across * (along.length() / aspect);
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

TEST(SliverLight, SamplesAreFiniteUpToAnAspectOfAMillion) {
  test::TestRandom random;
  for (int k = 1; k <= 6; ++k) {
    const Light light = test::mesh_light(sliver(std::pow(10.0, k)), true);
    LightProposal p;
    ASSERT_TRUE(p.set_up(light, LightSampling::Area, kOrigin, kUp));
    for (int i = 0; i < 10000; ++i) {
      const auto sample = p.sample(random.variates());
      if (!sample) continue;
      ASSERT_TRUE(std::isfinite(sample->pdf_w) && sample->pdf_w > 0.0f) << k;
      ASSERT_NEAR(sample->wi.length(), 1.0f, 5e-7f) << k;
    }
  }
}

TEST(SliverLight, AreaOfALoadedMeshIsThatOfItsVerticesWhereFloatFails) {
  int naive_failures = 0;
  for (int k = 1; k <= 6; ++k) {
    SceneDescription description;
    description.materials = {test::lambert(0.5f)};
    description.shapes = {test::shape("floor", RectangleShape{{-1, -1, 0}, {2, 0, 0}, {0, 2, 0}}),
                          test::light("sliver", sliver(std::pow(10.0, k)), Rgb(1.0f), true)};
    const Scene scene(description);
    const std::vector<Vec3>& v = scene.lights()[0].vertices;
    using Vec3l = Imath::Vec3<Real>;
    const Vec3l n = (Vec3l(v[1]) - Vec3l(v[0])).cross(Vec3l(v[2]) - Vec3l(v[0]));
    const auto exact = static_cast<double>(0.5L * n.length());
    EXPECT_TRUE(agrees(scene.lights()[0].area, exact)) << k;
    const float in_float = 0.5f * cross(v[1] - v[0], v[2] - v[0]).length();
    naive_failures += agrees(double{in_float}, exact) ? 0 : 1;
  }
  EXPECT_GT(naive_failures, 0) << "negative control";
}

// Triangles without area are never drawn and add nothing.
TEST(DegenerateTriangles, ChangeNothingOfAMeshLight) {
  const TriangleMeshShape cube = test::cube_mesh({0.4, 0.3, 2.0}, 1.0);
  TriangleMeshShape worse = cube;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    worse.triangles.push_back({i % 8, i % 8, (i + 3) % 8});
  }
  const Light sound = test::mesh_light(cube);
  const Light degenerate = test::mesh_light(worse);
  EXPECT_EQ(degenerate.area, sound.area);
  const LightProposal a = proposal(sound, LightSampling::Area);
  const LightProposal b = proposal(degenerate, LightSampling::Area);
  test::TestRandom random;
  for (int i = 0; i < 20000; ++i) {
    const Variates v = random.variates();
    const auto x = a.sample(v);
    const auto y = b.sample(v);
    ASSERT_TRUE(x && y);
    ASSERT_EQ(x->wi, y->wi);
    ASSERT_EQ(x->pdf_w, y->pdf_w);
  }
}

}  // namespace
}  // namespace penumbra
