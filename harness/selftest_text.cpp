#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "harness/selftest.h"
#include "harness/text_grid.h"

namespace penumbra {

std::string to_terminal(std::span<const SelfTestCheck> checks) {
  TextGrid grid;
  grid.columns = {{"Check", true},   {"Trials", false}, {"Measured", false}, {"+-", false},
                  {"Allowed", true}, {"Verdict", true}, {"Time", false}};
  std::vector<std::string> notes;
  std::ptrdiff_t failed = 0;
  for (const SelfTestCheck& check : checks) {
    failed += check.passed() ? 0 : 1;
    grid.lines.push_back({check.name, std::to_string(check.trials),
                          fmt::format("{:.3f}", check.measured), fmt::format("{:.3f}", check.error),
                          fmt::format("{:.3f} to {:.3f}", check.least, check.most),
                          check.passed() ? "pass" : "FAIL", fmt::format("{:.1f} s", check.wall_s)});
    notes.push_back(fmt::format("{}: {}.", check.name, check.claim));
  }
  notes.push_back(
      "Measured is a share of trials, +- its standard error by their number. All seeds are fixed; "
      "only A/A depends on the machine, because it times real runs.");
  return terminal_grid(grid, 1) + terminal_notes(notes) +
         (failed == 0 ? fmt::format("\nPASS: {} of {} checks\n", checks.size(), checks.size())
                      : fmt::format("\nFAIL: {} of {} checks\n", failed, checks.size()));
}

std::string to_json(std::span<const SelfTestCheck> checks, bool quick) {
  nlohmann::ordered_json json;
  json["format"] = "penumbra-selftest";
  json["version"] = 1;
  json["quick"] = quick;
  json["passed"] = passed(checks);
  json["checks"] = nlohmann::ordered_json::array();
  for (const SelfTestCheck& check : checks) {
    json["checks"].push_back({{"name", check.name},
                              {"claim", check.claim},
                              {"trials", check.trials},
                              {"measured", check.measured},
                              {"standard_error", check.error},
                              {"allowed", {check.least, check.most}},
                              {"passed", check.passed()},
                              {"wall_s", check.wall_s}});
  }
  return json.dump(2) + "\n";
}

}  // namespace penumbra
