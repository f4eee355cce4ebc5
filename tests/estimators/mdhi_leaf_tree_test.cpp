// The kd-tree of MDHI and its anisotropic reconstruction, apart from light and rays.
//
// Two tests compare root mean squares over 400 fixed keys, whose relative error is about 5 %, with
// margins of a factor 1.5 and more: a false alarm is beyond 5 standard errors, probability below
// 1e-6. The others are exact.

#include "estimators/mdhi/leaf_tree.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "estimators/mdhi/reconstruction.h"
#include "estimators/mixture/mixture.h"
#include "scenes/core/sampler.h"
#include "tests/support/fixtures.h"

namespace penumbra::mdhi {
namespace {

constexpr int kKeys = 400;
constexpr LeafRules kRelative{};
constexpr LeafRules kAbsolute{.relative = false};

Vec3d grey(double value) { return Vec3d(value); }

bool holds(const Leaf& leaf, const Vec2& u) {
  return u.x >= leaf.lower.x && u.x < leaf.upper.x && u.y >= leaf.lower.y && u.y < leaf.upper.y;
}

bool overlap(const Leaf& a, const Leaf& b) {
  return a.lower.x < b.upper.x && b.lower.x < a.upper.x && a.lower.y < b.upper.y &&
         b.lower.y < a.upper.y;
}

std::vector<std::uint32_t> samples_of(const LeafTree& tree, const Leaf& leaf) {
  std::vector<std::uint32_t> result;
  for (std::uint32_t s = leaf.first; s != LeafTree::kNone; s = tree.next(s)) result.push_back(s);
  return result;
}

// Whether the leaves tile `charts` squares and hold all samples, none above capacity unless its
// samples coincide.
void expect_sound(const LeafTree& tree, std::size_t charts, std::uint32_t capacity,
                  const std::vector<std::size_t>& chart_of) {
  std::vector<double> areas(charts, 0.0);
  std::vector<int> seen(tree.samples(), 0);
  for (std::size_t i = 0; i < tree.leaves().size(); ++i) {
    const Leaf& leaf = tree.leaves()[i];
    RC_ASSERT(leaf.lower.x >= 0.0f && leaf.lower.y >= 0.0f && leaf.upper.x <= 1.0f &&
              leaf.upper.y <= 1.0f);
    RC_ASSERT(tree.volume(i) > 0.0);
    areas[leaf.chart] += tree.volume(i);
    for (std::size_t j = 0; j < i; ++j) {
      RC_ASSERT(tree.leaves()[j].chart != leaf.chart || !overlap(tree.leaves()[j], leaf));
    }
    const std::vector<std::uint32_t> inside = samples_of(tree, leaf);
    RC_ASSERT(inside.size() == leaf.count);
    bool coincide = true;
    for (const std::uint32_t s : inside) {
      ++seen[s];
      RC_ASSERT(chart_of[s] == leaf.chart);
      RC_ASSERT(holds(leaf, tree.position(s)));
      coincide = coincide && tree.position(s) == tree.position(inside.front());
    }
    RC_ASSERT(leaf.count <= capacity || coincide);
  }
  // Disjoint boxes of total area 1 inside a square tile it. 24-bit sides: areas are exact, and
  // their sum rounds some hundred times.
  for (const double area : areas) RC_ASSERT(std::abs(area - 1.0) < 1e-12);
  for (const int times : seen) RC_ASSERT(times == 1);
}

RC_GTEST_PROP(LeafTree, LeavesTileTheSquaresAndHoldAllSamples, ()) {
  const auto charts = *rc::gen::inRange<std::size_t>(1, 4);
  const auto capacity = *rc::gen::inRange<std::uint32_t>(1, 6);
  const auto count = *rc::gen::inRange<std::size_t>(0, 120);
  // On a grid of few places coordinates, and whole samples, coincide.
  const int grid = *rc::gen::element(3, 16, 1 << 24);
  const LeafRules rules{*rc::gen::arbitrary<bool>(), *rc::gen::arbitrary<bool>(), capacity};
  LeafTree tree(charts, count, rules);
  tree.reset(charts);
  std::vector<std::size_t> chart_of;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec2 u(static_cast<float>(*rc::gen::inRange(0, grid)) / static_cast<float>(grid),
                 static_cast<float>(*rc::gen::inRange(0, grid)) / static_cast<float>(grid));
    const Vec3d value(*rc::gen::inRange(0, 4), *rc::gen::inRange(0, 4), *rc::gen::inRange(0, 4));
    if (*rc::gen::arbitrary<bool>()) {
      chart_of.push_back(*rc::gen::inRange<std::size_t>(0, charts));
      tree.insert(chart_of.back(), u, value);
    } else {
      const std::size_t leaf = tree.worst_leaf();
      chart_of.push_back(tree.leaves()[leaf].chart);
      tree.insert_into(leaf, tree.point_in(leaf, u), value);
    }
    RC_ASSERT(tree.value(i) == value);
    std::size_t worst = 0;
    for (std::size_t k = 0; k < tree.leaves().size(); ++k) {
      if (tree.error(k) > tree.error(worst)) worst = k;
    }
    RC_ASSERT(tree.worst_leaf() == worst);
  }
  expect_sound(tree, charts, capacity, chart_of);
  tree.split_down_to(1);
  expect_sound(tree, charts, 1, chart_of);
}

RC_GTEST_PROP(LeafTree, TwiceTheValuesChangeNoChoice, ()) {
  const LeafRules rules{*rc::gen::arbitrary<bool>(), *rc::gen::arbitrary<bool>(), 4};
  LeafTree once(2, 60, rules), twice(2, 60, rules);
  once.reset(2);
  twice.reset(2);
  for (int i = 0; i < 60; ++i) {
    const std::size_t leaf = once.worst_leaf();
    RC_ASSERT(leaf == twice.worst_leaf());
    const Vec2 u(static_cast<float>(*rc::gen::inRange(0, 1 << 24)) * 0x1p-24f,
                 static_cast<float>(*rc::gen::inRange(0, 1 << 24)) * 0x1p-24f);
    const Vec2 at = once.point_in(leaf, u);
    const Vec3d value = Vec3d(*rc::gen::inRange(0, 3), *rc::gen::inRange(0, 9), 1.0) / 7.0 *
                        static_cast<double>(*rc::gen::inRange(0, 2));
    once.insert_into(leaf, at, value);
    twice.insert_into(leaf, at, value * 2.0);
  }
}

TEST(LeafTree, SplitsTheLongestAxisBetweenTheTwoMedianSamples) {
  LeafTree tree(1, 8, kRelative);
  tree.reset(1);
  const Vec2 points[] = {{0.5f, 0.5f}, {0.875f, 0.25f}, {0.125f, 0.75f}, {0.25f, 0.375f}};
  for (const Vec2& u : points) tree.insert(0, u, grey(1.0));
  ASSERT_EQ(tree.leaves().size(), 1u) << "four samples fit";
  tree.insert(0, {0.75f, 0.125f}, grey(1.0));
  // x of the five: .125 .25 | .5 .75 .875, middle of the second and third .375.
  ASSERT_EQ(tree.leaves().size(), 2u);
  EXPECT_EQ(tree.leaves()[0].upper, Vec2(0.375f, 1.0f));
  EXPECT_EQ(tree.leaves()[1].lower, Vec2(0.375f, 0.0f));
  EXPECT_EQ(tree.leaves()[0].count, 2u);
  EXPECT_EQ(tree.leaves()[1].count, 3u);
  // The upper part, .625 x 1, is longest along y: .125 .25 | .5 .625 .875, middle .375.
  tree.insert(0, {0.9375f, 0.625f}, grey(1.0));
  tree.insert(0, {0.4375f, 0.875f}, grey(1.0));
  ASSERT_EQ(tree.leaves().size(), 3u);
  EXPECT_EQ(tree.leaves()[1].upper, Vec2(1.0f, 0.375f));
  EXPECT_EQ(tree.leaves()[2].lower, Vec2(0.375f, 0.375f));
}

TEST(LeafTree, SamplesThatCoincideShareALeaf) {
  LeafTree tree(1, 10, kRelative);
  tree.reset(1);
  for (int i = 0; i < 7; ++i) tree.insert(0, {0.5f, 0.5f}, grey(1.0));
  EXPECT_EQ(tree.leaves().size(), 1u);
  EXPECT_EQ(tree.leaves()[0].count, 7u);
  tree.insert(0, {0.5f, 0.25f}, grey(1.0));
  ASSERT_EQ(tree.leaves().size(), 2u);
  EXPECT_EQ(tree.leaves()[0].count, 1u);
  EXPECT_EQ(tree.leaves()[1].count, 7u);
}

TEST(LeafTree, ErrorIsAreaTimesMeanDeviation) {
  const auto error = [](const LeafRules& rules) {
    LeafTree tree(1, 3, rules);
    tree.reset(1);
    tree.insert(0, {0.1f, 0.1f}, {1.0, 0.0, 0.0});
    tree.insert(0, {0.5f, 0.1f}, {2.0, 0.0, 4.0});
    tree.insert(0, {0.9f, 0.1f}, {3.0, 0.0, 8.0});
    return tree.error(0);
  };
  // Red: mean 2, mean deviation 2/3. Blue: mean 4, mean deviation 8/3. Green is 0. The first sample
  // is red 1.
  EXPECT_NEAR(error({.relative = true, .per_channel = true}), 1.0 / 3.0 + 2.0 / 3.0 + 1e-5, 1e-14);
  EXPECT_NEAR(error({.relative = false, .per_channel = true}), 10.0 / 3.0 + 1e-5, 1e-14);
  // Luminance .2126 R + .0722 B grows evenly from sample to sample, by d about the mean.
  const double d = 0.2126 + 4.0 * 0.0722;
  const double mean = 2.0 * 0.2126 + 4.0 * 0.0722;
  EXPECT_NEAR(error({.relative = true}), 2.0 / 3.0 * d / mean + 1e-5, 1e-14);
  EXPECT_NEAR(error({.relative = false}), 2.0 / 3.0 * d + 1e-5 * 0.2126, 1e-14);
}

TEST(LeafTree, TheWorstLeafIsThatOfAnyChart) {
  LeafTree tree(3, 12, kRelative);
  tree.reset(3);
  for (int i = 0; i < 4; ++i) {
    const Vec2 u(0.125f + 0.25f * static_cast<float>(i), 0.5f);
    tree.insert(0, u, grey(100.0 + i));
    tree.insert(1, u, grey(1.0 + i));
    tree.insert(2, u, grey(0.0));
  }
  EXPECT_EQ(tree.worst_leaf(), 1u);
}

// Without the error's last term a leaf of zeros would never be looked at again.
TEST(LeafTree, LeavesWithoutLightAreDividedToo) {
  for (const LeafRules& rules : {kRelative, kAbsolute}) {
    LeafTree tree(1, 200, rules);
    tree.reset(1);
    const PointSet points(SamplerKind::Independent, {}, 200);
    for (std::uint32_t i = 0; i < 200; ++i) {
      const std::size_t leaf = tree.worst_leaf();
      tree.insert_into(leaf, tree.point_in(leaf, points(i).u), grey(0.0));
    }
    // Half of the samples are left on each side of a split at least: 200 samples in leaves of equal
    // error, the largest area first, never leave one of a fifth of the square.
    for (std::size_t i = 0; i < tree.leaves().size(); ++i) EXPECT_LT(tree.volume(i), 0.2);
  }
}

using Function = std::function<double(const Vec2&)>;

// Integral of a function over the square by n samples, the first 4 at random.
double integral(const Function& f, std::uint32_t n, std::uint32_t key, bool one_per_leaf) {
  LeafTree tree(1, n, kRelative);
  tree.reset(1);
  const PointSet points(SamplerKind::Independent, {.seed = fixtures::test_seed(""), .pixel = key},
                        n);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::size_t leaf = i < 4 ? 0 : tree.worst_leaf();
    const Vec2 u = tree.point_in(leaf, points(i).u);
    tree.insert_into(leaf, u, grey(f(u)));
  }
  if (one_per_leaf) tree.split_down_to(1);
  std::vector<double> weights(n);
  tree.leaf_mean_weights(weights);
  double sum = 0.0;
  for (std::uint32_t i = 0; i < n; ++i) sum += weights[i] * tree.value(i).x;
  return sum;
}

TEST(LeafTree, AConstantIsIntegratedExactly) {
  const Function f = [](const Vec2&) { return 3.0; };
  for (const std::uint32_t n : {4u, 5u, 64u, 1000u}) {
    EXPECT_NEAR(integral(f, n, 0, false), 3.0, 1e-12) << n;
    EXPECT_NEAR(integral(f, n, 0, true), 3.0, 1e-12) << n;
  }
}

TEST(LeafTree, ALinearFunctionConvergesFasterThanByChance) {
  const Function f = [](const Vec2& u) {
    return static_cast<double>(u.x) + 2.0 * static_cast<double>(u.y);
  };
  for (const bool one_per_leaf : {false, true}) {
    const auto rms = [&](std::uint32_t n) {
      double sum = 0.0;
      for (std::uint32_t key = 0; key < kKeys; ++key) {
        const double e = integral(f, n, key, one_per_leaf) - 1.5;
        sum += e * e;
      }
      return std::sqrt(sum / kKeys);
    };
    // Independent samples would gain the square root of 32, about 5.7.
    EXPECT_LT(rms(512), rms(16) / 10.0) << "one per leaf: " << one_per_leaf;
  }
}

std::vector<Vec2> scattered(std::uint32_t n, std::uint32_t key) {
  const PointSet points(SamplerKind::Stratified,
                        {.seed = fixtures::test_seed("points"), .pixel = key}, n);
  std::vector<Vec2> result;
  for (std::uint32_t i = 0; i < n; ++i) result.push_back(points(i).u);
  return result;
}

TEST(AnisotropicCells, SharesFillTheSquare) {
  AnisotropicCells cells(40);
  for (const std::uint32_t n : {1u, 2u, 3u, 4u, 7u, 40u}) {
    const std::vector<Vec2> positions = scattered(n, n);
    std::vector<double> values(n), shares(n);
    for (std::uint32_t i = 0; i < n; ++i) values[i] = static_cast<double>(positions[i].x > 0.5f);
    cells.shares(positions, values, shares);
    double sum = 0.0;
    for (const double share : shares) sum += share;
    EXPECT_NEAR(sum, 1.0, 1e-12) << n;
  }
}

TEST(AnisotropicCells, ReachAcrossTheGradient) {
  // Values rise along x from 1 to 3. By plain distance the place (31.5/32, 0.5/32) belongs to the
  // sample below the corner; with r = 4 distances along x count 16 times those along y squared, and
  // the column nearest in x wins every place.
  std::vector<Vec2> positions;
  std::vector<double> values;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 3; ++j) {
      // Columns at 1/8, 3/8, 5/8, 7/8, each with a height of its own within its third.
      positions.emplace_back(0.125f + 0.25f * static_cast<float>(i),
                             (static_cast<float>(j) + 0.2f + 0.15f * static_cast<float>(i)) / 3.0f);
      values.push_back(1.0 + 2.0 * static_cast<double>(positions.back().x));
    }
  }
  std::vector<double> shares(positions.size());
  AnisotropicCells(positions.size()).shares(positions, values, shares);
  // Each column is nearest along x for a quarter of the square.
  for (std::size_t column = 0; column < 4; ++column) {
    const double share = shares[3 * column] + shares[3 * column + 1] + shares[3 * column + 2];
    EXPECT_NEAR(share, 0.25, 1e-12) << column;
  }
}

TEST(AnisotropicCells, AreBetterThanNearestNeighboursOnAFunctionOfOneVariable) {
  constexpr std::uint32_t kSamples = 12;
  AnisotropicCells cells(kSamples);
  double square_error = 0.0, square_error_nearest = 0.0;
  for (std::uint32_t key = 0; key < kKeys; ++key) {
    const std::vector<Vec2> positions = scattered(kSamples, key);
    std::vector<double> values, shares(kSamples), nearest(kSamples);
    for (const Vec2& u : positions) values.push_back(static_cast<double>(u.x));
    cells.shares(positions, values, shares);
    cells.shares(positions, std::vector<double>(kSamples, 1.0), nearest);  // no gradient: plain
    double e = -0.5, e_nearest = -0.5;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      e += shares[i] * values[i];
      e_nearest += nearest[i] * values[i];
    }
    square_error += e * e;
    square_error_nearest += e_nearest * e_nearest;
  }
  EXPECT_LT(std::sqrt(square_error), std::sqrt(square_error_nearest) / 1.5);
}

}  // namespace
}  // namespace penumbra::mdhi
