#include "scenes/core/warp.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "scenes/core/frame.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using test::SphereGrid;

// All p-values of this file together (fewer than 60) raise a false alarm with probability 1e-4.
const double kLevel = test::sidak(1e-4, 60);
constexpr int kDraws = 200000;
const Vec3 kUp(0.0f, 0.0f, 1.0f);

/// A warp to directions with its density and inverse.
struct DirectionWarp {
  std::string name;
  std::function<Vec3(const Vec2&)> sample;
  std::function<double(const Vec3&)> pdf_w;
  std::function<Vec2(const Vec3&)> invert;
  double depth;  // 1 - cos of the domain's edge
};

std::vector<DirectionWarp> direction_warps() {
  std::vector<DirectionWarp> warps = {
      {"cosine hemisphere", sample_cosine_hemisphere,
       [](const Vec3& w) { return double{cosine_hemisphere_pdf_w(w.z)}; }, invert_cosine_hemisphere,
       1.0},
      {"uniform hemisphere", sample_uniform_hemisphere,
       [](const Vec3& w) { return double{uniform_hemisphere_pdf_w(w.z)}; },
       invert_uniform_hemisphere, 1.0},
      {"uniform sphere", sample_uniform_sphere,
       [](const Vec3&) { return double{uniform_sphere_pdf_w()}; }, invert_uniform_sphere, 2.0}};
  for (const float depth : {1.5f, 0.3f, 1e-3f, 1e-6f}) {
    warps.push_back({"cone " + std::to_string(depth),
                     [depth](const Vec2& u) { return sample_uniform_cone(u, depth); },
                     [depth](const Vec3&) { return double{uniform_cone_pdf_w(depth)}; },
                     [depth](const Vec3& w) { return invert_uniform_cone(w, depth); },
                     double{depth}});
  }
  return warps;
}

// The u that any sampler can give next to the borders, and 2^-32, which a float holds as well.
constexpr float kExtremes[] = {0.0f, 0x1p-32f, 0x1p-24f, 0.5f - 0x1p-25f, 0.5f, 1.0f - 0x1p-24f};

TEST(DirectionWarps, SamplesMatchPdfByChiSquare) {
  test::TestRandom random;
  for (const DirectionWarp& warp : direction_warps()) {
    const SphereGrid grid = SphereGrid::cap(kUp, warp.depth, 16, 32);
    const auto fit = test::fit_directions(
        grid, [&] { return warp.sample(random.variates().u); }, warp.pdf_w, kDraws, 8);
    EXPECT_GT(fit.p, kLevel) << warp.name;
    EXPECT_NEAR(fit.integral, 1.0, 2e-6) << warp.name;
    EXPECT_LT(fit.outside, 1e-4) << warp.name;
  }
}

TEST(DirectionWarps, ChiSquareRejectsTheWrongPdf) {  // negative control
  test::TestRandom random;
  const SphereGrid grid = SphereGrid::cap(kUp, 1.0, 16, 32);
  const auto uniform_as_cosine = test::fit_directions(
      grid, [&] { return sample_uniform_hemisphere(random.variates().u); },
      [](const Vec3& w) { return double{cosine_hemisphere_pdf_w(w.z)}; }, kDraws);
  EXPECT_LT(uniform_as_cosine.p, kLevel);
  const auto off_by_15_percent = test::fit_directions(
      grid, [&] { return sample_cosine_hemisphere(random.variates().u); },
      [](const Vec3& w) { return double{w.z} * (0.85 + 0.225 * double{w.z}) / M_PI; }, kDraws);
  EXPECT_LT(off_by_15_percent.p, kLevel);
}

RC_GTEST_PROP(DirectionWarps, InverseUndoesSample, (std::uint32_t a, std::uint32_t b)) {
  const Vec2 u(static_cast<float>(a >> 8) * 0x1p-24f, static_cast<float>(b >> 8) * 0x1p-24f);
  for (const DirectionWarp& warp : direction_warps()) {
    const Vec2 v = warp.invert(warp.sample(u));
    RC_ASSERT(v.x >= 0.0f && v.x < 1.0f && v.y >= 0.0f && v.y < 1.0f);
    if (warp.name != "cosine hemisphere") {
      const float turn = std::abs(v.y - u.y);
      RC_ASSERT(std::abs(v.x - u.x) < 2e-6f);
      // The azimuth of a direction next to the axis is lost; it is of no matter there.
      RC_ASSERT(u.x < 1e-6f || u.x > 1.0f - 1e-6f || std::min(turn, 1.0f - turn) < 2e-6f);
    } else {
      RC_ASSERT((v - u).length() < 2e-6f);
    }
  }
}

TEST(DirectionWarps, ExtremeVariatesStayFiniteAndInTheDomain) {
  for (const DirectionWarp& warp : direction_warps()) {
    for (const float x : kExtremes) {
      for (const float y : kExtremes) {
        const Vec3 w = warp.sample({x, y});
        ASSERT_TRUE(std::isfinite(w.x) && std::isfinite(w.y) && std::isfinite(w.z)) << warp.name;
        EXPECT_NEAR(w.length(), 1.0f, 3e-7f) << warp.name << " " << x << " " << y;
        EXPECT_GE(static_cast<double>(w.z), 1.0 - warp.depth - 1e-7)
            << warp.name << " " << x << " " << y;
        const Vec2 u = warp.invert(w);
        EXPECT_TRUE(u.x >= 0.0f && u.x < 1.0f && u.y >= 0.0f && u.y < 1.0f)
            << warp.name << " u=(" << x << ", " << y << ") inverts to (" << u.x << ", " << u.y
            << ")";
      }
    }
  }
}

TEST(UniformDisk, IsUniformByChiSquare) {
  test::TestRandom random;
  std::vector<double> counts(16 * 32, 0.0);
  for (int i = 0; i < kDraws; ++i) {
    const Vec2 p = sample_uniform_disk(random.variates().u);
    const double r2 = static_cast<double>(p.length2());
    const double turn = std::atan2(double{p.y}, double{p.x}) / (2.0 * M_PI) + 0.5;
    const auto ring = std::min<std::size_t>(15, static_cast<std::size_t>(r2 * 16.0));
    counts[ring * 32 + std::min<std::size_t>(31, static_cast<std::size_t>(turn * 32.0))] += 1.0;
  }
  EXPECT_GT(test::chi_square_uniform_p(counts), kLevel);
}

RC_GTEST_PROP(UniformDisk, InverseUndoesSample, (std::uint32_t a, std::uint32_t b)) {
  const Vec2 u(static_cast<float>(a >> 8) * 0x1p-24f, static_cast<float>(b >> 8) * 0x1p-24f);
  const Vec2 v = invert_uniform_disk(sample_uniform_disk(u));
  RC_ASSERT((v - u).length() < 2e-6f);
}

TEST(UniformDisk, ExtremeVariatesStayInTheDiskAndInvertBelow1) {
  test::TestRandom random;
  const auto check = [](const Vec2& u) {
    const Vec2 p = sample_uniform_disk(u);
    ASSERT_LE(p.length(), 1.0f + 2e-7f) << u.x << " " << u.y;
    const Vec2 v = invert_uniform_disk(p);
    ASSERT_TRUE(v.x >= 0.0f && v.x < 1.0f && v.y >= 0.0f && v.y < 1.0f)
        << "u=(" << u.x << ", " << u.y << ") inverts to (" << v.x << ", " << v.y << ")";
  };
  for (const float x : kExtremes) {
    for (const float y : kExtremes) check({x, y});
    for (int i = 0; i < 10000; ++i) check({x, random.unit_float()});
    for (int i = 0; i < 10000; ++i) check({random.unit_float(), x});
  }
}

TEST(UniformTriangle, IsUniformByChiSquare) {
  // The area-preserving fold of the triangle to the square that has nothing to do with Heitz's map:
  // s = 1 - (1-b1)^2 is the share of area left of b1, t = b2/(1-b1) the place on the line.
  test::TestRandom random;
  std::vector<double> counts(16 * 16, 0.0);
  for (int i = 0; i < kDraws; ++i) {
    const Vec2 b = sample_uniform_triangle(random.variates().u);
    ASSERT_TRUE(b.x >= 0.0f && b.y >= 0.0f && b.x + b.y <= 1.0f);
    const double rest = 1.0 - double{b.x};
    const double s = 1.0 - rest * rest;
    const double t = rest > 0.0 ? double{b.y} / rest : 0.0;
    counts[std::min<std::size_t>(15, static_cast<std::size_t>(s * 16.0)) * 16 +
           std::min<std::size_t>(15, static_cast<std::size_t>(t * 16.0))] += 1.0;
  }
  EXPECT_GT(test::chi_square_uniform_p(counts), kLevel);
}

TEST(UniformTriangle, ExtremeVariatesStayInTheTriangle) {
  for (const float x : kExtremes) {
    for (const float y : kExtremes) {
      const Vec2 b = sample_uniform_triangle({x, y});
      EXPECT_TRUE(b.x >= 0.0f && b.y >= 0.0f && b.x + b.y <= 1.0f) << x << " " << y;
      const Vec2 u = invert_uniform_triangle(b);
      EXPECT_TRUE(u.x >= 0.0f && u.x < 1.0f && u.y >= 0.0f && u.y < 1.0f) << x << " " << y;
    }
  }
}

RC_GTEST_PROP(UniformTriangle, InverseUndoesSample, (std::uint32_t a, std::uint32_t b)) {
  const Vec2 u(static_cast<float>(a >> 8) * 0x1p-24f, static_cast<float>(b >> 8) * 0x1p-24f);
  RC_ASSERT((invert_uniform_triangle(sample_uniform_triangle(u)) - u).length() < 1e-6f);
}

TEST(UniformCone, SamplesPassTheChordTestForHalfAnglesDownTo1eMinus7) {
  test::TestRandom random;
  for (const float angle : {1.0f, 0.1f, 1e-2f, 1e-3f, 1e-4f, 1e-5f, 1e-6f, 1e-7f}) {
    const float depth = one_minus_cos_of(angle);
    int outside = 0;
    int collapsed = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 w = sample_uniform_cone(random.variates().u, depth);
      const Vec3d d = Vec3d(w) - Vec3d(0.0, 0.0, 1.0);
      outside += d.length2() > 2.0 * double{depth} * (1.0 + 1e-6) ? 1 : 0;
      collapsed += w.x == 0.0f && w.y == 0.0f ? 1 : 0;
    }
    EXPECT_EQ(outside, 0) << angle;
    EXPECT_LE(collapsed, 1) << angle;  // u = 0 is the axis itself
    const double solid_angle = 1.0 / double{uniform_cone_pdf_w(depth)};
    const long double half = std::sin(0.5L * static_cast<long double>(angle));
    const auto exact = static_cast<double>(4.0L * std::numbers::pi_v<long double> * half * half);
    EXPECT_NEAR(solid_angle / exact, 1.0, 1e-6) << angle;
  }
}

TEST(OneMinusCos, KeepsItsDigitsForEveryAngle) {
  test::TestRandom random;
  for (int i = 0; i < 100000; ++i) {
    const auto angle = static_cast<float>(std::pow(10.0, random.uniform(-12.0, std::log10(M_PI))));
    const long double half = std::sin(0.5L * static_cast<long double>(angle));
    const auto exact = static_cast<double>(2.0L * half * half);
    ASSERT_NEAR(double{one_minus_cos_of(angle)} / exact, 1.0, 4e-7) << angle;
  }
}

TEST(Frame, IsOrthonormalAndRightHandedEverywhere) {
  test::TestRandom random;
  std::vector<Vec3> normals = {{0, 0, 1},      {0, 0, -1},    {0, 1, 0},    {-1, 0, 0},
                               {1e-8f, 0, -1}, {0, 1e-8f, 1}, {0, 1, -0.0f}};
  for (int i = 0; i < 10000; ++i) normals.push_back(random.direction());
  for (const Vec3& n : normals) {
    const Frame frame(n);
    const Vec3 x = frame.to_world({1, 0, 0});
    const Vec3 y = frame.to_world({0, 1, 0});
    ASSERT_NEAR(x.length(), 1.0f, 1e-6f) << n;
    ASSERT_NEAR(y.length(), 1.0f, 1e-6f) << n;
    ASSERT_NEAR(dot(x, y), 0.0f, 1e-6f) << n;
    ASSERT_NEAR(dot(x, n), 0.0f, 1e-6f) << n;
    ASSERT_LT((cross(x, y) - n).length(), 1e-6f) << n;
    ASSERT_LT(
        (frame.to_local(frame.to_world({0.6f, 0.0f, 0.8f})) - Vec3(0.6f, 0.0f, 0.8f)).length(),
        1e-6f);
  }
}

}  // namespace
}  // namespace penumbra
