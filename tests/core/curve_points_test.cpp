// Points along a space-filling curve. False alarms: 1e-3 for the chi-squared test, fixed seed.

#include "scenes/core/curve_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "scenes/core/independent_points.h"

namespace penumbra {
namespace {

// A whole list of points, as a mixture makes it: block by block.
std::vector<Vec2> points_of(std::uint32_t count, std::uint64_t seed) {
  StreamKey key;
  key.seed = seed;
  std::vector<Vec2> points;
  for (std::uint32_t first = 0; first < count; first += kBlock) {
    const auto n = std::min(count - first, static_cast<std::uint32_t>(kBlock));
    PointLanes lanes;
    lanes.add(0, n, 3, first);
    VariateBlock variates;
    Block<float> position{};
    fill_independent(key, lanes, n, variates, &position);
    place_along_curve(first, n, count, position, variates, 0);
    for (std::uint32_t i = 0; i < n; ++i) points.push_back(variates[i].u);
  }
  return points;
}

int cell(float x, int side) { return static_cast<int>(x * static_cast<float>(side)); }

TEST(CurvePoints, SquaresOfAGridGetOnePointEachAndNeighboursTouch) {
  constexpr int kSide = 16;
  const std::vector<Vec2> points = points_of(kSide * kSide, 1);
  std::set<std::pair<int, int>> cells;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int x = cell(points[i].x, kSide), y = cell(points[i].y, kSide);
    EXPECT_TRUE(cells.insert({x, y}).second) << "two points in one square";
    if (i == 0) continue;
    const int steps =
        std::abs(x - cell(points[i - 1].x, kSide)) + std::abs(y - cell(points[i - 1].y, kSide));
    EXPECT_EQ(steps, 1) << "the curve jumps at point " << i;
  }
  EXPECT_EQ(cells.size(), points.size());
}

// Each point alone is uniform in its piece, so all of them together are uniform in the square, also
// where the pieces are no squares.
TEST(CurvePoints, AnyNumberOfPointsIsUniformInTheSquare) {
  constexpr int kSide = 8;
  constexpr std::uint32_t kCount = 37;
  std::vector<double> observed(kSide * kSide, 0.0);
  constexpr int kSets = 4000;
  for (int s = 0; s < kSets; ++s) {
    for (const Vec2& p : points_of(kCount, static_cast<std::uint64_t>(s))) {
      observed[static_cast<std::size_t>(cell(p.y, kSide) * kSide + cell(p.x, kSide))] += 1.0;
    }
  }
  // Stratified counts vary less than independent ones: the test is on the safe side.
  const double expected = static_cast<double>(kSets) * kCount / (kSide * kSide);
  double chi2 = 0.0;
  for (const double n : observed) chi2 += (n - expected) * (n - expected) / expected;
  EXPECT_LT(chi2, 104.0) << "the 0.999 quantile with 63 degrees of freedom is 103.4";
}

// Runs of several components share a block.
TEST(CurvePoints, LanesOfOtherRunsStayAsTheyAre) {
  VariateBlock variates;
  Block<float> position{};
  for (std::size_t i = 0; i < kBlock; ++i) variates.x[i] = variates.y[i] = 0.3f;
  place_along_curve(0, 3, 3, position, variates, 5);
  for (std::size_t i = 0; i < kBlock; ++i) {
    EXPECT_EQ(variates.x[i] == 0.3f, i < 5 || i >= 8) << "lane " << i;
  }
}

TEST(CurvePoints, ExtremeVariatesStayInTheSquare) {
  constexpr float kAlmostOne = 1.0f - 0x1p-24f;
  for (const std::uint32_t count : {1u, 3u, 64u, 1000u}) {
    for (const float u : {0.0f, kAlmostOne}) {
      VariateBlock variates;
      Block<float> position{};
      const std::uint32_t n = std::min(count, 64u);
      for (std::size_t i = 0; i < kBlock; ++i) variates.x[i] = variates.y[i] = position[i] = u;
      place_along_curve(count - n, n, count, position, variates, 0);
      for (std::uint32_t i = 0; i < n; ++i) {
        EXPECT_GE(std::min(variates.x[i], variates.y[i]), 0.0f);
        EXPECT_LT(std::max(variates.x[i], variates.y[i]), 1.0f);
      }
    }
  }
}

}  // namespace
}  // namespace penumbra
