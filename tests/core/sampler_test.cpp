#include "scenes/core/sampler.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <boost/random/sobol.hpp>
#include <cmath>
#include <numeric>
#include <set>
#include <tuple>
#include <vector>

#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using test::chi_square_uniform_p;

// All p-values of this file together (fewer than 600) raise a false alarm with probability 1e-4.
const double kLevel = test::sidak(1e-4, 600);

constexpr SamplerKind kKinds[] = {SamplerKind::Independent, SamplerKind::Stratified,
                                  SamplerKind::Sobol};

StreamKey key_of(std::uint32_t pixel) {
  StreamKey key;
  key.seed = test::test_seed();
  key.pixel = pixel;
  return key;
}

std::array<float, 3> values(const Variates& v) { return {v.u.x, v.u.y, v.choice}; }

std::size_t bin_of(float u, std::uint32_t bins) {
  return static_cast<std::size_t>(static_cast<double>(u) * bins);
}

// p-values of one point's three coordinates over keys, and of its three pairs and its triple on a
// coarse grid.
std::vector<double> marginal_p(SamplerKind kind, std::uint32_t count, std::uint32_t index,
                               std::uint32_t keys) {
  constexpr std::size_t kFine = 64;
  constexpr std::size_t kCoarse = 8;
  std::array<std::vector<double>, 3> single;
  std::array<std::vector<double>, 3> pair;
  std::vector<double> triple(kCoarse * kCoarse * kCoarse);
  for (auto& s : single) s.assign(kFine, 0.0);
  for (auto& p : pair) p.assign(kCoarse * kCoarse, 0.0);
  for (std::uint32_t pixel = 0; pixel < keys; ++pixel) {
    const auto u = values(PointSet(kind, key_of(pixel), count)(index));
    std::array<std::size_t, 3> c{};
    for (std::size_t d = 0; d < 3; ++d) {
      single[d][bin_of(u[d], kFine)] += 1.0;
      c[d] = bin_of(u[d], kCoarse);
    }
    for (std::size_t d = 0; d < 3; ++d) pair[d][c[d] * kCoarse + c[(d + 1) % 3]] += 1.0;
    triple[(c[0] * kCoarse + c[1]) * kCoarse + c[2]] += 1.0;
  }
  std::vector<double> p;
  for (const auto& s : single) p.push_back(chi_square_uniform_p(s));
  for (const auto& s : pair) p.push_back(chi_square_uniform_p(s));
  p.push_back(chi_square_uniform_p(triple));
  return p;
}

TEST(PointSet, CoordinatesAreMultiplesOf2ToMinus24Below1) {
  for (const SamplerKind kind : kKinds) {
    for (std::uint32_t pixel = 0; pixel < 2000; ++pixel) {
      const PointSet points(kind, key_of(pixel), 7);
      for (std::uint32_t i = 0; i < 7; ++i) {
        for (const float u : values(points(i))) {
          ASSERT_GE(u, 0.0f);
          ASSERT_LT(u, 1.0f);
          ASSERT_EQ(u * 0x1p24f, std::floor(u * 0x1p24f)) << to_string(kind) << " " << u;
        }
      }
    }
  }
}

TEST(PointSet, EachPointIsUniformOverKeysWhateverTheCount) {
  for (const SamplerKind kind : kKinds) {
    for (const std::uint32_t count : {1u, 2u, 3u, 5u, 6u, 7u, 8u, 9u, 13u, 16u, 31u, 33u}) {
      const std::uint32_t index = count * 2 / 3;
      const std::vector<double> p = marginal_p(kind, count, index, 20000);
      for (std::size_t i = 0; i < p.size(); ++i) {
        EXPECT_GT(p[i], kLevel) << to_string(kind) << " n=" << count << " index=" << index << " #"
                                << i;
      }
    }
  }
}

TEST(PointSetLong, EveryPointOfEveryCountUpTo33IsUniform) {
  const double level = test::sidak(1e-4, 7 * 33 * 34 / 2);
  for (std::uint32_t count = 1; count <= 33; ++count) {
    for (std::uint32_t index = 0; index < count; ++index) {
      const std::vector<double> p = marginal_p(SamplerKind::Stratified, count, index, 12000);
      EXPECT_GT(*std::min_element(p.begin(), p.end()), level)
          << "n=" << count << " index=" << index;
    }
  }
}

TEST(PointSet, ChiSquareRejectsASkewOfTwoPercent) {  // negative control of the helper
  test::TestRandom random;
  std::vector<double> counts(64, 0.0);
  for (int i = 0; i < 1000000; ++i) {
    const float u = random.unit_float();
    counts[bin_of(u * (0.98f + 0.02f * u), 64)] += 1.0;
  }
  EXPECT_LT(chi_square_uniform_p(counts), kLevel);
}

TEST(PointSet, SameKeyGivesTheSameBits) {
  for (const SamplerKind kind : kKinds) {
    const PointSet a(kind, key_of(5), 12);
    const PointSet b(kind, key_of(5), 12);
    const PointSet copy = a;  // NOLINT: a copy is the claim
    for (std::uint32_t i = 12; i-- > 0;) {
      EXPECT_EQ(values(a(i)), values(b(i)));
      EXPECT_EQ(values(a(i)), values(copy(i)));
    }
  }
}

// Points of two keys that differ in one field are independent: a joint histogram of first
// coordinates is flat.
TEST(PointSet, KeysThatDifferInOneFieldAreUncorrelated) {
  using Change = void (*)(StreamKey&);
  const std::array<Change, 5> changes = {
      [](StreamKey& k) { k.seed += 1; }, [](StreamKey& k) { k.pixel += 1; },
      [](StreamKey& k) { k.estimate += 1; }, [](StreamKey& k) { k.iteration += 1; },
      [](StreamKey& k) { k.component += 1; }};
  for (const SamplerKind kind : kKinds) {
    for (std::size_t c = 0; c < changes.size(); ++c) {
      for (const std::uint32_t count : {1u, 4u}) {
        std::vector<double> joint(256, 0.0);
        std::vector<double> joint_y(256, 0.0);
        for (std::uint32_t i = 0; i < 20000; ++i) {
          StreamKey key = key_of(2 * i);
          key.iteration = 7, key.component = 3;
          const Vec2 a = PointSet(kind, key, count)(0).u;
          changes[c](key);
          const Vec2 b = PointSet(kind, key, count)(0).u;
          joint[bin_of(a.x, 16) * 16 + bin_of(b.x, 16)] += 1.0;
          joint_y[bin_of(a.y, 16) * 16 + bin_of(b.x, 16)] += 1.0;
        }
        EXPECT_GT(chi_square_uniform_p(joint), kLevel) << to_string(kind) << " field " << c;
        EXPECT_GT(chi_square_uniform_p(joint_y), kLevel) << to_string(kind) << " field " << c;
      }
    }
  }
}

TEST(PointSet, FieldsOfTheKeyDoNotOverlap) {
  std::set<std::tuple<float, float, float>> seen;
  std::size_t keys = 0;
  for (const std::uint32_t iteration : {0u, 1u, 4095u}) {
    for (const std::uint32_t component : {0u, 1u, kCameraComponent, kRoundingComponent}) {
      for (const std::uint32_t pixel : {0u, 1u, 0xffffffffu}) {
        for (const std::uint64_t seed : {0ull, 1ull, 1ull << 32}) {
          StreamKey key;
          key.seed = seed, key.pixel = pixel, key.iteration = iteration, key.component = component;
          const auto u = values(PointSet(SamplerKind::Independent, key, 1)(0));
          seen.emplace(u[0], u[1], u[2]);
          ++keys;
        }
      }
    }
  }
  EXPECT_EQ(seen.size(), keys);
}

TEST(RandomBits, AreUniformAndIndependentOfThePointsOfTheirKey) {
  for (const SamplerKind kind : kKinds) {
    for (std::size_t d = 0; d < 3; ++d) {
      std::vector<double> joint(256, 0.0);
      for (std::uint32_t pixel = 0; pixel < 20000; ++pixel) {
        const auto u = values(PointSet(kind, key_of(pixel), 4)(0));
        joint[(random_bits(key_of(pixel)) >> 28) * 16 + bin_of(u[d], 16)] += 1.0;
      }
      EXPECT_GT(chi_square_uniform_p(joint), kLevel) << to_string(kind) << " dimension " << d;
    }
  }
  std::vector<double> low(256, 0.0);
  for (std::uint32_t pixel = 0; pixel < 100000; ++pixel)
    low[random_bits(key_of(pixel)) & 255u] += 1.0;
  EXPECT_GT(chi_square_uniform_p(low), kLevel);
}

TEST(SamplerKindNames, RoundTrip) {
  for (const SamplerKind kind : kKinds) EXPECT_EQ(parse_sampler_kind(to_string(kind)), kind);
  EXPECT_FALSE(parse_sampler_kind("halton").has_value());
}

// Counts of points per cell of a columns x rows grid.
std::vector<int> cell_counts(const PointSet& points, std::uint32_t n, std::uint32_t columns,
                             std::uint32_t rows) {
  std::vector<int> cells(std::size_t{columns} * rows, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec2 u = points(i).u;
    ++cells[bin_of(u.y, rows) * columns + bin_of(u.x, columns)];
  }
  return cells;
}

// The strata are rounded to the 2^-24 grid, which moves a point over a border by one grid step at
// most; the counts here are exact where the number of strata divides 2^24, else a point of one in
// 2^20 may sit on the neighbour's side.
int worst(const std::vector<int>& cells) { return *std::max_element(cells.begin(), cells.end()); }

TEST(Stratified, SquareCountsPutOnePointInEachCell) {
  for (std::uint32_t side = 1; side <= 12; ++side) {
    for (std::uint32_t pixel = 0; pixel < 50; ++pixel) {
      const PointSet points(SamplerKind::Stratified, key_of(pixel), side * side);
      EXPECT_EQ(worst(cell_counts(points, side * side, side, side)), 1) << side << " " << pixel;
    }
  }
}

TEST(Stratified, CountsThatFillTheGridAreNRooksInBothAxes) {
  for (const std::uint32_t n : {2u, 4u, 6u, 9u, 12u, 16u, 20u, 25u, 30u, 64u}) {
    for (std::uint32_t pixel = 0; pixel < 50; ++pixel) {
      const PointSet points(SamplerKind::Stratified, key_of(pixel), n);
      EXPECT_EQ(worst(cell_counts(points, n, n, 1)), 1) << n << " " << pixel;
      EXPECT_EQ(worst(cell_counts(points, n, 1, n)), 1) << n << " " << pixel;
    }
  }
}

TEST(Stratified, EveryCountStratifiesTheChoice) {
  for (std::uint32_t n = 1; n <= 40; ++n) {
    const PointSet points(SamplerKind::Stratified, key_of(n), n);
    std::vector<int> slots(n, 0);
    for (std::uint32_t i = 0; i < n; ++i) ++slots[bin_of(points(i).choice, n)];
    EXPECT_EQ(worst(slots), 1) << n;
  }
}

TEST(Stratified, OtherCountsUseDifferentCellsOfTheCoarsestGrid) {
  for (std::uint32_t n = 2; n <= 40; ++n) {
    const auto columns = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(n)));
    const std::uint32_t rows = (n + columns - 1) / columns;
    for (std::uint32_t pixel = 0; pixel < 20; ++pixel) {
      const PointSet points(SamplerKind::Stratified, key_of(pixel), n);
      const int upright = worst(cell_counts(points, n, columns, rows));
      const int lying = worst(cell_counts(points, n, rows, columns));
      EXPECT_EQ(std::min(upright, lying), 1) << n << " " << pixel;
    }
  }
}

TEST(Stratified, LongAxisIsACoinFlip) {
  int lying = 0;
  constexpr int kKeys = 4000;
  for (std::uint32_t pixel = 0; pixel < kKeys; ++pixel) {
    const PointSet points(SamplerKind::Stratified, key_of(pixel), 2);
    lying += bin_of(points(0).u.x, 2) != bin_of(points(1).u.x, 2) &&
             bin_of(points(0).u.y, 2) != bin_of(points(1).u.y, 2);
  }
  // Two points are rooks of a 1 x 2 grid: they differ in both halves always.
  EXPECT_EQ(lying, kKeys);
  int x_halves_of_6 = 0;
  for (std::uint32_t pixel = 0; pixel < kKeys; ++pixel) {
    const PointSet points(SamplerKind::Stratified, key_of(pixel), 6);
    x_halves_of_6 += worst(cell_counts(points, 6, 2, 3)) == 1;
  }
  // A 2 x 3 grid is filled where it is the set's own grid, or else by chance (seldom).
  EXPECT_GT(x_halves_of_6, kKeys * 45 / 100);
  EXPECT_LT(x_halves_of_6, kKeys * 75 / 100);
}

// Whether each elementary interval of 2^a x 2^b = n cells holds exactly one of the first n points.
bool is_net(const PointSet& points, std::uint32_t n) {
  for (std::uint32_t columns = 1; columns <= n; columns *= 2) {
    if (worst(cell_counts(points, n, columns, n / columns)) != 1) return false;
  }
  return true;
}

TEST(Sobol, EveryElementaryIntervalHoldsOnePoint) {
  for (std::uint32_t n = 1; n <= 1024; n *= 2) {
    for (std::uint32_t pixel = 0; pixel < 40; ++pixel) {
      const PointSet points(SamplerKind::Sobol, key_of(pixel), 2 * n + 3);
      ASSERT_TRUE(is_net(points, n)) << "n=" << n << " key " << pixel;
    }
  }
}

TEST(Sobol, NetTestRejectsIndependentPoints) {
  EXPECT_FALSE(is_net(PointSet(SamplerKind::Independent, key_of(0), 64), 64));
}

TEST(Sobol, ThirdDimensionIsStratifiedAndPrefixesAgreeForAnyCount) {
  const PointSet few(SamplerKind::Sobol, key_of(1), 64);
  const PointSet many(SamplerKind::Sobol, key_of(1), 1000);
  std::vector<int> slots(64, 0);
  for (std::uint32_t i = 0; i < 64; ++i) {
    EXPECT_EQ(values(few(i)), values(many(i)));
    ++slots[bin_of(few(i).choice, 64)];
  }
  EXPECT_EQ(worst(slots), 1);
}

// Boost walks the same sequence in Gray-code order and leaves out the origin; blocks of a power of
// two agree as sets.
TEST(Sobol, FractionsEqualBoostsRawNumbers) {
  constexpr std::uint32_t kCount = 1u << 12;
  boost::random::sobol_engine<std::uint32_t, 32> engine(3);
  std::set<std::array<std::uint32_t, 3>> boosts = {{0, 0, 0}};
  for (std::uint32_t i = 1; i < kCount; ++i) {
    std::array<std::uint32_t, 3> point{};
    for (auto& x : point) x = engine();
    boosts.insert(point);
  }
  std::set<std::array<std::uint32_t, 3>> ours;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    ours.insert({sobol_fraction(i, 0), sobol_fraction(i, 1), sobol_fraction(i, 2)});
  }
  EXPECT_EQ(ours.size(), kCount);
  EXPECT_EQ(ours, boosts);
}

RC_GTEST_PROP(OwenScramble, LowerDigitsNeverChangeHigherOnes,
              (std::uint32_t fraction, std::uint32_t other, std::uint32_t seed)) {
  const int common = std::countl_zero(fraction ^ other);
  const std::uint32_t difference = owen_scramble(fraction, seed) ^ owen_scramble(other, seed);
  // The first digit that differs still differs: a bijection of every prefix, so of all fractions.
  RC_ASSERT(std::countl_zero(difference) == common);
}

TEST(OwenScramble, IsABijectionOfEveryPrefix) {
  for (const std::uint32_t seed : {0u, 1u, 0x80000000u, 0xdeadbeefu, 0xffffffffu}) {
    std::vector<bool> seen(1u << 16, false);
    for (std::uint32_t i = 0; i < (1u << 16); ++i) seen[owen_scramble(i << 16, seed) >> 16] = true;
    EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](bool b) { return b; })) << seed;
  }
}

TEST(OwenScramble, FlipsOfADigitDependOnTheHigherOnes) {
  // A mere xor would flip digit k alike under every prefix.
  test::TestRandom random;
  for (int digit = 1; digit < 12; ++digit) {
    int flips = 0;
    constexpr int kDraws = 4000;
    for (int i = 0; i < kDraws; ++i) {
      const std::uint32_t seed = random.bits();
      const std::uint32_t a = random.bits();
      const std::uint32_t b = random.bits();
      const auto flip = [&](std::uint32_t x) {
        return (owen_scramble(x, seed) ^ x) >> (31 - digit) & 1u;
      };
      flips += flip(a) != flip(b) ? 1 : 0;
    }
    EXPECT_GT(flips, kDraws / 8) << "digit " << digit;
  }
}

TEST(Permute, IsABijectionForEveryCount) {
  test::TestRandom random;
  for (std::uint32_t n = 1; n <= 130; ++n) {
    for (int repeat = 0; repeat < 50; ++repeat) {
      const std::uint32_t seed = random.bits();
      std::vector<bool> seen(n, false);
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t image = permute(i, n, seed);
        ASSERT_LT(image, n);
        ASSERT_FALSE(seen[image]) << "n=" << n << " seed=" << seed;
        seen[image] = true;
      }
    }
  }
}

TEST(Permute, ImageOfEachIndexIsUniformOverSeeds) {
  test::TestRandom random;
  for (const std::uint32_t n : {2u, 3u, 4u, 5u, 7u, 12u, 16u, 31u, 64u, 100u, 128u}) {
    for (const std::uint32_t index : {0u, n / 2, n - 1}) {
      std::vector<double> images(n, 0.0);
      for (int i = 0; i < 20000; ++i) images[permute(index, n, random.bits())] += 1.0;
      EXPECT_GT(chi_square_uniform_p(images), kLevel) << "n=" << n << " index=" << index;
    }
  }
}

}  // namespace
}  // namespace penumbra
