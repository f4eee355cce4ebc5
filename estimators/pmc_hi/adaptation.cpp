#include "estimators/pmc_hi/adaptation.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "estimators/mixture/estimates.h"
#include "scenes/core/error.h"

namespace penumbra::pmc_hi {
namespace {

// Shortest mean resultant for which a mean direction is meaningful.
constexpr double kMinResultant = 1e-3;
// What is owed to equals differs by no more.
constexpr double kTie = 1e-9;
// Up to so many components, a search of the largest per sample is faster than what costs less for
// many.
constexpr std::size_t kFewComponents = 16;

double unit(std::uint32_t bits) noexcept { return static_cast<double>(bits) * 0x1p-32; }

// Random rank of a component: an integer hash of random bits and its index.
// Source: Appleby, MurmurHash3 finaliser.
std::uint32_t tie_rank(std::uint32_t bits, std::size_t component) noexcept {
  std::uint32_t x = bits ^ (static_cast<std::uint32_t>(component + 1) * 0x9e3779b9u);
  x = (x ^ (x >> 16)) * 0x85ebca6bu;
  x = (x ^ (x >> 13)) * 0xc2b2ae35u;
  return x ^ (x >> 16);
}

// What a component is owed beyond the whole part of its product N alpha_k.
double fraction(double product) noexcept { return product - static_cast<int>(product); }

// give_one_by_one for many components, in linear time: those that are owed clearly more than the
// rest-th largest get one each, and its equals share what is left by their ranks. The counts serve
// as the list to search in.
// @param rest  samples beyond the whole parts, > 0
// @return false, with counts of no meaning, where the order of giving matters: near the rest-th
//         largest, not all that differ by less than some kTie are equals of all others
bool give_at_once(std::span<const double> alpha, int total, int rest, const StreamKey& key,
                  std::span<int> counts) noexcept {
  if (rest > static_cast<int>(counts.size())) return false;
  const auto owed = [&](int k) { return fraction(total * alpha[static_cast<std::size_t>(k)]); };
  std::iota(counts.begin(), counts.end(), 0);
  const auto last = counts.begin() + (rest - 1);
  std::nth_element(counts.begin(), last, counts.end(),
                   [&](int a, int b) { return owed(a) > owed(b); });
  const double level = owed(*last);
  // Margins beside kTie, so that no rounding of the comparisons there matters here.
  constexpr double kNear = 3.0 * kTie;
  if (!(level > kNear)) return false;
  int equals = 0;
  for (int k = 0; k < static_cast<int>(alpha.size()); ++k) {
    const double above = owed(k) - level;
    if (above > kNear) --rest;
    if (!(std::abs(above) <= kNear)) continue;
    if (!(std::abs(above) <= 0.25 * kTie)) return false;
    counts[static_cast<std::size_t>(equals++)] = k;
  }
  std::uint32_t bits = 0;
  std::uint32_t lowest_rank = 0;
  if (rest < equals) {
    bits = random_bits(key);
    const auto rank = [&](int k) { return tie_rank(bits, static_cast<std::size_t>(k)); };
    std::nth_element(counts.begin(), counts.begin() + (rest - 1), counts.begin() + equals,
                     [&](int a, int b) { return rank(a) > rank(b); });
    lowest_rank = rank(counts[static_cast<std::size_t>(rest) - 1]);
  }
  for (std::size_t k = 0; k < alpha.size(); ++k) {
    const double product = total * alpha[k];
    const double above = fraction(product) - level;
    const bool gets = above > kNear || (above >= -kNear && tie_rank(bits, k) >= lowest_rank);
    counts[k] = static_cast<int>(product) + (gets ? 1 : 0);
  }
  return true;
}

void largest_remainder(std::span<const double> alpha, int total, const StreamKey& key,
                       std::span<int> counts) noexcept {
  if (alpha.size() > kFewComponents) {
    int rest = total;
    for (const double a : alpha) rest -= static_cast<int>(total * a);
    if (rest > 0 && give_at_once(alpha, total, rest, key, counts)) return;
  }
  give_one_by_one(alpha, total, key, counts);
}

void multinomial(std::span<const double> alpha, int total, const StreamKey& key,
                 std::span<int> counts) noexcept {
  std::fill(counts.begin(), counts.end(), 0);
  const PointSet points(SamplerKind::Independent, key, static_cast<std::uint32_t>(total));
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(total); ++i) {
    double u = static_cast<double>(points(i).choice);
    std::size_t k = 0;
    while (k + 1 < alpha.size() && u >= alpha[k]) u -= alpha[k++];
    while (alpha[k] <= 0.0 && k > 0) --k;  // rounding past the last positive weight
    ++counts[k];
  }
}

// Square of the angle between two unit vectors from the square of their chord: after two halvings
// of the angle, the series of arcsin^2 needs few terms, everywhere to float rounding. Plain
// arithmetic, for vector instructions. Source of the series: Abramowitz and Stegun 15.1, theta^2 =
// 2 sum_n (2 sin(theta/2))^(2n) / (n^2 binomial(2n, n)).
float squared_angle(float chord2) noexcept {
  const float half = chord2 / (2.0f + std::sqrt(std::max(4.0f - chord2, 0.0f)));
  const float quarter = half / (2.0f + std::sqrt(4.0f - half));
  const float series =
      1.0f +
      quarter * (1.0f / 12.0f +
                 quarter * (1.0f / 90.0f +
                            quarter * (1.0f / 560.0f +
                                       quarter * (1.0f / 3150.0f + quarter * (1.0f / 16632.0f)))));
  return 16.0f * quarter * series;
}

// Mean of a function of the squared chord to the axis over the weighted directions. Blocks of
// lanes: the function is worked out for all samples, lit or not.
// @param scale, total  factor of the weights, and their sum with it
template <typename OfChord2>
double weighted_mean(const Mixture& mixture, std::size_t first, std::span<const double> weights,
                     double scale, double total, const Vec3& axis, OfChord2 of_chord2) noexcept {
  const VectorArray& wi = mixture.directions();
  double sum = 0.0;
  for (std::size_t done = 0; done < weights.size(); done += kLaneGroup) {
    float value[kLaneGroup];
    for (std::size_t lane = 0; lane < kLaneGroup; ++lane) {
      const std::size_t i = first + done + lane;
      const float x = wi.x[i] - axis.x;
      const float y = wi.y[i] - axis.y;
      const float z = wi.z[i] - axis.z;
      value[lane] = of_chord2(x * x + y * y + z * z);
    }
    const std::size_t lanes = std::min(kLaneGroup, weights.size() - done);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      sum += weights[done + lane] * static_cast<double>(value[lane]);
    }
  }
  return sum * scale / total;
}

// @param depth  1 - Rbar
double half_angle(BetaRule rule, double depth, double mean_square_angle) noexcept {
  const double variance = depth * (2.0 - depth);  // 1 - Rbar^2
  switch (rule) {
    case BetaRule::RmsAngle:
      return std::sqrt(mean_square_angle);
    case BetaRule::Chord:
      return std::sqrt(2.0 * depth);
    case BetaRule::SphericalStd:
      return std::sqrt(variance);
    case BetaRule::PerAxisStd:
      return std::sqrt(0.5 * variance);
    case BetaRule::CircularStd:
      return std::sqrt(-2.0 * std::log1p(-depth));
    case BetaRule::MeanAngle:
      return 2.0 * std::asin(std::sqrt(0.5 * depth));
  }
  return 0.0;
}

// What raise_to_minimum says, sample by sample. The first of equals gives.
void take_from_largest(std::span<int> counts, int minimum) noexcept {
  const std::size_t cone = counts.size() - 1;
  for (std::size_t k = 0; k < cone; ++k) {
    for (; counts[k] < minimum; ++counts[k]) {
      std::size_t giver = counts.size();
      int most = 0;
      for (std::size_t g = 0; g <= cone; ++g) {
        const bool gives = counts[g] > most && counts[g] > (g == cone ? 0 : minimum);
        giver = gives ? g : giver;
        most = gives ? counts[g] : most;
      }
      PN_ASSERT(giver <= cone);  // check_budget refuses such totals
      if (giver > cone) return;
      --counts[giver];
    }
  }
}

// The same for many components, most of them below the minimum, where a search per sample would
// cost the square of their number: all givers end at a common level, the first of them one below.
// @param wanted  what those below the minimum lack, > 0
void lower_to_level(std::span<int> counts, int minimum, std::int64_t wanted) noexcept {
  const std::size_t cone = counts.size() - 1;
  const auto lowest = [&](std::size_t k) { return k == cone ? 0 : minimum; };
  // What lowering to a level sets free.
  const auto given = [&](int level) {
    std::int64_t sum = 0;
    for (std::size_t k = 0; k <= cone; ++k) {
      sum += std::max(0, counts[k] - std::max(level, lowest(k)));
    }
    return sum;
  };
  PN_ASSERT(given(0) >= wanted);  // check_budget refuses such totals
  wanted = std::min(wanted, given(0));
  int level = 0;
  int high = *std::max_element(counts.begin(), counts.end());
  while (level < high) {
    const int middle = level + (high - level) / 2;
    if (given(middle) <= wanted) {
      high = middle;
    } else {
      level = middle + 1;
    }
  }
  std::int64_t rest = wanted - given(level);
  for (std::size_t k = 0; k <= cone; ++k) {
    if (counts[k] < lowest(k)) {
      const std::int64_t taken = std::min<std::int64_t>(minimum - counts[k], wanted);
      counts[k] += static_cast<int>(taken);
      wanted -= taken;
      continue;
    }
    counts[k] = std::min(counts[k], std::max(level, lowest(k)));
    if (rest > 0 && counts[k] == level && counts[k] > lowest(k)) {
      --counts[k];
      --rest;
    }
  }
}

}  // namespace

void give_one_by_one(std::span<const double> alpha, int total, StreamKey key,
                     std::span<int> counts) noexcept {
  key.component = kRoundingComponent;
  int assigned = 0;
  for (std::size_t k = 0; k < alpha.size(); ++k) {
    counts[k] = static_cast<int>(total * alpha[k]);
    assigned += counts[k];
  }
  // Each remaining sample goes to the component that is owed most; among equals, to the one that a
  // random ranking puts first, so that every one of them is equally likely. What is owed adds up to
  // at least 1, so a component of weight 0 is never the one.
  const auto owed = [&](std::size_t k) { return total * alpha[k] - counts[k]; };
  for (; assigned < total; ++assigned) {
    double most_owed = 0.0;
    for (std::size_t k = 0; k < alpha.size(); ++k) most_owed = std::max(most_owed, owed(k));
    std::size_t equals = 0;
    std::size_t best = 0;
    for (std::size_t k = 0; k < alpha.size(); ++k) {
      const bool equal = owed(k) >= most_owed - kTie;
      best = equal ? k : best;
      equals += equal ? 1 : 0;
    }
    if (equals > 1) {
      const std::uint32_t bits = random_bits(key);
      for (std::size_t k = 0, last = best; k < last; ++k) {
        if (owed(k) >= most_owed - kTie && tie_rank(bits, k) > tie_rank(bits, best)) best = k;
      }
    }
    ++counts[best];
  }
}

void round_counts(Rounding rounding, std::span<const double> alpha, int total, StreamKey key,
                  std::span<int> counts) noexcept {
  key.component = kRoundingComponent;
  switch (rounding) {
    case Rounding::LargestRemainder:
      return largest_remainder(alpha, total, key, counts);
    case Rounding::Systematic:
      return systematic_counts(alpha, total, unit(random_bits(key)), counts);
    case Rounding::Multinomial:
      return multinomial(alpha, total, key, counts);
  }
}

void raise_to_minimum(std::span<int> counts, int minimum) noexcept {
  if (counts.size() <= kFewComponents) return take_from_largest(counts, minimum);
  std::int64_t wanted = 0;
  for (const int count : counts.first(counts.size() - 1)) wanted += std::max(0, minimum - count);
  if (wanted > 0) lower_to_level(counts, minimum, wanted);
}

Cone fit_cone(const Mixture& mixture, std::size_t first, std::span<const double> weights,
              const ConeRules& rules) noexcept {
  // Weights relative to the largest: their sums stay in range for radiance of any magnitude.
  double largest = 0.0;
  for (const double weight : weights) largest = std::max(largest, weight);
  if (!(largest > 0.0)) return {};
  const double scale = 1.0 / largest;
  Vec3d sum(0.0);
  double total = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double w = weights[i] * scale;
    sum += Vec3d(mixture.wi(first + i)) * w;
    total += w;
  }
  const double length = sum.length();
  const double resultant = length / total;
  if (!(resultant >= kMinResultant)) return {};
  const Vec3 axis(sum * (1.0 / length));
  // 1 - Rbar as half the mean squared chord, because lengths of directions differ from 1 by more
  // than 1 - Rbar of a narrow cone does from 0.
  const bool by_angle = rules.rule == BetaRule::RmsAngle;
  const auto mean = [&](auto of_chord2) {
    return weighted_mean(mixture, first, weights, scale, total, axis, of_chord2);
  };
  const double mean_square = by_angle ? mean([](float c) { return squared_angle(c); }) : 0.0;
  const double depth = by_angle ? 0.0 : 0.5 * mean([](float c) { return c; });
  const double beta =
      std::clamp(rules.scale * half_angle(rules.rule, depth, mean_square), rules.min, rules.max);
  const float s = std::sin(static_cast<float>(0.5 * beta));
  return {axis, 2.0f * s * s};
}

void add_tag_sums(const Mixture& mixture, std::size_t first, std::span<const double> weights,
                  std::span<double> sums) noexcept {
  for (std::size_t i = 0; i < weights.size(); ++i) {
    sums[static_cast<std::size_t>(mixture.component(first + i))] += weights[i];
  }
}

void add_posterior_sums(const Mixture& mixture, std::size_t first, std::span<const double> weights,
                        std::span<const double> coefficients, std::span<double> sums) noexcept {
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0.0) continue;
    const auto density = [&](int k, float pdf) {
      return coefficients[static_cast<std::size_t>(k)] * static_cast<double>(pdf);
    };
    double k_sum = 0.0;
    mixture.for_each_pdf_w(first + i, [&](int k, float pdf) { k_sum += density(k, pdf); });
    const double scale = weights[i] / k_sum;
    mixture.for_each_pdf_w(first + i, [&](int k, float pdf) {
      sums[static_cast<std::size_t>(k)] += scale * density(k, pdf);
    });
  }
}

bool normalise(std::span<double> values) noexcept {
  double sum = 0.0;
  for (const double value : values) sum += value;
  if (!(sum > 0.0)) return false;
  const double scale = 1.0 / sum;
  for (double& value : values) value *= scale;
  return true;
}

}  // namespace penumbra::pmc_hi
