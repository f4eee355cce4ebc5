#pragma once

#include <optional>
#include <span>
#include <vector>

#include "harness/gate/gate_result.h"
#include "harness/gate/gate_run.h"

/// Effects of head over base from paired blocks: the arithmetic of judge.h.
namespace penumbra {

/// Both sides of one block.
struct RunPair {
  const GateRun* base{nullptr};
  const GateRun* head{nullptr};
};

/// The blocks that both sides have, in the order of base. Runs that failed are left out.
std::vector<RunPair> paired_runs(std::span<const GateRun> base, std::span<const GateRun> head);

struct EffectOptions {
  double level{0.01};       ///< one-sided, of `upper` and `lower`
  double least_loss{0.01};  ///< p_loss is of "the efficiency fell by no more than this"
};

/// The cost of a run; empty where it was not counted.
std::optional<double> cost_of(const GateRun& run, GateCurrency currency);

/// Instructions where all runs have them, else rays: both repeat exactly, times do not.
GateCurrency currency_of(std::span<const RunPair> pairs);

/// log(Eff head / Eff base): a ratio of means with a jackknife over blocks.
/// @param with_error  false: of the cost alone, as for equal images
/// @return empty with a reason in `fault`
std::optional<GateEffect> efficiency_effect(std::span<const RunPair> pairs, GateCurrency currency,
                                            bool with_error, const EffectOptions& options,
                                            std::string& fault);

/// log(base time / head time): t over pairs of blocks, in which either side comes first once,
/// because which one does can matter more than a change of the program. Empty without times.
std::optional<GateEffect> time_effect(std::span<const RunPair> pairs, const EffectOptions& options);

/// What one cell contributes to the suite.
struct SuiteMember {
  std::vector<RunPair> pairs;  ///< the same blocks in all members
  GateCurrency currency{GateCurrency::Rays};
  bool with_error{true};
};

/// Mean of the members' log ratios, by a jackknife over blocks that leaves a block out of all.
std::optional<GateEffect> suite_effect(std::span<const SuiteMember> members,
                                       const EffectOptions& options);

/// Likewise of several cells: of every pair of blocks the median over cells.
std::optional<GateEffect> suite_time_effect(std::span<const std::vector<RunPair>> cells,
                                            const EffectOptions& options);

/// Ratio of the means of a cost, head over base.
std::optional<double> cost_ratio(std::span<const RunPair> pairs, GateCurrency currency);

}  // namespace penumbra
