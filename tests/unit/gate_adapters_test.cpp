#include "harness/gate/gate_adapters.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "tests/unit/gate_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;

/// A cell without efficiency, one without a finite one, one with awkward text.
GateResult result_with_gaps() {
  GateCell infinite = gate_cell("s/inf/sobol", 1, GateVerdict::Pass, GateReason::WithinLimits);
  infinite.efficiency->interval.hi = std::numeric_limits<double>::infinity();
  GateCell awkward = gate_cell(kAwkwardName, 0.9, GateVerdict::Fail, GateReason::Noisier);
  return gate_result({crashed_cell("s/crash/sobol"), infinite, awkward}, GateVerdict::Fail, 4);
}

TEST(GateAdapters, GithubActionGetsNameUnitValueRangeAndExtra) {
  const json list = json::parse(github_benchmark_json(passing_result()).dump());
  ASSERT_EQ(list.size(), 3U);
  EXPECT_EQ(list[0]["name"], "all cells");
  EXPECT_EQ(list[1]["name"], "s/A/sobol");
  const json& cell = list[2];
  EXPECT_EQ(cell.size(), 5U);
  EXPECT_EQ(cell["name"], "s/B/sobol");
  EXPECT_EQ(cell["unit"], "head/base");
  EXPECT_NEAR(cell["value"].get<double>(), 0.98, 1e-15);
  EXPECT_EQ(cell["range"], "0.9606 to 0.9998");  // 0.98 exp(-0.02), 0.98 exp(0.02)
  EXPECT_EQ(cell["extra"], "PASS: sentence of s/B/sobol");
}

TEST(GateAdapters, BencherGetsValuesWithTheirInterval) {
  const json metrics = json::parse(bencher_json(passing_result()).dump());
  ASSERT_EQ(metrics.size(), 3U);
  const json& cell = metrics["s/B/sobol"];
  ASSERT_EQ(cell.size(), 1U);
  EXPECT_EQ(cell["efficiency-ratio"].size(), 3U);
  EXPECT_NEAR(cell["efficiency-ratio"]["value"].get<double>(), 0.98, 1e-15);
  EXPECT_NEAR(cell["efficiency-ratio"]["lower_value"].get<double>(), 0.98 * std::exp(-0.02), 1e-15);
  EXPECT_NEAR(cell["efficiency-ratio"]["upper_value"].get<double>(), 0.98 * std::exp(0.02), 1e-15);
  EXPECT_TRUE(metrics.contains("all cells"));
}

TEST(GateAdapters, WhatHasNoFiniteEfficiencyIsLeftOut) {
  const json list = json::parse(github_benchmark_json(result_with_gaps()).dump());
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[1]["name"], kAwkwardName);
  const json metrics = json::parse(bencher_json(result_with_gaps()).dump());
  EXPECT_EQ(metrics.size(), 2U);
  EXPECT_TRUE(metrics.contains(kAwkwardName));
}

TEST(GateAdapters, NothingMeasuredIsAnEmptyListAndAnEmptyObject) {
  EXPECT_EQ(github_benchmark_json(GateResult{}).dump(), "[]");
  EXPECT_EQ(bencher_json(GateResult{}).dump(), "{}");
}

}  // namespace
}  // namespace penumbra
