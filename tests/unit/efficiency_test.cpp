#include "harness/efficiency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "harness/statistics.h"
#include "harness/table_text.h"
#include "scenes/core/error.h"
#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

TEST(EfficiencyTable, MeansAndEfficienciesMatchHandComputation) {
  std::vector<RunRow> rows{run("mis", 0, 1.0, 0.2), run("mis", 1, 3.0, 0.6)};
  rows[0].instructions = 100;
  rows[1].instructions = 300;
  rows[0].p_eff = 100;
  rows[1].p_eff = 300;
  rows[0].mean_error = 0.1;
  rows[1].mean_error = 0.3;
  const EfficiencyRow row = efficiency_table(rows, options()).at(0);
  EXPECT_EQ(row.n_blocks, 2);
  EXPECT_DOUBLE_EQ(row.time_cpu_s.value(), 2.0);
  EXPECT_DOUBLE_EQ(row.time_wall_s.value(), 4.0);
  EXPECT_DOUBLE_EQ(row.err.value(), 0.4);
  EXPECT_NEAR(row.eff.value(), 1 / (4.0 * 0.4), 1e-15);
  EXPECT_DOUBLE_EQ(row.eff_cpu.value(), 1 / (2.0 * 0.4));
  EXPECT_DOUBLE_EQ(row.eff_rays.value(), 1 / (1000 * 0.4));
  EXPECT_DOUBLE_EQ(row.eff_instructions.value(), 1 / (200 * 0.4));
  EXPECT_NEAR(row.p_eff.value(), 150.0, 1e-12);  // 2/(1/100 + 1/300)
  EXPECT_NEAR(row.reference_share.value(), 0.001 / 0.4, 1e-12);
  EXPECT_DOUBLE_EQ(row.bias_rel.value(), 0.1);  // 0.2 / 2
  // {.1, .3}: standard error .1, t = 2 with one degree of freedom.
  EXPECT_NEAR(row.bias_p.value(), student_t_two_sided_p(2, 1), 1e-12);
  EXPECT_NEAR(row.bias_rel_hi.value(), 0.1 + 0.05 * student_t_quantile(0.975, 1), 1e-12);
  EXPECT_NEAR(row.bias_rel_lo.value(), 0.1 - 0.05 * student_t_quantile(0.975, 1), 1e-12);
  // Standard error of {.2, .6} is .2.
  EXPECT_NEAR(row.err_hi.value(), 0.4 + 0.2 * student_t_quantile(0.975, 1), 1e-12);
  EXPECT_NEAR(row.err_lo.value(), 0.4 - 0.2 * student_t_quantile(0.975, 1), 1e-12);
  EXPECT_EQ(row.verdict, Verdict::Baseline);
  EXPECT_EQ(row.ratio.value(), 1.0);
}

TEST(EfficiencyTable, MissingInstructionsLeaveOnlyTheirColumnEmpty) {
  const EfficiencyRow row = find(efficiency_table(two_methods(), options()), "pmc");
  EXPECT_FALSE(row.eff_instructions.has_value());
  EXPECT_TRUE(row.eff_cpu.has_value());
}

TEST(EfficiencyTable, RatioIsThatOfTheBlockJackknife) {
  const std::vector<RunRow> rows = two_methods();
  std::vector<PairedCostError> blocks;
  for (std::size_t i = 0; i < rows.size(); i += 2) {
    blocks.push_back(
        {{*rows[i].time_cpu_s, *rows[i].mse}, {*rows[i + 1].time_cpu_s, *rows[i + 1].mse}});
  }
  const LogEstimate expected = log_efficiency_ratio(blocks).log.value();
  const EfficiencyRow row = find(efficiency_table(rows, options()), "pmc");
  EXPECT_DOUBLE_EQ(row.ratio.value(), std::exp(expected.value));
  EXPECT_DOUBLE_EQ(row.ratio_lo.value(), std::exp(expected.interval->lo));
  EXPECT_DOUBLE_EQ(row.ratio_hi.value(), std::exp(expected.interval->hi));
  EXPECT_EQ(row.verdict, Verdict::Better);
  EXPECT_EQ(row.baseline, "mis");
  EXPECT_TRUE(row.note.empty()) << row.note;
}

TEST(EfficiencyTable, VerdictFollowsTheInterval) {
  EXPECT_EQ(find(efficiency_table(two_methods(), options("pmc")), "mis").verdict, Verdict::Worse);
  std::vector<RunRow> rows = two_methods();
  for (RunRow& row : rows) {
    if (row.label == "pmc") row.mse = 1.0 + 0.015 * row.block;
  }
  EXPECT_EQ(find(efficiency_table(rows, options()), "pmc").verdict, Verdict::Inconclusive);
}

TEST(EfficiencyTable, PrimaryTimeDecidesTheRatio) {
  std::vector<RunRow> rows = two_methods();
  for (RunRow& row : rows) {
    if (row.label == "pmc") row.time_wall_s = 8 * *row.time_cpu_s;
  }
  EXPECT_NEAR(find(efficiency_table(rows, options()), "pmc").ratio.value(), 2, 0.02);
  TableOptions wall = options();
  wall.primary = PrimaryTime::Wall;
  EXPECT_NEAR(find(efficiency_table(rows, wall), "pmc").ratio.value(), 0.5, 0.005);
}

TEST(EfficiencyTable, OnlyBlocksThatBothHaveEnterTheRatio) {
  std::vector<RunRow> rows = two_methods();
  const EfficiencyRow before = find(efficiency_table(rows, options()), "pmc");
  rows.push_back(run("mis", 4, 100, 100));
  const EfficiencyRow after = find(efficiency_table(rows, options()), "pmc");
  EXPECT_EQ(after.ratio, before.ratio);
  EXPECT_EQ(after.ratio_lo, before.ratio_lo);
}

TEST(EfficiencyTable, FailedOrNonFiniteRunFailsItsCellAndNoOther) {
  const std::vector<std::function<void(RunRow&)>> faults{
      [](RunRow& r) {
        r.status = RunStatus::Failed;
        r.failure = "out of memory";
      },
      [](RunRow& r) { r.nonfinite = 1; },
      [](RunRow& r) { r.mse = std::numeric_limits<double>::quiet_NaN(); },
      [](RunRow& r) { r.mse.reset(); }, [](RunRow& r) { r.time_cpu_s.reset(); }};
  for (const auto& fault : faults) {
    std::vector<RunRow> rows = two_methods();
    fault(rows[2]);  // pmc, block 1
    const std::vector<EfficiencyRow> table = efficiency_table(rows, options());
    const EfficiencyRow row = find(table, "pmc");
    EXPECT_EQ(row.verdict, Verdict::Failed);
    EXPECT_FALSE(row.err || row.eff || row.eff_cpu || row.ratio || row.time_cpu_s || row.relmse);
    EXPECT_NE(row.note.find("1 of 4 runs failed, run pmc-1"), std::string::npos) << row.note;
    EXPECT_EQ(find(table, "mis").verdict, Verdict::Baseline);
  }
}

TEST(EfficiencyTable, FailedBaselineLeavesNoRatioAndSaysWhy) {
  std::vector<RunRow> rows = two_methods();
  rows[1].status = RunStatus::Failed;
  const EfficiencyRow row = find(efficiency_table(rows, options()), "pmc");
  EXPECT_TRUE(row.eff.has_value());
  EXPECT_FALSE(row.ratio.has_value());
  EXPECT_EQ(row.verdict, Verdict::Inconclusive);
  EXPECT_NE(row.note.find("baseline mis has no efficiency"), std::string::npos) << row.note;
}

TEST(EfficiencyTable, ErrorOwedToTheReferenceIsNotMadeAnEfficiency) {
  std::vector<RunRow> rows = two_methods();
  for (RunRow& row : rows) {
    if (row.label == "pmc") row.mse_naive = 2 * *row.mse;  // share 1
  }
  const EfficiencyRow share = find(efficiency_table(rows, options()), "pmc");
  EXPECT_EQ(share.verdict, Verdict::ReferenceLimited);
  EXPECT_TRUE(share.err.has_value());
  EXPECT_FALSE(share.eff || share.eff_cpu || share.eff_rays || share.ratio);

  rows = two_methods();
  for (RunRow& row : rows) {
    if (row.label == "pmc") row.mse = -1e-6;
  }
  const EfficiencyRow below = find(efficiency_table(rows, options()), "pmc");
  EXPECT_EQ(below.verdict, Verdict::ReferenceLimited);
  EXPECT_FALSE(below.eff || below.ratio || below.reference_share);
  EXPECT_EQ(below.note, "below reference noise");
}

TEST(EfficiencyTable, ImageThatEqualsItsReferenceIsExactNotReferenceLimited) {
  // No error at all, and one that the rounding of float explains.
  for (const double mse : {0.0, 1e-13}) {
    std::vector<RunRow> rows = two_methods();
    for (RunRow& row : rows) {
      if (row.label != "mis") continue;
      row.mse = row.mse_naive = mse;
      row.mean_error = 0;
      row.p_eff.reset();
    }
    const std::vector<EfficiencyRow> table = efficiency_table(rows, options());
    const EfficiencyRow exact = find(table, "mis");
    EXPECT_EQ(exact.verdict, Verdict::Exact);
    EXPECT_EQ(exact.note, "exact: equal to the reference, nothing to compare");
    EXPECT_EQ(exact.err, mse);
    EXPECT_TRUE(exact.time_cpu_s.has_value());
    for (const auto& value : {exact.eff, exact.eff_cpu, exact.eff_rays, exact.ratio}) {
      EXPECT_FALSE(value.has_value());
    }
    EXPECT_EQ(find(table, "pmc").note, "ratio: baseline mis has no efficiency");
    EXPECT_NE(to_markdown(table, options()).find("| exact "), std::string::npos);
  }
}

TEST(EfficiencyTable, SmallErrorAboveRoundingIsNotExact) {
  std::vector<RunRow> rows = two_methods();  // the reference's mean is 2
  for (RunRow& row : rows) row.mse = row.mse_naive = 1e-10 * *row.mse;
  EXPECT_EQ(find(efficiency_table(rows, options()), "pmc").verdict, Verdict::Better);
}

TEST(EfficiencyTable, ReferenceFloorWidensTheIntervals) {
  std::vector<RunRow> rows = two_methods();
  const EfficiencyRow before = find(efficiency_table(rows, options()), "pmc");
  for (RunRow& row : rows) row.reference_floor = 0.1;
  const EfficiencyRow after = find(efficiency_table(rows, options()), "pmc");
  EXPECT_GT(*after.err_hi - *after.err_lo, *before.err_hi - *before.err_lo);
  EXPECT_GT(*after.eff_hi / *after.eff_lo, *before.eff_hi / *before.eff_lo);
  EXPECT_GT(*after.ratio_hi / *after.ratio_lo, *before.ratio_hi / *before.ratio_lo);
}

TEST(EfficiencyTable, TunedBaselineIsFoundWhateverItsSampler) {
  std::vector<RunRow> rows = two_methods();
  for (int block = 0; block < 4; ++block) {
    rows.push_back(run("mis_tuned", block, 1, 0.25 * (1 + 0.01 * block)));
    rows.back().sampler = "sobol";
  }
  TableOptions o = options();
  o.tuned_baseline = "mis_tuned";
  const std::vector<EfficiencyRow> table = efficiency_table(rows, o);
  EXPECT_NEAR(find(table, "pmc").ratio_tuned.value(), 0.5, 1e-12);
  EXPECT_EQ(find(table, "mis_tuned", "sobol").ratio_tuned.value(), 1.0);
  const EfficiencyRow tuned = find(table, "mis_tuned", "sobol");
  EXPECT_FALSE(tuned.ratio.has_value()) << "no plain baseline with this sampler";
  EXPECT_EQ(tuned.note, "ratio: 0 cells of baseline mis match");
}

TEST(EfficiencyTable, SweptBaselineIsMatchedByItsRays) {
  std::vector<RunRow> rows = two_methods();
  for (int block = 0; block < 4; ++block) {
    rows.push_back(run("mis", block, 1, 7));
    rows.back().srl = rows.back().srl_initial = 32;
  }
  EXPECT_NEAR(find(efficiency_table(rows, options()), "pmc").ratio.value(), 2, 0.02);
  for (RunRow& row : rows) {
    if (row.label == "pmc") row.srl = row.srl_initial = 8;
  }
  const EfficiencyRow row = find(efficiency_table(rows, options()), "pmc");
  EXPECT_FALSE(row.ratio.has_value());
  EXPECT_EQ(row.note, "ratio: 0 cells of baseline mis match in SRL and SPP");
}

TEST(EfficiencyTable, PublishedRatioStandsBesideTheMeasuredOne) {
  TableOptions o = options();
  o.published = {{"mis", {{"checkerboard", 50.0}, {"buddha", 3.0}}},
                 {"pmc", {{"checkerboard", 100.0}}}};
  const std::vector<EfficiencyRow> table = efficiency_table(two_methods(), o);
  // Measured: half the error at the same time.
  EXPECT_DOUBLE_EQ(find(table, "pmc").ratio_published.value(), 2.0);
  EXPECT_DOUBLE_EQ(find(table, "mis").ratio_published.value(), 1.0);
  EXPECT_TRUE(find(table, "pmc").note.empty()) << find(table, "pmc").note;
  EXPECT_TRUE(find(table, "mis").note.empty()) << find(table, "mis").note;
}

TEST(EfficiencyTable, PublishedRatioOutsideTheIntervalIsSaidInWords) {
  TableOptions o = options();
  o.published = {{"mis", {{"checkerboard", 1.0}}}, {"pmc", {{"checkerboard", 4.0}}}};
  const EfficiencyRow row = find(efficiency_table(two_methods(), o), "pmc");
  ASSERT_GT(4.0, *row.ratio_hi);
  EXPECT_EQ(row.note.find("published 4 lies outside ["), 0u) << row.note;
}

TEST(EfficiencyTable, PublishedRatioIsEmptyWhereOneFigureIsMissing) {
  TableOptions o = options();
  o.published = {{"mis", {{"buddha", 1.0}}}, {"pmc", {{"checkerboard", 4.0}}}};
  EXPECT_FALSE(find(efficiency_table(two_methods(), o), "pmc").ratio_published.has_value());
  o.published.erase("mis");
  EXPECT_FALSE(find(efficiency_table(two_methods(), o), "pmc").ratio_published.has_value());
}

TEST(EfficiencyTable, PublishedRatioNeedsNoMeasuredOne) {
  TableOptions o = options();
  o.published = {{"mis", {{"checkerboard", 1.0}}}, {"pmc", {{"checkerboard", 4.0}}}};
  const EfficiencyRow one =
      find(efficiency_table(std::vector{run("mis", 0, 1, 1), run("pmc", 0, 1, 1)}, o), "pmc");
  EXPECT_EQ(one.ratio_published, 4.0);
  EXPECT_EQ(one.note, "one block: no interval");
  std::vector<RunRow> rows = two_methods();
  for (RunRow& row : rows) row.status = RunStatus::Failed;
  EXPECT_EQ(find(efficiency_table(rows, o), "pmc").ratio_published, 4.0);
}

TEST(EfficiencyTable, OneBlockHasAnEfficiencyButNoVerdict) {
  const std::vector<RunRow> rows{run("mis", 0, 1, 1), run("pmc", 0, 1, 0.01)};
  const EfficiencyRow row = find(efficiency_table(rows, options()), "pmc");
  EXPECT_NEAR(row.ratio.value(), 100, 1e-9);
  EXPECT_FALSE(row.ratio_lo || row.eff_lo || row.err_lo || row.bias_p);
  EXPECT_EQ(row.verdict, Verdict::Inconclusive);
  EXPECT_EQ(row.note, "one block: no interval");
}

TEST(EfficiencyTable, RatiosInEveryCurrencyAreThoseOfTheJackknife) {
  std::vector<RunRow> rows = two_methods();
  for (RunRow& row : rows) {
    const std::uint64_t more = row.label == "pmc" ? 4 : 1;
    row.rays = more * (100 + static_cast<std::uint64_t>(row.block));
    row.instructions = more * 1000;
    row.time_wall_s = 3.0 * static_cast<double>(more) + 0.01 * row.block;
  }
  const EfficiencyRow row = find(efficiency_table(rows, options()), "pmc");
  const auto expected = [&](const std::function<double(const RunRow&)>& cost) {
    std::vector<PairedCostError> blocks;
    for (std::size_t i = 0; i < rows.size(); i += 2) {
      blocks.push_back({{cost(rows[i]), *rows[i].mse}, {cost(rows[i + 1]), *rows[i + 1].mse}});
    }
    return log_efficiency_ratio(blocks).log.value();
  };
  const LogEstimate wall = expected([](const RunRow& r) { return *r.time_wall_s; });
  EXPECT_DOUBLE_EQ(row.ratio_wall.value(), std::exp(wall.value));
  EXPECT_DOUBLE_EQ(row.ratio_wall_lo.value(), std::exp(wall.interval->lo));
  EXPECT_DOUBLE_EQ(row.ratio_wall_hi.value(), std::exp(wall.interval->hi));
  const LogEstimate rays = expected([](const RunRow& r) { return static_cast<double>(r.rays); });
  EXPECT_DOUBLE_EQ(row.ratio_rays.value(), std::exp(rays.value));
  EXPECT_DOUBLE_EQ(row.ratio_rays_hi.value(), std::exp(rays.interval->hi));
  const LogEstimate instructions =
      expected([](const RunRow& r) { return static_cast<double>(*r.instructions); });
  EXPECT_DOUBLE_EQ(row.ratio_instructions.value(), std::exp(instructions.value));
  EXPECT_DOUBLE_EQ(row.ratio_instructions_lo.value(), std::exp(instructions.interval->lo));
  const LogEstimate cpu = expected([](const RunRow& r) { return *r.time_cpu_s; });
  EXPECT_DOUBLE_EQ(row.log_ratio_se.value(), cpu.standard_error.value());
  EXPECT_EQ(row.ratio_blocks.value(), 4);
  EXPECT_DOUBLE_EQ(row.detectable.value(), detectable_effect(*cpu.standard_error, 4).value());
  rows[0].instructions.reset();
  EXPECT_FALSE(find(efficiency_table(rows, options()), "pmc").ratio_instructions.has_value());
  EXPECT_TRUE(find(efficiency_table(rows, options()), "pmc").note.empty());
}

TEST(EfficiencyTable, RepeatedBlockIsAnError) {
  std::vector<RunRow> rows = two_methods();
  rows.push_back(run("mis", 2, 1, 1));
  EXPECT_THROW(efficiency_table(rows, options()), InputError);
}

TEST(EfficiencyTable, TwoReferencesOfOneSceneAreAnError) {
  std::vector<RunRow> rows = two_methods();
  rows[5].reference_id = "r2";
  EXPECT_THROW(efficiency_table(rows, options()), ReferenceError);
  rows[5].scene = "buddha";
  EXPECT_NO_THROW(efficiency_table(rows, options()));
}

TEST(EfficiencyTable, OrderIsThatOfTheConfigNotOfTheRuns) {
  std::vector<RunRow> rows = two_methods();
  TableOptions o = options();
  o.labels = {"mis", "pmc"};
  const std::vector<EfficiencyRow> table = efficiency_table(rows, o);
  ASSERT_EQ(table.size(), 2u);
  EXPECT_EQ(table[0].label, "mis");
  std::reverse(rows.begin(), rows.end());
  const std::vector<EfficiencyRow> reversed = efficiency_table(rows, o);
  EXPECT_EQ(reversed, table);
  o.labels = {"pmc", "mis"};
  EXPECT_EQ(efficiency_table(rows, o)[0].label, "pmc");
}

TEST(EfficiencyTable, NoRunsAreAnEmptyTable) {
  const std::vector<EfficiencyRow> table = efficiency_table({}, options());
  EXPECT_TRUE(table.empty());
  EXPECT_FALSE(to_markdown(table, options()).empty());
  EXPECT_FALSE(to_terminal(table, options()).empty());
}

}  // namespace
}  // namespace penumbra
