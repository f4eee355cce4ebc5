#include "estimators/params.h"

#include <gtest/gtest.h>

#include <limits>

namespace penumbra {
namespace {

const std::vector<ParamSpec>& specs() {
  static const std::vector<ParamSpec> table = {
      {.name = "population", .default_value = std::int64_t{8}, .doc = "", .min = 1, .max = 64},
      {.name = "floor", .default_value = 0.25, .doc = "", .min = 0.0},
      {.name = "adapt", .default_value = true, .doc = ""},
      {.name = "heuristic",
       .default_value = std::string("balance"),
       .doc = "",
       .choices = {"balance", "power2"}},
  };
  return table;
}

ParamSet resolve(const ParamSet::Map& given, std::vector<ParamProblem>& problems) {
  return resolve_params(specs(), given, problems);
}

TEST(Params, FillInDefaults) {
  std::vector<ParamProblem> problems;
  const ParamSet set = resolve({}, problems);
  EXPECT_TRUE(problems.empty());
  EXPECT_EQ(set.integer("population"), 8);
  EXPECT_EQ(set.real("floor"), 0.25);
  EXPECT_TRUE(set.boolean("adapt"));
  EXPECT_EQ(set.text("heuristic"), "balance");
}

TEST(Params, WidenAnIntegerToAReal) {
  std::vector<ParamProblem> problems;
  EXPECT_EQ(resolve({{"floor", std::int64_t{2}}}, problems).real("floor"), 2.0);
}

TEST(Params, DoNotNarrowARealToAnInteger) {
  EXPECT_EQ(check_param(specs()[0], 8.0), "expected integer, found number 8");
}

TEST(Params, DoNotTakeANumberForABoolean) {
  EXPECT_EQ(check_param(specs()[2], std::int64_t{1}), "expected boolean, found integer 1");
}

TEST(Params, StateTheRange) {
  EXPECT_EQ(check_param(specs()[0], std::int64_t{65}), "expected an integer in [1, 64], found 65");
  EXPECT_EQ(check_param(specs()[1], -0.5), "expected a number of at least 0, found -0.5");
}

TEST(Params, AcceptTheEndsOfTheRange) {
  EXPECT_EQ(check_param(specs()[0], std::int64_t{1}), "");
  EXPECT_EQ(check_param(specs()[0], std::int64_t{64}), "");
}

TEST(Params, RefuseNumbersThatAreNotFinite) {
  EXPECT_NE(check_param(specs()[1], std::numeric_limits<double>::quiet_NaN()), "");
  EXPECT_NE(check_param(specs()[1], std::numeric_limits<double>::infinity()), "");
}

TEST(Params, SuggestAChoice) {
  EXPECT_EQ(check_param(specs()[3], std::string("power")),
            "unknown value \"power\"; did you mean \"power2\"? (allowed: balance, power2)");
}

TEST(Params, ReportEveryProblem) {
  std::vector<ParamProblem> problems;
  resolve({{"popluation", std::int64_t{1}}, {"adapt", std::int64_t{1}}}, problems);
  ASSERT_EQ(problems.size(), 2u);
  EXPECT_EQ(problems[0].name, "adapt");
  EXPECT_EQ(
      problems[1].message,
      "unknown parameter \"popluation\"; did you mean \"population\"? (allowed: population, floor, "
      "adapt, heuristic)");
}

TEST(Params, ListDifferencesInTheOrderOfTheTable) {
  std::vector<ParamProblem> problems;
  const ParamSet set =
      resolve({{"heuristic", std::string("power2")}, {"floor", 0.1}, {"adapt", true}}, problems);
  EXPECT_EQ(set.differences(specs()), "floor=0.1,heuristic=power2");
}

TEST(Params, HaveNoDifferencesByDefault) {
  std::vector<ParamProblem> problems;
  EXPECT_EQ(resolve({}, problems).differences(specs()), "");
}

TEST(ParamsDeathTest, AskingForAnUndeclaredNameStopsTheProgram) {
  EXPECT_DEATH(ParamSet().integer("nothing"), "no parameter of this name");
}

}  // namespace
}  // namespace penumbra
