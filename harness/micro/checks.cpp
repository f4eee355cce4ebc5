#include "harness/micro/checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace penumbra::micro {
namespace {

// Of |z|: false alarms once in 10^7 tests.
constexpr double kLimit = 5.5;

}  // namespace

std::string values_fault(std::string_view what, std::span<const double> found,
                         std::span<const double> expected, double relative, double absolute) {
  if (found.size() != expected.size()) {
    return fmt::format("{}: {} values, expected {}", what, found.size(), expected.size());
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double error = std::abs(found[i] - expected[i]);
    if (error <= std::max(relative * std::abs(expected[i]), absolute)) continue;
    return fmt::format("{}: value {} is {}, expected {}", what, i, found[i], expected[i]);
  }
  return {};
}

std::string counts_fault(std::span<const int> counts, std::span<const double> alpha, int total,
                         double limit) {
  const int sum = std::accumulate(counts.begin(), counts.end(), 0);
  if (sum != total) return fmt::format("counts sum to {}, expected {}", sum, total);
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const double due = total * alpha[k];
    // Rounding of the cumulated weights moves the border by a little.
    if (counts[k] >= 0 && std::abs(counts[k] - due) < limit + 1e-9 * total) continue;
    return fmt::format("count {} is {}, expected within {} of {}", k, counts[k], limit, due);
  }
  return {};
}

std::string mean_counts_fault(std::span<const std::int64_t> sums, std::span<const double> alpha,
                              int total, int draws) {
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const double due = static_cast<double>(draws) * total * alpha[k];
    const double deviation = std::sqrt(due * (1.0 - alpha[k]));
    if (std::abs(static_cast<double>(sums[k]) - due) <= kLimit * deviation + 1.0) continue;
    return fmt::format("count {} summed over {} draws is {}, expected {}", k, draws, sums[k], due);
  }
  return {};
}

std::string raised_fault(std::span<const int> before, std::span<const int> after, int minimum) {
  std::vector<int> expected(before.begin(), before.end());
  const std::size_t cone = before.size() - 1;
  for (std::size_t k = 0; k < cone; ++k) {
    while (expected[k] < minimum) {
      std::size_t giver = before.size();
      for (std::size_t q = 0; q < expected.size(); ++q) {
        if (expected[q] <= (q == cone ? 0 : minimum)) continue;
        if (giver == before.size() || expected[q] > expected[giver]) giver = q;
      }
      if (giver == before.size()) return "no component has samples to give";
      --expected[giver];
      ++expected[k];
    }
  }
  for (std::size_t k = 0; k < expected.size(); ++k) {
    if (after[k] == expected[k]) continue;
    return fmt::format("raised count {} is {}, expected {}", k, after[k], expected[k]);
  }
  return {};
}

std::string cone_fault(const Cone& cone, std::span<const Vec3> wi, std::span<const double> weights,
                       const pmc_hi::ConeRules& rules) {
  Vec3d sum(0.0);
  double total = 0.0;
  for (std::size_t i = 0; i < wi.size(); ++i) {
    sum += Vec3d(wi[i]) * weights[i];
    total += weights[i];
  }
  if (!cone.active()) return "no cone, although directions stand out";
  const Vec3d axis = sum.normalized();
  if ((Vec3d(cone.axis) - axis).length() > 1e-5) return "the axis is not the mean direction";
  double squares = 0.0;
  for (std::size_t i = 0; i < wi.size(); ++i) {
    const Vec3d w = Vec3d(wi[i]).normalized();
    const double angle = std::atan2(axis.cross(w).length(), axis.dot(w));
    squares += weights[i] * angle * angle;
  }
  const double due = std::clamp(rules.scale * std::sqrt(squares / total), rules.min, rules.max);
  const double found = cone.half_angle();
  if (std::abs(found - due) <= 1e-4 * due) return {};
  return fmt::format("the half angle is {}, expected {}", found, due);
}

std::string probabilities_fault(std::span<const double> pmf, std::span<const double> pixel,
                                std::span<const double> block, double samples, double uniform,
                                double kappa) {
  const double pixel_sum = std::accumulate(pixel.begin(), pixel.end(), 0.0);
  const double block_sum = std::accumulate(block.begin(), block.end(), 0.0);
  const double own = pixel_sum > 0.0 ? (1.0 - uniform) * samples / (samples + kappa) : 0.0;
  std::vector<double> expected(pmf.size());
  for (std::size_t l = 0; l < pmf.size(); ++l) {
    expected[l] = uniform / static_cast<double>(pmf.size()) +
                  (1.0 - uniform - own) * (block[l] / block_sum) +
                  (own > 0.0 ? own * (pixel[l] / pixel_sum) : 0.0);
  }
  const double sum = std::accumulate(pmf.begin(), pmf.end(), 0.0);
  if (!(std::abs(sum - 1.0) < 1e-9)) return fmt::format("probabilities sum to {}", sum);
  return values_fault("probabilities", pmf, expected, 1e-9);
}

std::string leaves_fault(const mdhi::LeafTree& tree, std::size_t charts, std::size_t samples,
                         std::size_t capacity) {
  double volume = 0.0;
  std::vector<int> seen(samples, 0);
  for (std::size_t l = 0; l < tree.leaves().size(); ++l) {
    const mdhi::Leaf& leaf = tree.leaves()[l];
    volume += tree.volume(l);
    if (leaf.count > capacity) {
      return fmt::format("leaf {} holds {} samples, at most {} are allowed", l, leaf.count,
                         capacity);
    }
    std::uint32_t sample = leaf.first;
    for (std::uint32_t i = 0; i < leaf.count; ++i, sample = tree.next(sample)) {
      if (sample >= samples) return fmt::format("leaf {} lists sample {}", l, sample);
      ++seen[sample];
      const Vec2& u = tree.position(sample);
      const bool inside =
          u.x >= leaf.lower.x && u.x < leaf.upper.x && u.y >= leaf.lower.y && u.y < leaf.upper.y;
      if (!inside) return fmt::format("sample {} lies outside its leaf {}", sample, l);
    }
  }
  if (std::abs(volume - static_cast<double>(charts)) > 1e-9 * static_cast<double>(charts)) {
    return fmt::format("the leaves cover {} squares, expected {}", volume, charts);
  }
  const auto wrong = std::find_if(seen.begin(), seen.end(), [](int n) { return n != 1; });
  if (wrong == seen.end()) return {};
  return fmt::format("sample {} is in {} leaves", wrong - seen.begin(), *wrong);
}

std::string worst_leaf_fault(const mdhi::LeafTree& tree, std::size_t leaf) {
  for (std::size_t l = 0; l < tree.leaves().size(); ++l) {
    if (tree.error(l) <= tree.error(leaf)) continue;
    return fmt::format("leaf {} has the error {}, the one returned {}", l, tree.error(l),
                       tree.error(leaf));
  }
  return {};
}

std::string uniform_fault(std::span<const float> values, double limit) {
  double sum = 0.0;
  for (const float value : values) {
    if (!(value >= 0.0f && value < 1.0f)) return fmt::format("{} is not in [0, 1)", value);
    sum += static_cast<double>(value);
  }
  const auto n = static_cast<double>(values.size());
  const double z = (sum / n - 0.5) * std::sqrt(12.0 * n);
  if (std::abs(z) <= limit) return {};
  return fmt::format("the mean of {} points is {} ({:+.1f} standard errors)", n, sum / n, z);
}

std::string strata_fault(std::span<const float> values) {
  std::vector<int> held(values.size(), 0);
  for (const float value : values) {
    const double place = static_cast<double>(value) * static_cast<double>(values.size());
    ++held[std::min(static_cast<std::size_t>(place), values.size() - 1)];
  }
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (held[i] != 1) return fmt::format("stratum {} of {} holds {}", i, held.size(), held[i]);
  }
  return {};
}

std::string mass_fault(double integral, double mass, double tolerance) {
  if (std::abs(integral - mass) <= tolerance) return {};
  return fmt::format("the density integrates to {}, draws give a direction with probability {}",
                     integral, mass);
}

std::string hits_fault(std::span<const RayHit> batch, std::span<const RayHit> single) {
  if (batch.size() != single.size()) return "the queries have different numbers of hits";
  std::size_t different = 0;
  std::size_t first = 0;
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const bool same = batch[i].hit() == single[i].hit() &&
                      (!batch[i].hit() || (batch[i].geometry == single[i].geometry &&
                                           std::abs(batch[i].distance - single[i].distance) <=
                                               1e-4f * std::max(1.0f, single[i].distance)));
    if (same) continue;
    if (different++ == 0) first = i;
  }
  if (different <= batch.size() / 1000 + 1) return {};
  return fmt::format("{} of {} rays hit otherwise than alone, first ray {}", different,
                     batch.size(), first);
}

}  // namespace penumbra::micro
