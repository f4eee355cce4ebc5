#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/stability/estimate_statistics.h"

/// The rules by which `penumbra stability` judges an estimator at one step of a sweep. Knows
/// numbers only, so that tests can hand it samples of any kind.
namespace penumbra::stability {

/// In order of severity.
enum class Verdict : std::uint8_t { Ok, Noisy, Biased, Breaks };

std::string_view to_string(Verdict verdict);
/// One letter for a table: '.', 'n', 'b', 'X'.
char letter_of(Verdict verdict);

/// Noisy: one estimate errs by as much as the answer, or more.
inline constexpr double kNoisyVariance = 1.0;
/// Noisy: the variance itself has a larger relative error, because few estimates decide it; where
/// it is large enough to matter, an error of a tenth of the answer.
inline constexpr double kVarianceUncertainty = 0.3;
inline constexpr double kQuietVariance = 0.01;
/// Noisy: a tail without a mean, where the mean that was seen is off by more than this.
inline constexpr double kTailDeviation = 0.1;
/// Family-wise level of the bias tests of all steps and estimators together (Holm).
inline constexpr double kLevel = 0.01;
/// Of their confirmation, over all that are repeated with fresh random numbers and
/// kConfirmFactor as many estimates.
inline constexpr double kConfirmLevel = 1e-3;
inline constexpr int kConfirmFactor = 4;
/// Breaks: a confirmed bias of more than this share of the answer.
inline constexpr double kBreakingBias = 0.9;

/// Relative deviation that single precision explains: a few dozen roundings, and four of what the
/// step magnifies.
/// @param condition  StabilityStep::condition
double tolerance_of(double condition);

/// What was seen of one estimator at one step.
struct Evidence {
  EstimateStatistics statistics;  ///< relative to the answer; absolute where that is 0
  std::uint64_t non_finite{0}, negative{0};
  std::uint64_t uncovered{0};  ///< samples that the mixture's density does not cover
  bool is_dark{false};         ///< the answer is 0
  bool claims_unbiased{true};
  double tolerance{0};
};

/// The p value that goes into the family of bias tests.
/// @return empty where nothing is to be tested: a dark step, or estimates that are no numbers
std::optional<double> bias_p(const Evidence& evidence);

/// Indices of the evidence whose bias is significant at `level`, family-wise by Holm.
std::vector<std::size_t> significantly_biased(std::span<const Evidence> all, double level);

struct Judgement {
  Verdict verdict{Verdict::Ok};
  std::string reason;  ///< one clause; empty when ok
};

/// Judges one step.
/// @param confirmed  evidence of the repetition, where the bias was confirmed by it
Judgement judge(const Evidence& evidence, const Evidence* confirmed);

/// The rules in words, for legends: one line each, by verdict.
std::vector<std::pair<Verdict, std::string>> rules_in_words();

/// How the bias tests are corrected and confirmed, in words.
std::string bias_rule_in_words();

}  // namespace penumbra::stability
