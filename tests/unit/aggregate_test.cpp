// Means over scenes, by hand and by simulation. Seeds of simulations are the tests' names;
// coverages are compared with their nominal values at a false-alarm level of 1e-3 each
// (is_nominal).

#include "harness/aggregate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "harness/report_text.h"
#include "tests/unit/noise.h"
#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

EfficiencyRow row_of(const std::string& scene, double ratio, double se, int blocks) {
  EfficiencyRow row;
  row.scene = scene;
  row.label = "pmc";
  row.sampler = "independent";
  row.srl = row.srl_initial = 16;
  row.spp = 8;
  row.ratio = ratio;
  row.log_ratio_se = se;
  row.ratio_blocks = blocks;
  const double half_width = student_t_quantile(0.975, blocks - 1) * se;
  row.ratio_lo = ratio * std::exp(-half_width);
  row.ratio_hi = ratio * std::exp(half_width);
  return row;
}

AggregateRow one(const std::vector<EfficiencyRow>& rows) {
  const std::vector<AggregateRow> result = aggregate_over_scenes(rows, {}, options());
  EXPECT_EQ(result.size(), 1u);
  return result.empty() ? AggregateRow{} : result[0];
}

TEST(Aggregate, MeanAndIntervalsMatchHandComputation) {
  const AggregateRow row = one({row_of("a", 2, 0.1, 5), row_of("b", 8, 0.1, 5)});
  EXPECT_NEAR(row.ratio.value(), 4, 1e-12);
  // Variance of the mean (0.01 + 0.01)/4, Satterthwaite (0.02)^2 / (2 x 0.0001/4) = 8 degrees.
  const double fixed = student_t_quantile(0.975, 8) * std::sqrt(0.005);
  EXPECT_NEAR(row.fixed_hi.value(), 4 * std::exp(fixed), 1e-9);
  EXPECT_NEAR(row.fixed_lo.value(), 4 * std::exp(-fixed), 1e-9);
  // Logs differ by log 4 and so have the standard error log(2), with one degree of freedom.
  const double random = std::tan(std::acos(-1.0) * 0.475) * std::log(2.0);
  EXPECT_NEAR(std::log(row.random_hi.value()), std::log(4.0) + random, 1e-7);
  EXPECT_EQ(row.worst_scene, "a");
  EXPECT_EQ(row.worst_ratio.value(), 2);
  EXPECT_EQ(row.n_scenes, 2);
}

TEST(Aggregate, WinsTiesAndLossesFollowTheIntervals) {
  EfficiencyRow none = row_of("e", 3, 0.1, 5);
  none.ratio_lo.reset();
  none.ratio_hi.reset();
  // 1.005 with a tight interval is within 1 % of 1, and so a tie although it holds no 1.
  const AggregateRow row = one({row_of("a", 2, 0.01, 5), row_of("b", 1.005, 1e-4, 5),
                                row_of("c", 0.5, 0.01, 5), row_of("d", 1.5, 0.5, 5), none});
  EXPECT_EQ(row.wins, 1);
  EXPECT_EQ(row.ties, 2);
  EXPECT_EQ(row.losses, 1);
  EXPECT_EQ(row.undecided, 1);
}

TEST(Aggregate, SceneWithoutARatioIsCountedAndNamed) {
  EfficiencyRow missing = row_of("b", 1, 0.1, 5);
  missing.ratio.reset();
  const AggregateRow row = one({row_of("a", 2, 0.1, 5), missing});
  EXPECT_EQ(row.n_scenes, 1);
  EXPECT_EQ(row.n_missing, 1);
  EXPECT_FALSE(row.random_lo.has_value());
  EXPECT_EQ(row.note, "no ratio on b; one scene: nothing about others");
}

TEST(Aggregate, LargestBudgetOfEachSceneIsTaken) {
  std::vector<EfficiencyRow> rows{row_of("a", 2, 0.1, 5), row_of("a", 3, 0.1, 5),
                                  row_of("b", 5, 0.1, 5), row_of("b", 7, 0.1, 5)};
  rows[0].budget_s = rows[2].budget_s = 1;
  rows[1].budget_s = rows[3].budget_s = 2;
  AggregateRow row = one(rows);
  EXPECT_NEAR(row.ratio.value(), std::sqrt(21.0), 1e-12);
  EXPECT_EQ(row.budget_s.value(), 2);
  EXPECT_NE(aggregate_markdown(std::vector{row}, options()).find("at the largest budget, 2.00 s"),
            std::string::npos);
  rows[3].budget_s = 4;
  row = one(rows);
  EXPECT_FALSE(row.budget_s.has_value());
  EXPECT_EQ(row.note, "the largest budgets of the scenes differ");
}

TEST(Aggregate, SweepOfSrlMakesSeveralMethodsAndSolvingForItOne) {
  std::vector<EfficiencyRow> rows{row_of("a", 2, 0.1, 5), row_of("a", 3, 0.1, 5),
                                  row_of("b", 5, 0.1, 5), row_of("b", 7, 0.1, 5)};
  rows[1].srl = rows[1].srl_initial = rows[3].srl = rows[3].srl_initial = 32;
  EXPECT_EQ(aggregate_over_scenes(rows, {}, options()).size(), 2u);
  EXPECT_EQ(aggregate_over_scenes(rows, {}, options())[1].srl.value(), 32);
  // One SRL per scene, as a budget solves for it.
  EXPECT_NEAR(one({rows[0], rows[3]}).ratio.value(), std::sqrt(14.0), 1e-12);
}

TEST(Aggregate, TextSaysNothingOfOneSceneAndLeavesOutWhatHasNoRatio) {
  EXPECT_EQ(aggregate_markdown(std::vector{one({row_of("a", 2, 0.1, 5)})}, options()), "");
  std::vector<EfficiencyRow> rows{row_of("a", 2, 0.1, 5), row_of("b", 5, 0.1, 5),
                                  row_of("a", 2, 0.1, 5)};
  rows[2].label = "lonely";
  rows[2].ratio.reset();
  const std::string text =
      aggregate_terminal(aggregate_over_scenes(rows, {}, options()), options());
  EXPECT_EQ(text.find("lonely"), text.rfind("lonely")) << "in a note alone: " << text;
  EXPECT_NE(text.find("lonely (independent) to mis: no ratio on a"), std::string::npos) << text;
}

TEST(Aggregate, BaselineIsNotComparedWithItself) {
  EXPECT_TRUE(aggregate_over_scenes(std::vector{row_of("a", 1, 0, 5)}, {}, options("pmc")).empty());
}

TEST(Aggregate, TunedBaselineHasRowsOfItsOwn) {
  std::vector<EfficiencyRow> rows{row_of("a", 2, 0.1, 5), row_of("b", 8, 0.1, 5)};
  for (EfficiencyRow& row : rows) {
    row.ratio_tuned = *row.ratio / 4;
    row.ratio_tuned_lo = *row.ratio_lo / 4;
    row.ratio_tuned_hi = *row.ratio_hi / 4;
    row.log_ratio_tuned_se = row.log_ratio_se;
    row.ratio_tuned_blocks = row.ratio_blocks;
  }
  TableOptions o = options();
  o.tuned_baseline = "mis_tuned";
  const std::vector<AggregateRow> result = aggregate_over_scenes(rows, {}, o);
  ASSERT_EQ(result.size(), 2u);
  EXPECT_EQ(result[0].baseline, "mis");
  EXPECT_EQ(result[1].baseline, "mis_tuned");
  EXPECT_NEAR(result[1].ratio.value(), 1, 1e-12);
  EXPECT_NEAR(result[1].fixed_hi.value(), *result[0].fixed_hi / 4, 1e-12);
  EXPECT_EQ(result[1].losses, 1);
  EXPECT_NE(aggregate_terminal(result, o).find("pmc / mis_tuned"), std::string::npos);
}

/// Three scenes; pmc is 2.5, 1.25 and 0.8 times as fast as mis.
Curves three_scenes() {
  std::vector<RunRow> rows;
  const std::vector<std::pair<std::string, double>> scales{{"a", 0.4}, {"b", 0.8}, {"c", 1.25}};
  for (const auto& [scene, scale] : scales) {
    append(rows, budget_rows(scene, "mis", 1));
    append(rows, budget_rows(scene, "pmc", scale));
  }
  return error_curves(rows, options());
}

TEST(Ecdf, SharesRiseOverScenesAndTargets) {
  const std::vector<EcdfRow> rows = time_to_target_ecdf(three_scenes(), options());
  std::optional<double> last;
  int count = 0;
  for (const EcdfRow& row : rows) {
    if (row.metric != "mse" || row.label != "pmc") continue;
    ++count;
    if (row.scene == "a" && row.reach == "measured") {
      EXPECT_NEAR(row.relative_time.value(), 0.4, 0.02);
    }
    if (!row.share) continue;
    EXPECT_GE(*row.share, last.value_or(0));
    last = row.share;
  }
  EXPECT_EQ(count, 3 * kTargets);
  // c ends with 1.25 times the baseline's last error and so misses the last targets.
  EXPECT_LT(last.value(), 1);
  EXPECT_GT(last.value(), 0.8);
}

TEST(Ecdf, MethodWithAnSrlForEachSceneIsOneMethodAndASweepIsNot) {
  std::vector<RunRow> rows;
  const std::vector<std::pair<std::string, int>> srl_by_scene{{"a", 8}, {"b", 12}};
  for (const auto& [scene, srl] : srl_by_scene) {
    append(rows, budget_rows(scene, "mis", 1));
    for (RunRow row : budget_rows(scene, "pmc", scene == "a" ? 0.4 : 0.8)) {
      row.srl = row.srl_initial = srl;
      rows.push_back(row);
    }
  }
  // Shares rise along one method's rows.
  const auto methods_in = [](const std::vector<RunRow>& runs) {
    int methods = 1;
    double last = 0;
    for (const EcdfRow& row : time_to_target_ecdf(error_curves(runs, options()), options())) {
      if (row.metric != "mse" || row.label != "pmc" || !row.share) continue;
      methods += *row.share < last ? 1 : 0;
      last = *row.share;
    }
    return methods;
  };
  EXPECT_EQ(methods_in(rows), 1);
  for (RunRow row : budget_rows("a", "pmc", 0.6)) {
    row.srl = row.srl_initial = 12;
    rows.push_back(row);
  }
  EXPECT_EQ(methods_in(rows), 2) << "a sweep in one scene";
}

TEST(Ecdf, BaselineReachesItsOwnTargetsInItsOwnTime) {
  for (const EcdfRow& row : time_to_target_ecdf(three_scenes(), options())) {
    if (row.label != "mis") continue;
    EXPECT_DOUBLE_EQ(row.relative_time.value(), 1);
    EXPECT_DOUBLE_EQ(row.share.value(), 1);
    EXPECT_EQ(row.reach, "measured");
  }
}

TEST(Ecdf, NothingIsExtrapolated) {
  std::set<std::string> reaches;
  for (const EcdfRow& row : time_to_target_ecdf(three_scenes(), options())) {
    reaches.insert(row.scene + row.label + row.reach);
    if (row.reach == "at_most") {
      EXPECT_NEAR(row.time_s.value(), 1, 1e-12);
    }
    EXPECT_EQ(row.reach == "never", !row.time_s.has_value());
    EXPECT_EQ(row.share.has_value(), row.time_s.has_value());
  }
  EXPECT_EQ(reaches.count("apmcat_most"), 1u);
  EXPECT_EQ(reaches.count("cpmcnever"), 1u);
  EXPECT_EQ(reaches.count("apmcnever"), 0u);
}

TEST(Ecdf, GoesIntoTheAggregate) {
  std::vector<RunRow> rows = budget_rows("a", "mis", 1);
  append(rows, budget_rows("a", "pmc", 0.4));
  const std::vector<EcdfRow> ecdf = time_to_target_ecdf(error_curves(rows, options()), options());
  const std::vector<AggregateRow> result =
      aggregate_over_scenes(efficiency_table(rows, options()), ecdf, options());
  ASSERT_EQ(result.size(), 1u);
  EXPECT_EQ(result[0].targets, kTargets);
  EXPECT_EQ(result[0].targets_reached, kTargets);
  EXPECT_NEAR(result[0].median_relative_time.value(), 0.4, 0.02);
}

constexpr int kTrials = 2000;

TEST(StatisticalAggregate, IntervalsCoverWhatTheySay) {
  Noise noise("StatisticalAggregate.IntervalsCoverWhatTheySay");
  int fixed = 0;
  int random = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<EfficiencyRow> rows;
    double true_mean = 0;
    for (int s = 0; s < 6; ++s) {
      const double truth = 0.5 + 0.3 * noise.gaussian();  // log ratio of this scene
      true_mean += truth / 6;
      Welford blocks;
      for (int b = 0; b < 5; ++b) blocks.add(truth + 0.05 * (s + 1) * noise.gaussian());
      rows.push_back(row_of("s" + std::to_string(s), std::exp(blocks.mean()),
                            blocks.standard_error().value(), 5));
    }
    const AggregateRow row = one(rows);
    fixed += *row.fixed_lo <= std::exp(true_mean) && std::exp(true_mean) <= *row.fixed_hi;
    random += *row.random_lo <= std::exp(0.5) && std::exp(0.5) <= *row.random_hi;
  }
  EXPECT_TRUE(is_nominal(fixed, kTrials, 0.95)) << fixed;
  EXPECT_TRUE(is_nominal(random, kTrials, 0.95)) << random;
}

}  // namespace
}  // namespace penumbra
