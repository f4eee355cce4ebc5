#pragma once

#include <span>
#include <string>
#include <vector>

/// The calibration of the statistics, for users to repeat: do intervals cover, do tests raise
/// alarms as rarely as they say and find errors as surely. On simulations and on real renders of a
/// scene with an exact answer. Source: statistics.md 3.2 to 3.5.
namespace penumbra {

/// A fault that is built into the statistics or the renders: whoever plants one must see the self
/// test fail. Not reachable from the command line.
enum class PlantedFault {
  None,
  NarrowIntervals,  ///< intervals of ratios are 0.7 times as wide as they should be
  EnergyError,      ///< what is rendered as unbiased is 25 % too bright
  BlindBiasTest,    ///< the bias test tolerates 10 %
};

struct SelfTestOptions {
  bool quick{false};  ///< fewer trials; what is allowed is wider by their noise
  PlantedFault planted{PlantedFault::None};
};

/// One claim and what was found. All seeds are fixed; only "A/A" depends on the machine, because it
/// times real runs.
struct SelfTestCheck {
  std::string name;
  std::string claim;
  int trials{0};
  double measured{0};  ///< share of trials
  double error{0};     ///< standard error of `measured` by the number of trials (binomial, at the
                       ///< nominal share)
  double least{0};     ///< allowed, both ends included
  double most{1};
  double wall_s{0};

  bool passed() const { return measured >= least && measured <= most; }
};

/// Runs all checks.
/// @throws RunError when a render fails
std::vector<SelfTestCheck> run_selftest(const SelfTestOptions& options);

bool passed(std::span<const SelfTestCheck> checks);

/// A table for a terminal, with the verdict as its last line; and the same for machines.
std::string to_terminal(std::span<const SelfTestCheck> checks);
std::string to_json(std::span<const SelfTestCheck> checks, bool quick);

}  // namespace penumbra
