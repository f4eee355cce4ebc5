// selftest: the calibration of the statistics.

#include "harness/selftest.h"

#include <fmt/format.h>

#include "harness/commands/commands.h"

namespace penumbra {

int selftest_command(const SelfTestCommandOptions& options) {
  SelfTestOptions test;
  test.quick = options.quick;
  const std::vector<SelfTestCheck> checks = run_selftest(test);
  fmt::print("{}", options.json ? to_json(checks, options.quick) : to_terminal(checks));
  return passed(checks) ? kSuccess : kCorrectness;
}

}  // namespace penumbra
