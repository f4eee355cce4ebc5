#include "harness/run_conditions.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <fstream>
#include <string>

namespace penumbra {
namespace {

double one_minute_load() {
  std::ifstream stream("/proc/loadavg");
  double load = 0;
  stream >> load;
  return load;
}

}  // namespace

ConditionsWatch::ConditionsWatch() : before_(counts()), load_average_(one_minute_load()) {}

RunConditions ConditionsWatch::since() const {
  const Counts now = counts();
  RunConditions result;
  result.load_average = load_average_;
  if (now.ticks > before_.ticks) {
    result.steal_share = static_cast<double>(now.stolen - before_.stolen) /
                         static_cast<double>(now.ticks - before_.ticks);
  }
  result.switches_voluntary = now.voluntary - before_.voluntary;
  result.switches_involuntary = now.involuntary - before_.involuntary;
  return result;
}

// The first line of /proc/stat: user nice system idle iowait irq softirq steal, then guests, which
// user and nice contain.
ConditionsWatch::Counts ConditionsWatch::counts() {
  Counts result;
  std::ifstream stream("/proc/stat");
  std::string name;
  stream >> name;
  std::int64_t ticks = 0;
  for (int field = 0; field < 8 && stream >> ticks; ++field) {
    result.ticks += ticks;
    if (field == 7) result.stolen = ticks;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  result.voluntary = usage.ru_nvcsw;
  result.involuntary = usage.ru_nivcsw;
  return result;
}

std::string contamination(const RunConditions& conditions, double wall_s, double cpu_s,
                          int threads) {
  if (wall_s < kShortestJudged_s) return {};
  const double waiting = cpu_s > 0 ? wall_s * threads / cpu_s : 0;
  if (waiting > kWaitingLimit) {
    return fmt::format("wall time x threads is {:.2f} x CPU time", waiting);
  }
  if (conditions.steal_share > kStealLimit) {
    return fmt::format("{:.0f} % of the cores' time was stolen", 100 * conditions.steal_share);
  }
  return {};
}

}  // namespace penumbra
