#include "harness/sweep.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/plan.h"
#include "tests/unit/config_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;

class Sweep : public ConfigTest {
 protected:
  /// The small config with these values in its second method, which is pmc_hi.
  json with(const json& values) const {
    json config = small_config();
    config["methods"][1] = {{"label", "P"}, {"estimator", "pmc_hi"}, {"srl", "4-12"}};
    config["methods"][1].update(values);
    return config;
  }

  /// Points of that method as "sampler spp srl name=value...".
  std::vector<std::string> points(const json& values) const {
    const ExperimentConfig config = load(with(values));
    std::vector<std::string> texts;
    for (const SweepPoint& point : sweep_points(config, config.methods[1])) {
      std::string text = point.sampler + " " + std::to_string(point.spp) + " " + point.srl.text();
      for (const auto& [name, value] : point.params) text += " " + name + "=" + to_string(value);
      texts.push_back(text);
    }
    return texts;
  }
};

using Texts = std::vector<std::string>;

TEST_F(Sweep, IsAProductWithTheLastAxisFastest) {
  EXPECT_EQ(points({{"sampler", {"independent", "sobol"}},
                    {"srl", {"4-12", "2-6"}},
                    {"params", {{"population", {8, 16}}}}}),
            (Texts{"independent 8 4-12 population=8", "independent 8 4-12 population=16",
                   "independent 8 2-6 population=8", "independent 8 2-6 population=16",
                   "sobol 8 4-12 population=8", "sobol 8 4-12 population=16",
                   "sobol 8 2-6 population=8", "sobol 8 2-6 population=16"}));
}

TEST_F(Sweep, OfSppOverridesTheExperiments) {
  EXPECT_EQ(points({{"spp", {4, 32}}}), (Texts{"independent 4 4-12", "independent 32 4-12"}));
}

TEST_F(Sweep, ZippedAxesAdvanceTogether) {
  EXPECT_EQ(
      points({{"srl", {"4-12", "8-24"}},
              {"params", {{"population", {8, 16}}, {"n_min", {1, 2}}}},
              {"zip", json::array({json::array({"srl", "population"})})}}),
      (Texts{"independent 8 4-12 n_min=1 population=8", "independent 8 4-12 n_min=2 population=8",
             "independent 8 8-24 n_min=1 population=16",
             "independent 8 8-24 n_min=2 population=16"}));
}

TEST_F(Sweep, LeavesOutWhatMatchesAllValuesOfAnExclude) {
  EXPECT_EQ(points({{"srl", {"4-12", "8-24"}},
                    {"params", {{"population", {8, 16}}}},
                    {"exclude", {{{"srl", "4-12"}, {"population", 16}}}}}),
            (Texts{"independent 8 4-12 population=8", "independent 8 8-24 population=8",
                   "independent 8 8-24 population=16"}));
}

TEST_F(Sweep, ExcludesAPlainTotalWrittenAsANumber) {
  EXPECT_EQ(points({{"srl", {8, 16}}, {"exclude", {{{"srl", 16}}}}}), (Texts{"independent 8 8"}));
}

TEST_F(Sweep, RangeIsLogarithmicAndRoundsWholeNumbers) {
  EXPECT_EQ(points({{"srl", {{"from", 4}, {"to", 64}, {"steps", 5}}}}),
            (Texts{"independent 8 4", "independent 8 8", "independent 8 16", "independent 8 32",
                   "independent 8 64"}));
}

TEST_F(Sweep, RangeOfRealsKeepsTheirEnds) {
  const ExperimentConfig config = load(
      with({{"params",
             {{"beta_min", {{"from", 0.001}, {"to", 0.1}, {"steps", 3}, {"scale", "log"}}}}}}));
  const std::vector<ParamValue>& values = config.methods[1].params.at("beta_min");
  ASSERT_EQ(values.size(), 3u);
  EXPECT_DOUBLE_EQ(std::get<double>(values[0]), 0.001);
  EXPECT_NEAR(std::get<double>(values[1]), 0.01, 1e-15);
  EXPECT_DOUBLE_EQ(std::get<double>(values[2]), 0.1);
}

TEST_F(Sweep, CombinesInitialWithAdaptiveShadowRays) {
  EXPECT_EQ(
      points(
          {{"srl", {{"initial", {2, 4}}, {"adaptive", {{"from", 4}, {"to", 16}, {"steps", 2}}}}}}),
      (Texts{"independent 8 2-4", "independent 8 2-16", "independent 8 4-4",
             "independent 8 4-16"}));
}

TEST_F(Sweep, ResolvedConfigKeepsEveryAxis) {
  const json given = with({{"sampler", {"sobol", "stratified"}},
                           {"spp", {4, 8}},
                           {"srl", {"4-12", "8-24"}},
                           {"params", {{"population", {8, 16}}}},
                           {"zip", json::array({json::array({"srl", "population"})})},
                           {"exclude", {{{"sampler", "sobol"}, {"spp", 8}}}},
                           {"tags", {"wide"}}});
  const ExperimentConfig config = load(given);
  const ExperimentConfig again = load_config(write("configs/again.json", config.resolved_json));
  EXPECT_EQ(again.resolved_json, config.resolved_json);
  EXPECT_EQ(sweep_points(again, again.methods[1]).size(), 6u);
  EXPECT_EQ(again.methods[1].tags, Texts{"wide"});
}

TEST_F(Sweep, RefusesStepsThatRoundToTheSameNumber) {
  expect_fault(with({{"srl", {{"from", 4}, {"to", 6}, {"steps", 8}}}}), "/methods/1/srl",
               "8 steps are too many for whole numbers: 4 comes twice");
}

TEST_F(Sweep, RefusesALogarithmicRangeFromZero) {
  expect_fault(with({{"params", {{"beta_min", {{"from", 0}, {"to", 0.1}, {"steps", 3}}}}}}),
               "/methods/1/params/beta_min", "a logarithmic range needs");
}

TEST_F(Sweep, RefusesToZipAxesOfDifferentLength) {
  expect_fault(with({{"srl", {"4-12", "8-24"}},
                     {"params", {{"population", {8, 16, 32}}}},
                     {"zip", json::array({json::array({"srl", "population"})})}}),
               "/methods/1/zip/0",
               "axes that are zipped need equally many values: srl has 2, population has 3");
}

TEST_F(Sweep, RefusesUnknownAndRepeatedAxes) {
  expect_fault(with({{"zip", json::array({json::array({"srl", "populaton"})})}}),
               "/methods/1/zip/0/1", "unknown axis");
  expect_fault(with({{"exclude", {{{"population", 8}}}}}), "/methods/1/exclude/0/population",
               "unknown axis");
  expect_fault(
      with({{"srl", {"4-12", "8-24"}},
            {"spp", {8, 16}},
            {"sampler", {"sobol", "independent"}},
            {"zip", json::array({json::array({"srl", "spp"}), json::array({"srl", "sampler"})})}}),
      "/methods/1/zip/1/0", "axis \"srl\" is zipped twice");
}

TEST_F(Sweep, RefusesToLeaveOutEverything) {
  expect_fault(with({{"exclude", {{{"srl", "4-12"}}}}}), "/methods/1/exclude",
               "nothing is left of method \"P\"");
}

TEST_F(Sweep, RefusesSppThatABudgetSolvesFor) {
  json config = with({{"spp", 8}});
  config["budget"] = {{"time_cpu_s", 1}};
  expect_fault(config, "/methods/1/spp", "the budget solves for spp");
}

TEST_F(Sweep, BudgetsMayBeAList) {
  json config = small_config();
  config["budget"] = {{"time_cpu_s", {{"from", 0.5}, {"to", 4}, {"steps", 4}}}};
  const std::vector<double> times = load(config).budget->times;
  ASSERT_EQ(times.size(), 4u);
  EXPECT_DOUBLE_EQ(times[1], 1.0);
  EXPECT_DOUBLE_EQ(times[2], 2.0);
}

TEST_F(Sweep, ScenesMayHaveNumbersOfTheirOwn) {
  json given = with({{"srl", "4-12"}, {"srl_by_scene", {{"checkerboard", "3-5"}}}});
  given["scenes"][0]["spp"] = 16;
  const ExperimentConfig config = load(given);
  const ExperimentConfig again = load_config(write("configs/again.json", config.resolved_json));
  EXPECT_EQ(again.resolved_json, config.resolved_json);
  const std::vector<SweepPoint> points = sweep_points(again, again.methods[1], &again.scenes[0]);
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(points[0].spp, 16);
  EXPECT_EQ(points[0].srl.text(), "3-5");
  expect_fault(with({{"srl_by_scene", {{"chess", 8}}}}), "/methods/1/srl_by_scene/chess",
               "unknown scene");
  expect_fault(with({{"srl", {8, 16}}, {"srl_by_scene", {{"checkerboard", 8}}}}),
               "/methods/1/srl_by_scene", "\"srl\" is a sweep");
}

TEST_F(Sweep, BudgetMayBeTheTimeOfAMethod) {
  json given = small_config();
  given["budget"] = {{"match", "MIS"}, {"times", {0.5, 1}}, {"solve_for", "srl"}};
  given["methods"][1]["srl"] = "4-12";
  const ExperimentConfig config = load(given);
  EXPECT_EQ(config.budget->match, "MIS");
  EXPECT_EQ(config.budget->times, (std::vector<double>{0.5, 1}));
  const ExperimentConfig again = load_config(write("configs/again.json", config.resolved_json));
  EXPECT_EQ(again.resolved_json, config.resolved_json);
  given["budget"]["match"] = "MISS";
  expect_fault(given, "/budget/match", "unknown label");
  given["budget"] = {{"match", "MIS"}, {"time_cpu_s", 1}};
  expect_fault(given, "/budget", "expected either");
  given["budget"] = {{"time_cpu_s", 1}, {"times", {1, 2}}};
  expect_fault(given, "/budget/times", "\"times\" are multiples");
}

TEST_F(Sweep, OfTotalsKeepsTheirSplit) {
  EXPECT_EQ(scaled_srl({4, 12, true}, 32).text(), "8-24");
  EXPECT_EQ(scaled_srl({2, 2, true}, 10).text(), "5-5");
  EXPECT_EQ(scaled_srl({4, 12, true}, 5).text(), "2-3");
  EXPECT_EQ(scaled_srl({18, 0, false}, 5).text(), "5");
  // Something stays to adapt with.
  EXPECT_EQ(scaled_srl({8, 8, true}, 2).text(), "1-1");
  EXPECT_EQ(scaled_srl({3, 5, true}, 3).text(), "2-1");
}

TEST_F(Sweep, RefusesBudgetsThatAreNotAboveZero) {
  json config = small_config();
  config["budget"] = {{"time_cpu_s", {{"from", -1}, {"to", 1}, {"steps", 3}, {"scale", "linear"}}}};
  expect_fault(config, "/budget/time_cpu_s", "expected times above 0");
}

}  // namespace
}  // namespace penumbra
