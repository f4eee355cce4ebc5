#pragma once

#include <string>
#include <vector>

#include "harness/micro/suite.h"

/// Links what kernels cost to what estimates cost: the time that each kernel's calls take in an
/// estimate, as a share of the estimate's time T, and what efficiency would be if they took none.
namespace penumbra::micro {

struct KernelShare {
  std::string kernel;
  std::string unit;       ///< of a call
  double calls{0};        ///< per estimate
  double ns_per_call{0};  ///< median
  double share{0};        ///< of the estimate's measured time

  double ns() const noexcept { return calls * ns_per_call; }  ///< per estimate
};

/// One estimator at one SRL in one scene.
struct EstimateShares {
  std::string scene, estimator, srl;
  double samples{0}, rays{0};  ///< per estimate
  double measured_ns{0};       ///< T, median, per estimate
  double shadow_ray_ns{0};
  std::vector<KernelShare> kernels{};

  double predicted_ns() const;  ///< all kernels together
  /// Of the kernels that adapt.
  double adaptation_share() const;
};

/// Efficiency, 1/(variance x T), over what it is, when a share of T costs nothing.
/// @param share  in [0, 1); infinite at 1
double gain_without(double share) noexcept;

/// The shares from times; the kernels' names and calls are given.
/// @param measured_ns  of an estimate
void set_shares(EstimateShares& shares, double measured_ns);

/// Lines for the terminal.
std::string shares_text(const std::vector<EstimateShares>& all);

/// One row per kernel, and per estimate the rows "all kernels", "unexplained" and "estimate".
std::string shares_csv(const std::vector<EstimateShares>& all, const MicroConfig& config);

/// Measures pmc_hi, mis, alsd and mdhi at the config's scenes and SRL, and prints the table.
/// @param csv  also into this file; empty: none
/// @return exit code; kRunFailure where replayed estimates are not the estimator's own
int print_shares(Suite& suite, const std::string& csv);

}  // namespace penumbra::micro
