#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/statistics.h"

/// What a gate found: per cell, for all cells together, and on the whole.
namespace penumbra {

enum class GateVerdict { Pass, Fail, Inconclusive };

/// Why. The first group passes, the second fails (or is inconclusive, where that is the verdict).
enum class GateReason {
  Unchanged,         ///< same images, same work
  WithinLimits,      ///< changed, and a loss that matters is excluded
  Improved,          ///< certainly more efficient: a stored baseline is stale
  Acknowledged,      ///< a loss that somebody has accepted
  Noisier,           ///< more error for the same work
  MoreRays,          ///< more rays without the error that they should save
  Slower,            ///< more work or time per ray
  Biased,            ///< the mean is not the reference's
  NonDeterministic,  ///< the same seed gave other bits
  Failed,            ///< crashed, timed out, or a value that is not finite
  TooNoisy,          ///< the blocks do not decide
  NotRepeated,       ///< a loss that fresh seeds did not show again
};

std::string_view to_string(GateVerdict verdict) noexcept;
std::string_view to_string(GateReason reason) noexcept;

/// What a loss is counted in.
enum class GateCurrency { Instructions, CpuTime, Rays };
std::string_view to_string(GateCurrency currency) noexcept;

/// The logarithm of head over base, with what decides.
struct GateEffect {
  double log_ratio{0};
  double standard_error{0};
  Interval interval;  ///< of log_ratio, 95 %
  double upper{0};    ///< one-sided bounds at the level of a decision
  double lower{0};
  double p_loss{1};  ///< of "the ratio is not below 1 - noise", one-sided
};

/// Work counters that differ between the sides.
struct CounterChange {
  std::string name;
  double base{0};  ///< means over blocks
  double head{0};
};

/// The test of bias of head, where its images are not those of base.
struct GateBias {
  double p{1};                     ///< smallest over tiles, adjusted over them
  double adjusted_p{1};            ///< over cells too
  std::optional<double> relative;  ///< of the mean of the whole image
  std::optional<Interval> relative_interval;
  int blocks{0};
  std::string skipped;  ///< why there was no test; empty: there was
};

struct GateCell {
  std::string name;
  int blocks{0};
  bool same_images{false};
  bool same_half_images{false};  ///< equal to half precision
  std::vector<CounterChange> counters;
  GateCurrency currency{GateCurrency::Instructions};
  std::optional<GateEffect> efficiency;  ///< in the currency; empty with `no_efficiency`
  std::string no_efficiency;
  std::optional<GateEffect> efficiency_cpu;  ///< in CPU time, where the sides were interleaved
  std::optional<double> error_ratio;         ///< head over base, of means, like the next ones
  std::optional<double> instructions_ratio;
  std::optional<double> rays_ratio;
  std::optional<double> cpu_ratio;   ///< by Hodges and Lehmann over pairs
  std::optional<double> p_eff;       ///< of base, median of runs
  std::optional<double> detectable;  ///< smallest loss that these blocks show with 80 % power
  GateBias bias;
  bool lost_time_only{false};  ///< CPU time is all that fails
  bool confirmed{false};       ///< with fresh seeds
  GateVerdict verdict{GateVerdict::Inconclusive};
  GateReason reason{GateReason::TooNoisy};
  std::string sentence;
};

/// All cells together: geometric means.
struct GateSuite {
  int cells{0};
  int blocks{0};
  GateCurrency currency{GateCurrency::Instructions};
  std::optional<GateEffect> efficiency;
  std::optional<double> instructions_ratio;  ///< of the cells with same images
  bool confirmed{false};
  GateVerdict verdict{GateVerdict::Inconclusive};
  GateReason reason{GateReason::TooNoisy};
  std::string sentence;
};

/// The base against itself: whether times can be compared here.
struct NullControl {
  int pairs{0};
  std::optional<GateEffect> cpu_time;
  bool rejected{false};  ///< times differ without a cause: losses of time decide nothing
};

/// What was compared with what.
struct GateProvenance {
  std::string what;   ///< path of the program, folder or baseline
  std::string build;  ///< JSON of the build
  std::string machine;
};

struct GateResult {
  GateVerdict verdict{GateVerdict::Inconclusive};
  int exit_code{3};
  std::string sentence;
  std::string config_name;
  std::string config_file;
  std::string metric;
  double confidence{0.99};
  std::vector<int> looks;
  int blocks{0};  ///< of the last look
  bool interleaved{false};
  GateSuite suite;
  std::vector<GateCell> cells;  ///< in the order of the config
  std::optional<NullControl> null_control;
  std::vector<std::string> notes;
  GateProvenance base, head;
  double wall_s{0};
  std::uint64_t runs{0};
};

}  // namespace penumbra
