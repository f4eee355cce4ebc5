#include "harness/summary.h"

#include <gtest/gtest.h>

#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

std::vector<std::string> texts(const std::vector<Statement>& statements, StatementKind kind) {
  std::vector<std::string> result;
  for (const Statement& statement : statements) {
    if (statement.kind == kind) result.push_back(statement.text);
  }
  return result;
}

/// pmc twice as efficient as mis in the attic, half as efficient in the cellar, in 4 blocks.
std::vector<RunRow> two_scenes() {
  std::vector<RunRow> rows;
  for (const auto& [scene, error] : {std::pair("attic", 0.5), std::pair("cellar", 2.0)}) {
    for (RunRow row : two_methods()) {
      row.scene = scene;
      row.run_id += scene;
      row.reference_id = scene;
      if (row.label == "pmc") row.mse = *row.mse * 2 * error;
      rows.push_back(row);
    }
  }
  return rows;
}

TEST(Summary, SaysWhereAMethodIsMoreEfficientAndWhereLess) {
  const ReportTables tables = make_tables(two_scenes(), options());
  const auto results = texts(summarise(tables), StatementKind::Result);
  ASSERT_EQ(results.size(), 1u) << "the baseline is not compared with itself";
  EXPECT_EQ(results[0].find("pmc is more efficient than mis on attic (2.00x ["), 0u) << results[0];
  EXPECT_NE(results[0].find("; less efficient on cellar (0.50x ["), std::string::npos);
  EXPECT_NE(results[0].find("; over the 2 scenes 1.00x ["), std::string::npos) << results[0];
}

TEST(Summary, AnIntervalThatHolds1IsNotToldApart) {
  std::vector<RunRow> rows = two_methods();
  for (RunRow& row : rows) {
    if (row.label == "pmc") row.mse = *row.mse * 2;
  }
  const auto results = texts(summarise(make_tables(rows, options())), StatementKind::Result);
  ASSERT_EQ(results.size(), 1u);
  EXPECT_EQ(results[0].find("pmc is not told apart from mis on checkerboard ("), 0u) << results[0];
}

TEST(Summary, LeadersAreNamedByScene) {
  const auto leaders =
      texts(summarise(make_tables(two_scenes(), options())), StatementKind::Leader);
  ASSERT_EQ(leaders.size(), 2u);
  EXPECT_EQ(leaders[0], "On attic, pmc is the most efficient, 2.00x ahead of mis.");
  EXPECT_EQ(leaders[1], "On cellar, mis is the most efficient, 2.00x ahead of pmc.");
}

TEST(Summary, BiasedAndFailedMethodsDoNotLead) {
  std::vector<RunRow> rows = two_methods();
  append(rows, two_methods());
  for (std::size_t i = 8; i < rows.size(); ++i) {
    rows[i].label += "2";
    rows[i].run_id += "2";
  }
  for (RunRow& row : rows) {
    // A mean error that is the same in all blocks.
    if (row.label == "pmc") row.mean_error = 0.5 + 0.001 * row.block;
    if (row.label == "pmc2") row.status = RunStatus::Failed;
  }
  const auto statements = summarise(make_tables(rows, options()));
  const auto leaders = texts(statements, StatementKind::Leader);
  ASSERT_EQ(leaders.size(), 1u);
  EXPECT_EQ(leaders[0].find("pmc"), std::string::npos) << leaders[0];
  const auto cautions = texts(statements, StatementKind::Caution);
  ASSERT_GE(cautions.size(), 2u);
  EXPECT_EQ(cautions[0], "Failed, and without numbers: pmc2 on checkerboard.");
  EXPECT_EQ(cautions[1].find("Biased: pmc on checkerboard"), 0u) << cautions[1];
}

TEST(Summary, FewPixelsAreACaution) {
  std::vector<RunRow> rows = two_methods();
  EXPECT_TRUE(texts(summarise(make_tables(rows, options())), StatementKind::Caution).empty());
  for (RunRow& row : rows) row.p_eff = 10;
  const auto cautions = texts(summarise(make_tables(rows, options())), StatementKind::Caution);
  ASSERT_EQ(cautions.size(), 1u);
  EXPECT_NE(cautions[0].find("pmc on checkerboard"), std::string::npos) << cautions[0];
}

TEST(Summary, PublishedRatiosOutsideTheIntervalAreCounted) {
  TableOptions o = options();
  o.published["pmc"]["checkerboard"] = 20;
  o.published["mis"]["checkerboard"] = 2;
  o.published_source = "a paper";
  const auto cautions = texts(summarise(make_tables(two_methods(), o)), StatementKind::Caution);
  ASSERT_EQ(cautions.size(), 1u);
  EXPECT_EQ(cautions[0], "1 of 1 published ratios lie outside the measured interval (a paper).");
}

TEST(Summary, LargestBudgetStandsForAMethod) {
  std::vector<RunRow> rows = budget_rows("room", "mis", 1);
  append(rows, budget_rows("room", "pmc", 0.4));
  const ReportTables tables = make_tables(rows, options());
  const auto headline = headline_rows(tables.efficiency);
  ASSERT_EQ(headline.size(), 2u);
  for (const EfficiencyRow* row : headline) EXPECT_EQ(row->budget_s.value(), 8);
}

TEST(Summary, NothingMeasuredHasNothingToSay) {
  EXPECT_TRUE(summarise(make_tables({}, options())).empty());
}

}  // namespace
}  // namespace penumbra
