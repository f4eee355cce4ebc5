// Equal time through the real executable: what is frozen, and what the rows say of it. Times
// themselves are never asserted.

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "harness/curves.h"
#include "harness/run_row.h"
#include "tests/e2e/command_line_fixture.h"

namespace penumbra {
namespace {

class Budgets : public CommandLine {
 protected:
  /// Runs the smoke config with a budget, independent points only, one block unless told.
  void run_with(const std::string& budget, const std::string& more = "--set blocks=1") {
    const Outcome outcome =
        run("run configs/smoke.json --out out --set 'samplers=[\"independent\"]' --set 'budget=" +
            budget + "' --set images.maps=false " + more);
    ASSERT_EQ(outcome.code, 0) << outcome.output;
  }

  nlohmann::json planned() const {
    return nlohmann::json::parse(read_text(root_ / "out/plan.lock.json"))["cells"];
  }
};

TEST_F(Budgets, MatchedBudgetIsTheTimeOfAMethodAtItsOwnNumbers) {
  run_with(R"({"match":"MIS","pilots":1})", "--set blocks=1 --set scenes.0.camera_samples=1");
  std::set<double> budgets;
  for (const nlohmann::json& cell : planned()) {
    budgets.insert(cell["budget_s"].get<double>());
    if (cell["label"] == "MIS") {
      EXPECT_EQ(cell["spp"], 4);
    }
  }
  EXPECT_EQ(budgets.size(), 1u) << planned().dump(2);
  for (const RunRow& row : read_run_rows(root_ / "out/measurements.csv").rows) {
    EXPECT_EQ(row.budget_s, *budgets.begin()) << row.label;
  }
}

TEST_F(Budgets, MatchedBudgetStaysWhenAMethodIsAdded) {
  const std::string budget = R"({"match":"MIS","pilots":1})";
  const std::string set = "--set blocks=1 --set scenes.0.camera_samples=1";
  run_with(budget, set);
  const double before = planned()[0]["budget_s"].get<double>();
  run_with(budget, set + " --set 'methods.PMC-HI.params.population=[8,16]'");
  ASSERT_EQ(planned().size(), 3u);
  for (const nlohmann::json& cell : planned()) EXPECT_EQ(cell["budget_s"], before) << cell;
}

TEST_F(Budgets, SolvedSrlKeepsItsSplitAndTheGivenSpp) {
  run_with(R"({"match":"MIS","solve_for":"srl","pilots":1})",
           "--set blocks=1 --set methods.PMC-HI.srl=8-8");
  for (const nlohmann::json& cell : planned()) {
    EXPECT_EQ(cell["spp"], 4);
    if (cell["label"] != "PMC-HI") continue;
    const std::string srl = cell["srl"].get<std::string>();
    const std::size_t dash = srl.find('-');
    ASSERT_NE(dash, std::string::npos) << srl;
    EXPECT_LE(std::abs(std::stoi(srl.substr(0, dash)) - std::stoi(srl.substr(dash + 1))), 1) << srl;
  }
}

TEST_F(Budgets, SeveralShareALineAndMakeCurvesWithSeedsOfTheirOwn) {
  run_with(R"({"time_cpu_s":{"from":0.2,"to":0.8,"steps":3},"pilots":1})", "--set blocks=2");
  std::map<std::string, std::vector<int>> spp;
  std::map<std::string, std::set<double>> slopes;
  for (const nlohmann::json& cell : planned()) {
    spp[cell["label"]].push_back(cell["spp"].get<int>());
    slopes[cell["label"]].insert(cell["per_unit_s"].get<double>());
  }
  ASSERT_EQ(spp.size(), 2u);
  for (const auto& [label, values] : spp) {
    ASSERT_EQ(values.size(), 3u) << label;
    EXPECT_LT(values[0], values[1]) << label;
    EXPECT_LT(values[1], values[2]) << label;
    EXPECT_EQ(slopes[label].size(), 1u) << label;
  }
  std::set<std::uint64_t> seeds;
  const std::vector<RunRow> rows = read_run_rows(root_ / "out/measurements.csv").rows;
  for (const RunRow& row : rows) {
    if (row.attempt == 0) seeds.insert(row.seed);
  }
  EXPECT_EQ(seeds.size(), 2u * 3u * 2u);
  EXPECT_EQ(read_curve_rows(root_ / "out/curves.csv").size(), 2u);
  EXPECT_EQ(read_curve_point_rows(root_ / "out/curve_points.csv").size(), 6u);
}

TEST_F(Budgets, TooSmallForOneEstimatePerShadingPointIsAnError) {
  const Outcome outcome =
      run("run configs/smoke.json --out out --set 'budget={\"time_cpu_s\":1e-6,\"pilots\":1}'");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.output.find("budget of 1e-06 s is too small for \"MIS\""), std::string::npos)
      << outcome.output;
}

}  // namespace
}  // namespace penumbra
