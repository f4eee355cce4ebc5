// The core's float formulas against long double ones on the same inputs, over many orders of
// magnitude. Tolerances are some float roundings (6e-8 each), times the condition of the problem
// where that is stated.

#include "tests/support/oracle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "scenes/core/bsdf.h"
#include "scenes/core/warp.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

namespace oracle = test::oracle;
using oracle::Real;
using oracle::Vec3r;

double distance(const Vec3& a, const Vec3r& b) {
  return static_cast<double>((Vec3r(a) - b).length());
}

double relative_error(float value, Real exact) {
  return static_cast<double>(std::abs(static_cast<Real>(value) / exact - 1.0L));
}

TEST(FloatAgainstLongDouble, WarpsAreWithinSomeRoundings) {
  test::TestRandom random;
  for (int i = 0; i < 200'000; ++i) {
    const Vec2 u = random.variates().u;
    const Vec2 disk = sample_uniform_disk(u);
    const oracle::Vec2r exact_disk = oracle::uniform_disk(u);
    ASSERT_LT(static_cast<double>((oracle::Vec2r(disk) - exact_disk).length()), 3e-7)
        << u.x << " " << u.y;
    // sqrt(1 - r^2) has the condition r/sqrt(1 - r^2).
    const Vec3r exact = oracle::cosine_hemisphere(u);
    ASSERT_LT(distance(sample_cosine_hemisphere(u), exact),
              3e-7 + 3e-7 / std::max(3e-4, static_cast<double>(exact.z)))
        << u.x << " " << u.y;
    const auto depth = static_cast<float>(std::pow(10.0, random.uniform(-14.0, 0.3)));
    const Vec3r on_cone = oracle::uniform_cone(u, depth);
    const Vec3 sample = sample_uniform_cone(u, depth);
    ASSERT_LT(distance(sample, on_cone), 4e-7) << depth;
    // Across the axis, relative to the cone's own radius.
    const Real radius = std::sqrt(static_cast<Real>(depth) * 2.0L);
    ASSERT_LT(static_cast<double>(std::hypot(static_cast<Real>(sample.x) - on_cone.x,
                                             static_cast<Real>(sample.y) - on_cone.y) /
                                  radius),
              2e-6)
        << depth;
  }
}

// Rectangles and points of any place, distance and size.
struct View {
  Light light;
  Vec3 from;
};

View random_view(test::TestRandom& random) {
  const Vec3d across(random.direction());
  const Vec3d along = across.cross(Vec3d(random.direction())).normalized();
  const double size = std::pow(10.0, random.uniform(-5.0, 3.0));
  View view;
  view.light = test::rectangle_light(Vec3(random.direction()), Vec3(across.normalized() * size),
                                     Vec3(along * (size * random.uniform(0.1, 10.0))), true);
  view.from = Vec3(Vec3d(random.direction()) * std::pow(10.0, random.uniform(-3.0, 1.0)));
  return view;
}

TEST(FloatAgainstLongDouble, RectanglesHaveTheDensityOfTheirSamples) {
  test::TestRandom random;
  for (int i = 0; i < 20'000; ++i) {
    const View view = random_view(random);
    LightProposal p;
    if (!p.set_up(view.light, LightSampling::Area, view.from, {0, 0, 1}, true)) continue;
    for (int j = 0; j < 8; ++j) {
      const Variates v = random.variates();
      const auto sample = p.sample(v);
      const auto exact = oracle::rectangle_by_area(view.light, view.from, v.u);
      ASSERT_TRUE(sample);
      // A point next to `from` has a direction as good as the ratio of edge and distance allows.
      const double reach = (Vec3d(view.light.origin) - Vec3d(view.from)).length() +
                           Vec3d(view.light.edge_u).length() + Vec3d(view.light.edge_v).length();
      const Vec3d d = Vec3d(view.light.origin) + Vec3d(view.light.edge_u) * double{v.u.x} +
                      Vec3d(view.light.edge_v) * double{v.u.y} - Vec3d(view.from);
      const double condition = reach / d.length();
      ASSERT_LT(distance(sample->wi, exact.wi), 5e-7 * condition) << i;
      ASSERT_LT(relative_error(sample->pdf_w, exact.pdf_w), 2e-6 * condition) << i;
    }
  }
}

TEST(FloatAgainstLongDouble, RectanglesHaveTheDensityOfDirections) {
  test::TestRandom random;
  int compared = 0;
  for (int i = 0; i < 20'000; ++i) {
    const View view = random_view(random);
    LightProposal p;
    if (!p.set_up(view.light, LightSampling::Area, view.from, {0, 0, 1}, true)) continue;
    for (int j = 0; j < 8; ++j) {
      const auto sample = p.sample(random.variates());
      const Real exact = oracle::rectangle_pdf_w(view.light, view.from, sample->wi);
      const float pdf = p.pdf_w(sample->wi);
      if (exact == 0.0L || pdf == 0.0f) continue;  // on the outline
      // t = height/slope: a slope near 0 magnifies the rounding of the unit vectors, three times.
      const double slope = std::abs(view.light.plane_normal.dot(Vec3d(sample->wi)));
      ASSERT_LT(relative_error(pdf, exact), 1e-6 + 1e-6 / slope) << i << " slope " << slope;
      ++compared;
    }
  }
  EXPECT_GT(compared, 100'000);
}

TEST(FloatAgainstLongDouble, MeshesHaveTheDensityOfDirections) {
  test::TestRandom random;
  for (const double far : {1.0, 3.0, 30.0, 1e3}) {
    const Light light = test::mesh_light(test::cube_mesh({0.3 * far, 0.2 * far, far}, 1.0), true);
    LightProposal p;
    ASSERT_TRUE(p.set_up(light, LightSampling::Area, Vec3(0.0f), {0, 0, 1}, true));
    int differing = 0;
    for (int i = 0; i < 20'000; ++i) {
      const auto sample = p.sample(random.variates());
      if (!sample) continue;
      const Real exact = oracle::mesh_pdf_w(light, Vec3(0.0f), sample->wi);
      differing += exact == 0.0L || relative_error(sample->pdf_w, exact) > 1e-4 ? 1 : 0;
    }
    // Directions through an edge meet one triangle more or less; grazing ones magnify roundings.
    EXPECT_LT(differing, 20 + static_cast<int>(0.05 * far)) << far;
  }
}

TEST(FloatAgainstLongDouble, FresnelOfConductorsFromGlassToSilver) {
  test::TestRandom random;
  for (int i = 0; i < 100'000; ++i) {
    const auto cosine = static_cast<float>(std::pow(10.0, random.uniform(-7.0, 0.0)));
    const auto eta = static_cast<float>(std::pow(10.0, random.uniform(-2.0, 1.0)));
    const auto k = static_cast<float>(std::pow(10.0, random.uniform(-2.0, 1.0)));
    const Real exact = oracle::conductor_fresnel(cosine, eta, k);
    const Rgb value = conductor_fresnel(cosine, Rgb(eta), Rgb(k));
    // A reflectance near 0 is a difference: an absolute error.
    ASSERT_NEAR(static_cast<double>(value.x), static_cast<double>(exact), 2e-6)
        << cosine << " " << eta << " " << k;
  }
}

TEST(FloatAgainstLongDouble, AWrongPowerIsFound) {  // negative control
  test::TestRandom random;
  int found = 0;
  for (int i = 0; i < 100; ++i) {
    const View view = random_view(random);
    const Variates v = random.variates();
    const auto exact = oracle::rectangle_by_area(view.light, view.from, v.u);
    LightProposal p;
    if (!p.set_up(view.light, LightSampling::Area, view.from, {0, 0, 1}, true)) continue;
    found += relative_error(p.sample(v)->pdf_w * 1.00001f, exact.pdf_w) > 2e-6 ? 1 : 0;
  }
  EXPECT_GT(found, 90);
}

}  // namespace
}  // namespace penumbra
