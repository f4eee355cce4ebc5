// What a cell owes to attempts and to the other cells of its table: the best of a sweep, biases.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "harness/efficiency.h"
#include "harness/table_text.h"
#include "scenes/core/error.h"
#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

TEST(EfficiencyTable, FirstCleanAttemptCountsElseTheLast) {
  std::vector<RunRow> rows = two_methods();
  const EfficiencyRow clean = find(efficiency_table(rows, options()), "pmc");
  // Block 0: disturbed, then clean; block 1: disturbed three times.
  RunRow first = rows[0];
  RunRow second = rows[0];
  first.contaminated = "steal 5 %";
  first.time_cpu_s = 100;
  second.attempt = 1;
  std::vector<RunRow> more{rows[2], rows[2], rows[2]};
  for (int attempt = 0; attempt < 3; ++attempt) {
    more[static_cast<std::size_t>(attempt)].attempt = attempt;
    more[static_cast<std::size_t>(attempt)].contaminated = "load";
    if (attempt < 2) more[static_cast<std::size_t>(attempt)].time_cpu_s = 100;
  }
  rows.erase(rows.begin() + 2);
  rows.erase(rows.begin());
  rows.push_back(second);  // whatever the order
  rows.push_back(first);
  append(rows, {more[2], more[0], more[1]});
  const EfficiencyRow row = find(efficiency_table(rows, options()), "pmc");
  EXPECT_EQ(row.ratio, clean.ratio);
  EXPECT_EQ(row.ratio_lo, clean.ratio_lo);
  EXPECT_EQ(row.n_blocks, 4);
  EXPECT_EQ(row.n_contaminated, 4);
  EXPECT_EQ(row.note, "the times of 1 of 4 blocks are contaminated in every attempt");
  const std::string text = to_markdown(std::vector{row}, options());
  EXPECT_NE(text.find("4c"), std::string::npos) << text;
  EXPECT_NE(text.find("c: some runs were disturbed by other work (4 in all)"), std::string::npos);
}

TEST(EfficiencyTable, FailureIsNotHiddenByACleanAttempt) {
  std::vector<RunRow> rows = two_methods();
  RunRow again = rows[0];
  again.attempt = 1;
  rows[0].status = RunStatus::Failed;
  rows[0].contaminated = "load";
  rows.push_back(again);
  EXPECT_EQ(find(efficiency_table(rows, options()), "pmc").verdict, Verdict::Failed);
}

TEST(EfficiencyTable, BestOfASweepIsMarkedWithItsNumberOfCells) {
  std::vector<RunRow> rows = two_methods();
  for (const int srl : {4, 8}) {
    for (int block = 0; block < 4; ++block) {
      rows.push_back(run("pmc", block, 1, srl == 8 ? 0.4 : 0.6));
      rows.back().srl = rows.back().srl_initial = srl;
    }
  }
  int marked = 0;
  const std::vector<EfficiencyRow> table = efficiency_table(rows, options());
  for (const EfficiencyRow& row : table) {
    if (!row.best_of) continue;
    ++marked;
    EXPECT_EQ(row.label, "pmc");
    EXPECT_EQ(row.srl, 8);
    EXPECT_EQ(*row.best_of, 3);
  }
  EXPECT_EQ(marked, 1);
  const std::string text = to_terminal(table, options());
  EXPECT_NE(text.find("*: the most efficient of up to 3 cells"), std::string::npos) << text;
  // Cells of other SPP without a budget are points of a curve, not a sweep to choose from.
  for (RunRow& row : rows) {
    if (row.srl != 16) row.spp = 10 * row.srl;
  }
  for (const EfficiencyRow& row : efficiency_table(rows, options())) EXPECT_FALSE(row.best_of);
}

TEST(EfficiencyTable, BiasIsAdjustedOverTheTableAndFlaggedBesideTheVerdict) {
  std::vector<RunRow> rows = two_methods();
  for (RunRow& row : rows) {
    if (row.label == "pmc") row.mean_error = 0.1 + 1e-4 * row.block;
  }
  const std::vector<EfficiencyRow> table = efficiency_table(rows, options());
  const EfficiencyRow biased = find(table, "pmc");
  EXPECT_DOUBLE_EQ(biased.bias_p_holm.value(), 2 * biased.bias_p.value());
  EXPECT_TRUE(is_biased(biased));
  EXPECT_EQ(biased.verdict, Verdict::Better);
  EXPECT_FALSE(is_biased(find(table, "mis")));
  const std::string text = to_markdown(table, options());
  EXPECT_NE(text.find("better, biased"), std::string::npos) << text;
  EXPECT_NE(text.find("after Holm over the 2 cells tested"), std::string::npos) << text;
}

}  // namespace
}  // namespace penumbra
