#include "harness/stability/verdict.h"

#include <fmt/format.h>

#include <cmath>

namespace penumbra::stability {
namespace {

constexpr double kUlp = 0x1p-24;
constexpr double kRoundings = 32;
constexpr double kMagnifiedRoundings = 4;

std::string percent(double share) { return fmt::format("{:+.3g} %", 100 * share); }

std::string breaking_reason(const Evidence& e) {
  if (e.non_finite > 0) return fmt::format("{} estimates are not finite", e.non_finite);
  if (e.negative > 0) return fmt::format("{} estimates are negative", e.negative);
  if (e.is_dark && e.statistics.largest() > 0) return "light where there is none";
  if (e.claims_unbiased && e.uncovered > 0) {
    return fmt::format("{} samples are not covered by the mixture's density", e.uncovered);
  }
  return {};
}

std::string noisy_reason(const EstimateStatistics& s) {
  if (!(s.largest() > 0)) return fmt::format("no light in {} estimates", s.count());
  if (s.variance() > kNoisyVariance) return fmt::format("relative variance {:.3g}", s.variance());
  if (s.variance() > kQuietVariance && s.variance_uncertainty() > kVarianceUncertainty) {
    return fmt::format("few estimates decide: kurtosis {:.3g}", s.kurtosis().value_or(0));
  }
  if (std::abs(s.mean() - 1) > kTailDeviation && !s.has_mean()) {
    return fmt::format("a tail without a mean: index {:.2g}", s.tail_index());
  }
  return {};
}

}  // namespace

std::string_view to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::Ok:
      return "ok";
    case Verdict::Noisy:
      return "noisy";
    case Verdict::Biased:
      return "biased";
    case Verdict::Breaks:
      break;
  }
  return "breaks";
}

char letter_of(Verdict verdict) { return ".nbX"[static_cast<std::size_t>(verdict)]; }

double tolerance_of(double condition) {
  return kUlp * (kRoundings + kMagnifiedRoundings * condition);
}

std::optional<double> bias_p(const Evidence& evidence) {
  if (evidence.is_dark || !breaking_reason(evidence).empty()) return std::nullopt;
  return evidence.statistics.test(evidence.tolerance).p;
}

std::vector<std::size_t> significantly_biased(std::span<const Evidence> all, double level) {
  std::vector<std::size_t> tested;
  std::vector<double> p;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (const auto value = bias_p(all[i])) {
      tested.push_back(i);
      p.push_back(*value);
    }
  }
  const std::vector<double> adjusted = holm_adjusted(p);
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < tested.size(); ++i) {
    if (adjusted[i] <= level) found.push_back(tested[i]);
  }
  return found;
}

Judgement judge(const Evidence& evidence, const Evidence* confirmed) {
  if (std::string reason = breaking_reason(evidence); !reason.empty()) {
    return {Verdict::Breaks, std::move(reason)};
  }
  if (evidence.is_dark) return {};
  if (confirmed != nullptr) {
    if (std::string reason = breaking_reason(*confirmed); !reason.empty()) {
      return {Verdict::Breaks, std::move(reason)};
    }
    const double bias = confirmed->statistics.mean() - 1;
    return {std::abs(bias) > kBreakingBias ? Verdict::Breaks : Verdict::Biased,
            "bias " + percent(bias)};
  }
  if (std::string reason = noisy_reason(evidence.statistics); !reason.empty()) {
    return {Verdict::Noisy, std::move(reason)};
  }
  return {};
}

std::vector<std::pair<Verdict, std::string>> rules_in_words() {
  return {
      {Verdict::Ok, "none of the below"},
      {Verdict::Noisy,
       fmt::format(
           "relative variance of an estimate above {:g}; or above {:g} and decided by so "
           "few estimates that it is known to {:g} % only; or the light is never seen, or in "
           "a tail too heavy for a mean, so that nothing can be said of bias",
           kNoisyVariance, kQuietVariance, 100 * kVarianceUncertainty)},
      {Verdict::Biased, "the mean differs from the exact answer, significantly and confirmed"},
      {Verdict::Breaks,
       fmt::format("an estimate that is not finite, negative, or light where there is none; or a "
                   "bias of more than {:g} % of the answer",
                   100 * kBreakingBias)}};
}

std::string bias_rule_in_words() {
  return fmt::format(
      "Bias: Holm over all cells of this table at {:g} %, then {} times as many estimates with "
      "fresh random numbers, Holm over those at {:g} %. A deficit counts only where the tail has a "
      "mean and estimates {:g} times the largest one seen could not have hidden it; deviations "
      "within single precision (column tolerance) do not count.",
      100 * kLevel, kConfirmFactor, 100 * kConfirmLevel, kUnseenFactor);
}

}  // namespace penumbra::stability
