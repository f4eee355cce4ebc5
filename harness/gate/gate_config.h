#pragma once

#include <string>
#include <vector>

namespace penumbra {

/// What counts as a loss. All are fractions: 0.03 is 3 %.
struct GateThresholds {
  double noise{0.01};         ///< a loss is certain when its interval lies beyond this one
  double fail{0.03};          ///< smallest measured loss of efficiency that fails
  double pass{0.05};          ///< a pass must exclude this loss
  double instructions{0.01};  ///< largest rise of the work for equal images
  double cpu_time{0.03};      ///< likewise of its CPU time, beyond the noise

  friend bool operator==(const GateThresholds&, const GateThresholds&) = default;
};

/// Other thresholds for some cells, with the reason that a reader of the config wants to know.
struct GateOverride {
  std::string cells;  ///< glob on scene/label/sampler
  std::string reason;
  GateThresholds thresholds;
};

/// The regression gate of an experiment (gate.h). Source: statistics.md section 4.
struct GateConfig {
  std::vector<int> looks{8, 16, 32};  ///< blocks at which it is decided, increasing
  double confidence{0.99};            ///< of failing, over all looks
  std::string metric{"relmse"};       ///< relmse or mse
  double suite_instructions{0.005};   ///< GateThresholds::instructions of all cells together
  double bias_level{0.01};            ///< false alarms of the test of bias, over all cells
  double timeout_s{120};              ///< longest run of a program, and its longest start
  GateThresholds thresholds;
  std::vector<GateOverride> overrides;

  /// @param cell  scene/label/sampler
  const GateThresholds& thresholds_of(const std::string& cell) const;
};

}  // namespace penumbra
