// What `penumbra selftest` runs: it passes, and each fault that is planted fails the checks that
// are there to find it and no others. Seeds are fixed in the checks; one of them times real runs
// and raises a false alarm with a probability of 1e-3 per call.

#include "harness/selftest.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>

namespace penumbra {
namespace {

std::vector<SelfTestCheck> checks_with(PlantedFault fault) {
  SelfTestOptions options;
  options.quick = true;
  options.planted = fault;
  return run_selftest(options);
}

std::set<std::string> failed(const std::vector<SelfTestCheck>& checks) {
  std::set<std::string> names;
  for (const SelfTestCheck& check : checks) {
    if (!check.passed()) names.insert(check.name);
  }
  return names;
}

TEST(SelfTestCommand, PassesAndSaysSo) {
  const std::vector<SelfTestCheck> checks = checks_with(PlantedFault::None);
  EXPECT_TRUE(passed(checks)) << to_terminal(checks);
  EXPECT_NE(to_terminal(checks).find("PASS: 6 of 6 checks"), std::string::npos);
  const auto json = nlohmann::json::parse(to_json(checks, true));
  EXPECT_TRUE(json["passed"].get<bool>());
  EXPECT_EQ(json["checks"].size(), checks.size());
  EXPECT_EQ(json["checks"][0]["allowed"].size(), 2u);
}

TEST(SelfTestCommand, NarrowIntervalsAreFoundOut) {
  const std::vector<SelfTestCheck> checks = checks_with(PlantedFault::NarrowIntervals);
  EXPECT_EQ(failed(checks),
            (std::set<std::string>{"coverage, simulated", "coverage, rendered", "A/A"}))
      << to_terminal(checks);
  EXPECT_NE(to_terminal(checks).find("FAIL: 3 of 6 checks"), std::string::npos);
  EXPECT_FALSE(nlohmann::json::parse(to_json(checks, true))["passed"].get<bool>());
}

TEST(SelfTestCommand, EstimatorThatIsTooBrightIsFoundOut) {
  const std::vector<SelfTestCheck> checks = checks_with(PlantedFault::EnergyError);
  EXPECT_EQ(failed(checks), (std::set<std::string>{"bias test, false alarms", "slope of MSE"}))
      << to_terminal(checks);
}

TEST(SelfTestCommand, BiasTestThatSeesNothingIsFoundOut) {
  const std::vector<SelfTestCheck> checks = checks_with(PlantedFault::BlindBiasTest);
  EXPECT_EQ(failed(checks), (std::set<std::string>{"bias test, power"})) << to_terminal(checks);
}

}  // namespace
}  // namespace penumbra
