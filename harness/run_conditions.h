#pragma once

#include <cstdint>
#include <string>

/// What else went on on the machine while a run was timed. Source: statistics.md 3.3.
namespace penumbra {

struct RunConditions {
  double load_average{0};              ///< of the last minute, at the start
  double steal_share{0};               ///< of all cores' time, taken by the hypervisor
  std::int64_t switches_voluntary{0};  ///< of this process's threads, during the run
  std::int64_t switches_involuntary{0};
};

/// Watches from its making.
class ConditionsWatch {
 public:
  ConditionsWatch();
  RunConditions since() const;

 private:
  struct Counts {
    std::int64_t ticks{0}, stolen{0};  // of all cores
    std::int64_t voluntary{0}, involuntary{0};
  };
  static Counts counts();

  Counts before_;
  double load_average_;
};

/// Why the times of a run are not to be trusted: the machine took its cores away, for more than
/// kWaitingLimit x the CPU time that was used, or by the hypervisor. Runs shorter than
/// kShortestJudged_s are not judged: starting threads takes a share of them, and stolen time is
/// counted in ticks of 10 ms.
/// @return empty when there is no reason
std::string contamination(const RunConditions& conditions, double wall_s, double cpu_s,
                          int threads);

inline constexpr double kWaitingLimit = 1.2;
inline constexpr double kStealLimit = 0.02;
inline constexpr double kShortestJudged_s = 0.25;

}  // namespace penumbra
