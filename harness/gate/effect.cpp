#include "harness/gate/effect.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

// P(t' <= t) under Student's t.
double student_t_lower_p(double t, double degrees_of_freedom) {
  const double two_sided = student_t_two_sided_p(t, degrees_of_freedom);
  return t < 0 ? two_sided / 2 : 1 - two_sided / 2;
}

GateEffect effect_of(double log_ratio, double standard_error, std::size_t blocks,
                     const EffectOptions& options) {
  const auto degrees_of_freedom = static_cast<double>(blocks - 1);
  const double wide = student_t_quantile(0.975, degrees_of_freedom) * standard_error;
  const double bound = student_t_quantile(1 - options.level, degrees_of_freedom) * standard_error;
  const double allowed = std::log1p(-options.least_loss);
  GateEffect effect;
  effect.log_ratio = log_ratio;
  effect.standard_error = standard_error;
  effect.interval = {log_ratio - wide, log_ratio + wide};
  effect.upper = log_ratio + bound;
  effect.lower = log_ratio - bound;
  // Counts that do not vary are certain.
  effect.p_loss = standard_error > 0 ? student_t_lower_p((log_ratio - allowed) / standard_error,
                                                         degrees_of_freedom)
                                     : (log_ratio < allowed ? 0.0 : 1.0);
  return effect;
}

// log(base time / head time), negative where head takes longer: means over pairs of blocks, in
// which either side came first once.
std::optional<std::map<int, double>> log_time_ratios(std::span<const RunPair> pairs) {
  std::map<int, Welford> logs;
  for (const RunPair& pair : pairs) {
    if (!pair.base->time_cpu_s || !pair.head->time_cpu_s) return std::nullopt;
    const double log = std::log(*pair.base->time_cpu_s / *pair.head->time_cpu_s);
    if (!std::isfinite(log)) return std::nullopt;
    logs[pair.base->block / 2].add(log);
  }
  std::map<int, double> means;
  for (const auto& [two_blocks, values] : logs) means[two_blocks] = values.mean();
  return means;
}

std::optional<GateEffect> mean_effect(const Welford& values, const EffectOptions& options) {
  if (values.count() < 2) return std::nullopt;
  return effect_of(values.mean(), *values.standard_error(), values.count(), options);
}

// Empty where a run lacks the cost.
std::optional<std::vector<PairedCostError>> costs_of(std::span<const RunPair> pairs,
                                                     GateCurrency currency, bool with_error) {
  std::vector<PairedCostError> costs;
  for (const RunPair& pair : pairs) {
    const std::optional<double> base = cost_of(*pair.base, currency);
    const std::optional<double> head = cost_of(*pair.head, currency);
    if (!base || !head) return std::nullopt;
    if (with_error && !(pair.base->error && pair.head->error)) return std::nullopt;
    costs.push_back({{*head, with_error ? *pair.head->error : 1.0},
                     {*base, with_error ? *pair.base->error : 1.0}});
  }
  return costs;
}

}  // namespace

std::vector<RunPair> paired_runs(std::span<const GateRun> base, std::span<const GateRun> head) {
  std::vector<RunPair> pairs;
  for (const GateRun& run : base) {
    if (!run.failure.empty()) continue;
    const auto other = std::find_if(head.begin(), head.end(), [&](const GateRun& candidate) {
      return candidate.block == run.block && candidate.cell == run.cell &&
             candidate.failure.empty();
    });
    if (other != head.end()) pairs.push_back({&run, &*other});
  }
  return pairs;
}

std::optional<double> cost_of(const GateRun& run, GateCurrency currency) {
  switch (currency) {
    case GateCurrency::Instructions:
      if (!run.instructions) return std::nullopt;
      return static_cast<double>(*run.instructions);
    case GateCurrency::CpuTime:
      return run.time_cpu_s;
    case GateCurrency::Rays:
      return static_cast<double>(run.rays);
  }
  return std::nullopt;
}

GateCurrency currency_of(std::span<const RunPair> pairs) {
  const bool counted = std::all_of(pairs.begin(), pairs.end(), [](const RunPair& pair) {
    return pair.base->instructions && pair.head->instructions;
  });
  return counted ? GateCurrency::Instructions : GateCurrency::Rays;
}

std::optional<GateEffect> efficiency_effect(std::span<const RunPair> pairs, GateCurrency currency,
                                            bool with_error, const EffectOptions& options,
                                            std::string& fault) {
  const auto costs = costs_of(pairs, currency, with_error);
  if (!costs) {
    fault = "a run has no error or no cost";
    return std::nullopt;
  }
  const EfficiencyEstimate estimate = log_efficiency_ratio(*costs);
  if (!estimate.log) {
    fault = std::string(reason_text(estimate.reason));
    return std::nullopt;
  }
  if (!estimate.log->standard_error) {
    fault = "fewer than two common blocks";
    return std::nullopt;
  }
  return effect_of(estimate.log->value, *estimate.log->standard_error, pairs.size(), options);
}

std::optional<GateEffect> time_effect(std::span<const RunPair> pairs,
                                      const EffectOptions& options) {
  const auto logs = log_time_ratios(pairs);
  if (!logs) return std::nullopt;
  Welford values;
  for (const auto& [two_blocks, log] : *logs) values.add(log);
  return mean_effect(values, options);
}

std::optional<GateEffect> suite_time_effect(std::span<const std::vector<RunPair>> cells,
                                            const EffectOptions& options) {
  std::map<int, std::vector<double>> of_cells;
  for (const std::vector<RunPair>& pairs : cells) {
    const auto logs = log_time_ratios(pairs);
    if (!logs) return std::nullopt;
    for (const auto& [two_blocks, log] : *logs) of_cells[two_blocks].push_back(log);
  }
  Welford values;
  for (auto& [two_blocks, logs] : of_cells) values.add(median(std::move(logs)));
  return mean_effect(values, options);
}

std::optional<GateEffect> suite_effect(std::span<const SuiteMember> members,
                                       const EffectOptions& options) {
  if (members.empty() || members[0].pairs.size() < 2) return std::nullopt;
  const std::size_t blocks = members[0].pairs.size();
  std::vector<std::vector<PairedCostError>> costs;
  for (const SuiteMember& member : members) {
    PN_CHECK(member.pairs.size() == blocks, "the members have the same blocks");
    auto of_member = costs_of(member.pairs, member.currency, member.with_error);
    if (!of_member) return std::nullopt;
    costs.push_back(std::move(*of_member));
  }
  // Mean log ratio of all blocks but one; `blocks` leaves none out.
  const auto mean_without = [&](std::size_t left_out) -> std::optional<double> {
    Welford ratios;
    for (const std::vector<PairedCostError>& member : costs) {
      std::vector<PairedCostError> kept = member;
      if (left_out < blocks) kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(left_out));
      const EfficiencyEstimate estimate = log_efficiency_ratio(kept);
      if (!estimate.log) return std::nullopt;
      ratios.add(estimate.log->value);
    }
    return ratios.mean();
  };
  const std::optional<double> all = mean_without(blocks);
  if (!all) return std::nullopt;
  Welford left_out;
  for (std::size_t b = 0; b < blocks; ++b) {
    const std::optional<double> value = mean_without(b);
    if (!value) return std::nullopt;
    left_out.add(*value);
  }
  // (R-1)/R sum (x - mean)^2 = (R-1)^2/R times the unbiased variance.
  const auto n = static_cast<double>(blocks);
  const double variance = *left_out.variance() * (n - 1) * (n - 1) / n;
  return effect_of(*all, std::sqrt(variance), blocks, options);
}

std::optional<double> cost_ratio(std::span<const RunPair> pairs, GateCurrency currency) {
  double base = 0, head = 0;
  for (const RunPair& pair : pairs) {
    const std::optional<double> of_base = cost_of(*pair.base, currency);
    const std::optional<double> of_head = cost_of(*pair.head, currency);
    if (!of_base || !of_head) return std::nullopt;
    base += *of_base;
    head += *of_head;
  }
  if (!(base > 0)) return std::nullopt;
  return head / base;
}

}  // namespace penumbra
