#include "scenes/core/light.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "scenes/core/warp.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using test::SphereGrid;

// All statistical checks of this file together (fewer than 200) raise a false alarm with
// probability 1e-4.
const double kLevel = test::sidak(1e-4, 200);
const Vec3 kOrigin(0.0f);
const Vec3 kUp(0.0f, 0.0f, 1.0f);

constexpr LightSampling kSamplings[] = {LightSampling::Area, LightSampling::SolidAngle,
                                        LightSampling::Cosine};

/// A light and a way to sample it, seen from the origin with the normal +z.
struct View {
  std::string name;
  Light light;
  LightSampling sampling;
};

/// Rectangle around a point over the origin, facing down: edge_u x edge_v points to -z.
Light panel(float width, float depth, const Vec3& middle) {
  return test::rectangle_light(middle - Vec3(width, depth, 0) * 0.5f, {0, depth, 0}, {width, 0, 0});
}

Light tilted_panel() {  // faces the origin obliquely
  return test::rectangle_light({0.5f, -1.0f, 0.2f}, {0.0f, 0.6f, 0.8f}, {0.0f, 1.6f, -1.2f});
}

std::vector<View> rectangle_views() {
  std::vector<View> views;
  for (const LightSampling sampling : kSamplings) {
    const std::string suffix = " by " + std::string(to_string(sampling));
    views.push_back({"near rectangle" + suffix, panel(1.0f, 2.0f, {0.3f, 0.1f, 0.7f}), sampling});
    views.push_back({"far rectangle" + suffix, panel(1.0f, 2.0f, {3.0f, 5.0f, 12.0f}), sampling});
    views.push_back({"tilted rectangle" + suffix, tilted_panel(), sampling});
    views.push_back({"partly below rectangle" + suffix,
                     test::rectangle_light({1, -1, -1}, {0, 0, 3}, {0, 2, 0}, true), sampling});
    views.push_back({"tiny rectangle" + suffix, panel(0.01f, 0.02f, {0.2f, 0.1f, 1.0f}), sampling});
  }
  for (const LightSampling sampling : {LightSampling::SolidAngle, LightSampling::Cosine}) {
    const std::string suffix = " by " + std::string(to_string(sampling));
    views.push_back({"close rectangle" + suffix, panel(1.0f, 1.0f, {0.0f, 0.0f, 0.01f}), sampling});
    views.push_back({"huge rectangle" + suffix, panel(1e3f, 1e3f, {0.0f, 0.0f, 0.1f}), sampling});
  }
  return views;
}

std::vector<View> round_views() {
  const auto s = LightSampling::SolidAngle;
  return {{"sphere", test::sphere_light({0.5f, 0.2f, 2.0f}, 0.5f), s},
          {"far sphere", test::sphere_light({50.0f, 20.0f, 100.0f}, 1.0f), s},
          {"near sphere", test::sphere_light({0.0f, 0.1f, 1.0f}, 1.004f), s},
          {"partly below sphere", test::sphere_light({2.0f, 0.0f, 0.3f}, 1.0f), s},
          {"sphere from inside", test::sphere_light({0.0f, 0.1f, 0.3f}, 1.0f, true), s}};
}

std::vector<View> mesh_views() {
  const auto s = LightSampling::Area;
  return {{"cube", test::mesh_light(test::cube_mesh({0.4, 0.3, 2.0}, 1.0)), s},
          {"near cube", test::mesh_light(test::cube_mesh({0.1, 0.2, 0.9}, 1.0)), s},
          {"tetrahedron", test::mesh_light(test::tetrahedron_mesh({1.0, 0.2, 1.0}, 0.7)), s},
          {"far tetrahedron", test::mesh_light(test::tetrahedron_mesh({30.0, 10.0, 50.0}, 0.7)), s},
          {"cube from inside", test::mesh_light(test::cube_mesh({0.1, 0.2, 0.3}, 1.5), true), s}};
}

std::vector<View> all_views() {
  std::vector<View> views = rectangle_views();
  for (auto more : {round_views(), mesh_views()})
    views.insert(views.end(), more.begin(), more.end());
  return views;
}

LightProposal proposal(const View& view) {
  LightProposal p;
  EXPECT_TRUE(p.set_up(view.light, view.sampling, kOrigin, kUp)) << view.name;
  return p;
}

// The cap of directions around a light: from its middle to its farthest corner, a little more.
SphereGrid grid_around(const Light& light) {
  const Vec3 low = light.bounds_min;
  const Vec3 high = light.bounds_max;
  const Vec3 middle = (low + high) * 0.5f;
  const bool inside = low.x < 0 && low.y < 0 && low.z < 0 && high.x > 0 && high.y > 0 && high.z > 0;
  if (inside || middle.length() == 0.0f) return SphereGrid::cap(kUp, 2.0, 16, 24);
  const Vec3d axis = Vec3d(middle).normalized();
  double depth = 0.0;
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner(i & 1 ? low.x : high.x, i & 2 ? low.y : high.y, i & 4 ? low.z : high.z);
    depth = std::max(depth, 0.5 * (Vec3d(corner).normalized() - axis).length2());
  }
  if (light.type == LightType::Sphere) {
    const double s = std::min(1.0, double{light.radius} / Vec3d(light.center).length());
    depth = 1.0 - std::sqrt(1.0 - s * s);
  }
  return SphereGrid::cap(middle, std::min(2.0, depth * 1.01), 16, 24);
}

test::DirectionFit fit(const View& view, double pdf_factor = 1.0) {
  test::TestRandom random;
  const LightProposal p = proposal(view);
  return test::fit_directions(
      grid_around(view.light),
      [&]() -> std::optional<Vec3> {
        const auto sample = p.sample(random.variates());
        return sample ? std::optional(sample->wi) : std::nullopt;
      },
      [&](const Vec3& wi) { return pdf_factor * double{p.pdf_w(wi)}; }, 40000, 32);
}

TEST(LightProposal, SampledDirectionsMatchPdfByChiSquare) {
  for (const View& view : all_views()) {
    const auto result = fit(view);
    EXPECT_GT(result.p, kLevel) << view.name;
    EXPECT_EQ(result.missing, 0.0) << view.name;
    EXPECT_EQ(result.outside, 0.0) << view.name;
    // Midpoint nodes next to the outline are in or out: half a per cent is left.
    EXPECT_NEAR(result.integral, 1.0, 6e-3) << view.name;
  }
}

TEST(LightProposal, ChiSquareRejectsTheOtherSamplingsDensity) {  // negative control
  const View by_area{"", panel(1.0f, 2.0f, {0.3f, 0.1f, 0.7f}), LightSampling::Area};
  const View by_angle{"", by_area.light, LightSampling::SolidAngle};
  test::TestRandom random;
  const LightProposal drawn = proposal(by_area);
  const LightProposal claimed = proposal(by_angle);
  const auto result = test::fit_directions(
      grid_around(by_area.light),
      [&] { return std::optional(drawn.sample(random.variates())->wi); },
      [&](const Vec3& wi) { return double{claimed.pdf_w(wi)}; }, 40000, 16);
  EXPECT_LT(result.p, kLevel);
  EXPECT_LT(fit(by_angle, 0.97).p, kLevel);
}

TEST(LightProposal, PdfOfASampledDirectionIsTheSamplesPdf) {
  test::TestRandom random;
  for (const View& view : all_views()) {
    const LightProposal p = proposal(view);
    constexpr int kDraws = 20000;
    int disagree = 0;
    for (int i = 0; i < kDraws; ++i) {
      const auto sample = p.sample(random.variates());
      ASSERT_TRUE(sample.has_value()) << view.name;
      ASSERT_NEAR(sample->wi.length(), 1.0f, 5e-7f) << view.name;
      ASSERT_TRUE(sample->pdf_w > 0.0f && std::isfinite(sample->pdf_w)) << view.name;
      const float pdf = p.pdf_w(sample->wi);
      disagree += std::abs(pdf - sample->pdf_w) > 1e-4f * sample->pdf_w ? 1 : 0;
    }
    // Rounding moves directions over the outline, by about 1e-7 of a radian of lights 1e-2 wide or
    // more; and hidden sides of a mesh have creases where a crossing is lost.
    EXPECT_LE(disagree, kDraws / 2000) << view.name;
  }
}

TEST(LightProposal, ExtremeVariatesGiveFiniteSamplesOfTheLight) {
  for (const View& view : all_views()) {
    const LightProposal p = proposal(view);
    for (const float x : {0.0f, 0x1p-32f, 0.5f, 1.0f - 0x1p-24f}) {
      for (const float y : {0.0f, 0x1p-32f, 0.5f, 1.0f - 0x1p-24f}) {
        for (const float choice : {0.0f, 0x1p-32f, 0.5f, 1.0f - 0x1p-24f}) {
          const auto sample = p.sample({Vec2(x, y), choice});
          if (!sample) continue;
          EXPECT_TRUE(std::isfinite(sample->wi.x + sample->wi.y + sample->wi.z)) << view.name;
          EXPECT_TRUE(sample->pdf_w > 0.0f && std::isfinite(sample->pdf_w)) << view.name;
        }
      }
    }
  }
}

// E[1/pdf] over the sampled directions is the solid angle.
test::Moments mean_inverse_pdf(const LightProposal& p, int draws) {
  test::TestRandom random;
  test::Moments moments;
  for (int i = 0; i < draws; ++i) moments.add(1.0 / double{p.sample(random.variates())->pdf_w});
  return moments;
}

TEST(RectangleLight, MeanOfInversePdfIsTheSolidAngleDownTo1eMinus6) {
  for (const LightSampling sampling : kSamplings) {
    for (int k = 0; k <= 6; ++k) {
      const auto side = static_cast<float>(std::pow(10.0, -k));
      const View view{"side 1e-" + std::to_string(k), panel(side, side, {0.3f, 0.2f, 1.0f}),
                      sampling};
      const auto exact = static_cast<double>(test::rectangle_solid_angle(view.light, kOrigin));
      const auto moments = mean_inverse_pdf(proposal(view), 20000);
      EXPECT_LT(moments.z(exact, 2e-6), test::z_bound(kLevel))
          << view.name << " by " << to_string(sampling);
      // The bound is not slack: 1e-5 wherever the variance does not rule.
      EXPECT_LT(moments.standard_error(), 2e-3 * exact) << view.name;
    }
  }
}

TEST(RectangleLight, PdfBySolidAngleIsOneOverTheSolidAngleForEveryShape) {
  const std::vector<Light> lights = {
      panel(1.0f, 1.0f, {0, 0, 1}),           panel(1e6f, 1e6f, {0, 0, 1e-3f}),
      panel(1e3f, 1e-2f, {0, 0, 1}),          panel(1e-1f, 1e-1f, {5, 3, 1e-3f}),
      panel(1.0f, 1.0f, {0.5f, 0.5f, 1e-5f}), tilted_panel(),
      panel(0.01f, 0.01f, {0, 0, 1}),         panel(100.0f, 100.0f, {49.0f, 0, 1e-2f})};
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const LightProposal p = proposal({std::to_string(i), lights[i], LightSampling::SolidAngle});
    const auto exact = static_cast<double>(test::rectangle_solid_angle(lights[i], kOrigin));
    if (exact < 2e-5) continue;  // flat to rounding: sampled by area
    EXPECT_NEAR(double{p.sample({Vec2(0.3f, 0.6f), 0.5f})->pdf_w} * exact, 1.0, 1e-6) << i;
  }
}

TEST(RectangleLight, HugePanelSendsTheEndsOfTheSquareToItsOppositeEdges) {
  const Light light = panel(1e6f, 1e6f, {0, 0, 1e-3f});
  const LightProposal p = proposal({"huge", light, LightSampling::SolidAngle});
  const Vec3d along = Vec3d(light.edge_v).normalized();
  for (const float x : {0.2f, 0.5f, 0.8f}) {
    EXPECT_LT(Vec3d(p.sample({Vec2(x, 0.0f), 0.5f})->wi).dot(along), -0.5);
    EXPECT_GT(Vec3d(p.sample({Vec2(x, 1.0f - 0x1p-24f), 0.5f})->wi).dot(along), 0.5);
  }
}

TEST(RectangleLight, HugePanelGivesTheRadiosityOfAFullHemisphere) {
  const LightProposal p =
      proposal({"huge", panel(1e6f, 1e6f, {0, 0, 1e-3f}), LightSampling::SolidAngle});
  test::TestRandom random;
  test::Moments moments;
  for (int i = 0; i < 100000; ++i) {
    const auto sample = p.sample(random.variates());
    moments.add(std::max(0.0, double{sample->wi.z}) / double{sample->pdf_w});
  }
  EXPECT_LT(moments.z(std::numbers::pi, 1e-6), test::z_bound(kLevel));
}

TEST(RectangleLight, MonteCarloIrradianceIsLambertsPolygonFormula) {
  test::TestRandom random;
  for (const View& view : rectangle_views()) {
    if (view.name.starts_with("close")) continue;
    const LightProposal p = proposal(view);
    test::Moments moments;
    for (int i = 0; i < 50000; ++i) {
      const auto sample = p.sample(random.variates());
      moments.add(std::max(0.0, double{sample->wi.z}) / double{sample->pdf_w});
    }
    const double exact = test::rectangle_irradiance(view.light, kOrigin, kUp);
    EXPECT_GT(exact, 0.0) << view.name;
    EXPECT_LT(moments.z(exact, 2e-6), test::z_bound(kLevel))
        << view.name << " " << moments.mean() << " " << exact;
  }
}

TEST(RectangleLight, ZTestRejectsAnIrradianceOffByOnePercent) {  // negative control
  const View view{"", panel(1.0f, 2.0f, {0.3f, 0.1f, 0.7f}), LightSampling::SolidAngle};
  const LightProposal p = proposal(view);
  test::TestRandom random;
  test::Moments moments;
  for (int i = 0; i < 50000; ++i) {
    const auto sample = p.sample(random.variates());
    moments.add(double{sample->wi.z} / double{sample->pdf_w});
  }
  EXPECT_GT(moments.z(1.01 * test::rectangle_irradiance(view.light, kOrigin, kUp)),
            test::z_bound(kLevel));
}

TEST(SphereLight, IrradianceIsTheClosedFormAtEveryDistance) {
  // A whole sphere above the horizon gives pi (r/d)^2 cos(theta).
  test::TestRandom random;
  for (const double distance : {1.0000001, 1.001, 1.5, 10.0, 1e3, 1e5}) {
    const Light light = test::sphere_light({0, 0, static_cast<float>(distance)}, 1.0f);
    const LightProposal p = proposal({"", light, LightSampling::SolidAngle});
    test::Moments moments;
    for (int i = 0; i < 50000; ++i) {
      const auto sample = p.sample(random.variates());
      moments.add(std::max(0.0, double{sample->wi.z}) / double{sample->pdf_w});
    }
    const double d = static_cast<double>(static_cast<float>(distance));
    EXPECT_LT(moments.z(std::numbers::pi / (d * d), 2e-6), test::z_bound(kLevel)) << distance;
  }
}

TEST(SphereLight, PdfIsOneOverTheSolidAngleOfTheCone) {
  for (const float ratio : {0.9999999f, 0.99f, 0.5f, 0.1f, 1e-2f, 1e-3f, 1e-4f, 1e-5f, 1e-6f}) {
    const Light light = test::sphere_light({0, 0, 1.0f}, ratio);
    const LightProposal p = proposal({"", light, LightSampling::SolidAngle});
    const long double r = ratio;
    const long double depth = r * r / (1.0L + std::sqrt(1.0L - r * r));
    const auto exact = static_cast<double>(2.0L * std::numbers::pi_v<long double> * depth);
    EXPECT_NEAR(double{p.sample({Vec2(0.5f), 0.5f})->pdf_w} * exact, 1.0,
                ratio > 0.999f ? 1e-3 : 1e-6)
        << ratio;
  }
}

TEST(MeshLight, IrradianceIsTheSumOfLambertsFormulaOverItsFrontFaces) {
  test::TestRandom random;
  for (const View& view : mesh_views()) {
    if (view.light.two_sided) continue;
    const LightProposal p = proposal(view);
    double exact = 0.0;  // convex: no front face hides another
    for (std::size_t i = 0; i < view.light.vertices.size(); i += 3) {
      const Vec3d corners[3] = {Vec3d(view.light.vertices[i]), Vec3d(view.light.vertices[i + 1]),
                                Vec3d(view.light.vertices[i + 2])};
      const Vec3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
      if (normal.dot(corners[0]) < 0.0)
        exact += test::polygon_irradiance(corners, Vec3d(0.0), Vec3d(kUp));
    }
    test::Moments moments;
    for (int i = 0; i < 100000; ++i) {
      const auto sample = p.sample(random.variates());
      if (!sample) {
        moments.add(0.0);
        continue;
      }
      moments.add(std::max(0.0, double{sample->wi.z}) / double{sample->pdf_w});
    }
    EXPECT_LT(moments.z(exact, 1e-5), test::z_bound(kLevel))
        << view.name << " " << moments.mean() << " " << exact;
  }
}

bool lights_the_origin(const Light& light, LightSampling sampling) {
  LightProposal p;
  return p.set_up(light, sampling, kOrigin, kUp);
}

TEST(LightProposal, LightsThatCanNotContributeAreLeftOut) {
  for (const LightSampling sampling : kSamplings) {
    const Light facing = panel(1, 1, {0, 0, 1});
    Light flipped = test::rectangle_light(facing.origin, facing.edge_v, facing.edge_u);
    EXPECT_TRUE(lights_the_origin(facing, sampling));
    EXPECT_FALSE(lights_the_origin(flipped, sampling)) << "from behind";
    flipped.two_sided = true;
    EXPECT_TRUE(lights_the_origin(flipped, sampling)) << "two-sided";
    EXPECT_FALSE(
        lights_the_origin(test::rectangle_light({1, -1, 0}, {0, 2, 0}, {2, 0, 0}, true), sampling))
        << "edge-on";
    EXPECT_FALSE(
        lights_the_origin(test::rectangle_light({0, 1, 1}, {0, 0, 2}, {0, 2, 0}, true), sampling))
        << "edge-on";
    EXPECT_FALSE(lights_the_origin(
        test::rectangle_light({1, -1, -3}, {0, 0, 2.9f}, {0, 2, 0}, true), sampling))
        << "below";
    EXPECT_TRUE(lights_the_origin(test::rectangle_light({1, -1, -3}, {0, 0, 3.1f}, {0, 2, 0}, true),
                                  sampling))
        << "partly";
    EXPECT_FALSE(lights_the_origin(test::sphere_light({1, 0, -1.01f}, 1.0f), sampling)) << "below";
    EXPECT_TRUE(lights_the_origin(test::sphere_light({1, 0, -0.99f}, 1.0f), sampling)) << "partly";
    EXPECT_FALSE(lights_the_origin(test::sphere_light({0, 0, 0.5f}, 1.0f), sampling)) << "inside";
    EXPECT_TRUE(lights_the_origin(test::sphere_light({0, 0, 0.5f}, 1.0f, true), sampling))
        << "inside two-sided";
    EXPECT_FALSE(lights_the_origin(test::mesh_light(test::cube_mesh({3, 0, -1}, 1.9)), sampling))
        << "below";
    EXPECT_TRUE(lights_the_origin(test::mesh_light(test::cube_mesh({3, 0, -1}, 2.1)), sampling))
        << "partly";
  }
}

TEST(LightProposal, NearlyEdgeOnAndTouchingLightsStayFinite) {
  test::TestRandom random;
  for (const LightSampling sampling : kSamplings) {
    for (int k = 1; k <= 12; ++k) {
      const auto gap = static_cast<float>(std::pow(10.0, -k));
      const Light edge_on = test::rectangle_light({gap, -1, 0}, {0, 0, 2}, {0, 2, 0}, true);
      const Light grazing = panel(1, 1, {0.2f, 0.1f, gap});
      for (const Light* light : {&edge_on, &grazing}) {
        LightProposal p;
        if (!p.set_up(*light, sampling, kOrigin, kUp)) continue;
        test::Moments moments;
        for (int i = 0; i < 2000; ++i) {
          const auto sample = p.sample(random.variates());
          ASSERT_TRUE(sample && sample->pdf_w > 0.0f && std::isfinite(sample->pdf_w)) << gap;
          ASSERT_NEAR(sample->wi.length(), 1.0f, 1e-6f) << gap;
          moments.add(std::max(0.0, double{sample->wi.z}) / double{sample->pdf_w});
        }
        if (sampling == LightSampling::SolidAngle) {  // bounded weights: a z test means something
          const double exact = test::rectangle_irradiance(*light, kOrigin, kUp);
          EXPECT_LT(moments.z(exact, 1e-5), test::z_bound(kLevel))
              << gap << " " << moments.mean() << " " << exact;
        }
      }
    }
  }
}

}  // namespace
}  // namespace penumbra
