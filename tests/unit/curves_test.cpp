#include "harness/curves.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

#include "harness/curve_fit.h"
#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

std::vector<RunRow> two_curves() {
  std::vector<RunRow> rows = budget_rows("room", "mis", 1);
  append(rows, budget_rows("room", "pmc", 0.4));
  return rows;
}

CurveRow find(const Curves& curves, const std::string& label) {
  for (const CurveRow& row : curves.rows) {
    if (row.label == label) return row;
  }
  ADD_FAILURE() << "no curve " << label;
  return {};
}

TEST(Curves, FitsAreThoseOfTheBlocks) {
  const std::vector<RunRow> rows = two_curves();
  const Curves curves = error_curves(rows, options());
  ASSERT_EQ(curves.rows.size(), 2u);
  const CurveRow row = find(curves, "pmc");
  CurveData data;
  for (std::size_t k = 0; k < 4; ++k) {
    BudgetRuns& budget = data.budgets.emplace_back();
    for (std::size_t b = 0; b < 4; ++b) {
      budget.times_s.push_back(*rows[16 + 4 * k + b].time_cpu_s);
      budget.errors.push_back(*rows[16 + 4 * k + b].mse);
    }
  }
  const SlopeFit slope = fit_slope(data, 0.95).value();
  EXPECT_DOUBLE_EQ(row.mse.slope.value(), slope.slope.value);
  EXPECT_DOUBLE_EQ(row.mse.slope_lo.value(), slope.slope.interval->lo);
  EXPECT_DOUBLE_EQ(row.mse.slope_p.value(), slope.p_minus_1.value());
  EXPECT_NEAR(row.relmse.slope.value(), slope.slope.value, 1e-12) << "relMSE is a quarter of MSE";
  EXPECT_NEAR(row.mse.slope.value(), -1, 0.02);
  EXPECT_DOUBLE_EQ(row.mse.decay.value(), fit_floor(data, 0.95)->a);
  EXPECT_EQ(row.mse.floor.value(), fit_floor(data, 0.95)->floor);
  EXPECT_EQ(row.at_s, 8) << "the largest budget";
  EXPECT_NEAR(row.mse.at.value(), 0.05, 0.002);
  EXPECT_NEAR(row.mse.speedup.value(), 2.5, 0.1);
  EXPECT_EQ(row.n_points, 4);
  EXPECT_EQ(row.n_blocks, 4);
  EXPECT_EQ(row.srl.value(), 16);
  EXPECT_FALSE(row.spp.has_value()) << "it is what the budgets solve for";
  EXPECT_TRUE(row.note.empty()) << row.note;
  EXPECT_EQ(find(curves, "mis").mse.speedup.value(), 1);
}

TEST(Curves, OrderIsTheSlopeOverSppWhateverTheTimeWas) {
  std::vector<RunRow> rows = two_curves();
  const double order = find(error_curves(rows, options()), "pmc").mse.order.value();
  EXPECT_NEAR(order, -1, 0.02);
  for (RunRow& row : rows) row.time_cpu_s = 3 + *row.time_cpu_s;  // paid once per run
  const MetricCurve after = find(error_curves(rows, options()), "pmc").mse;
  EXPECT_EQ(after.order.value(), order);
  EXPECT_LT(after.slope.value(), -1.5) << "time is what users have, the slope says so";
  EXPECT_LT(after.order_lo.value(), -1);
  EXPECT_GT(after.order_hi.value(), -1);
  EXPECT_GT(after.order_p.value(), 0.05);
}

TEST(Curves, OrderCountsEstimatesThatAreSpreadUnevenly) {
  EXPECT_EQ(effective_spp(8, 4), 8);
  EXPECT_DOUBLE_EQ(effective_spp(3, 2), 4 / 1.5);
  EXPECT_DOUBLE_EQ(effective_spp(7, 4), 16 / (3 * 0.5 + 1));
  std::vector<RunRow> rows = two_curves();
  const std::array<int, 4> spp{3, 5, 9, 17};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    RunRow& row = rows[i];
    row.camera_samples = 2;
    row.spp = spp[i % 16 / 4];
    row.mse = 1 / effective_spp(row.spp, 2);
  }
  EXPECT_NEAR(find(error_curves(rows, options()), "pmc").mse.order.value(), -1, 1e-12);
}

TEST(Curves, OrderNeedsOneSrlAndTheCameraSamples) {
  std::vector<RunRow> rows = two_curves();
  for (RunRow& row : rows) std::swap(row.spp, row.srl);
  const MetricCurve by_srl = find(error_curves(rows, options()), "pmc").mse;
  EXPECT_TRUE(by_srl.slope.has_value());
  EXPECT_FALSE(by_srl.order || by_srl.order_lo || by_srl.order_p);
  rows = two_curves();
  rows[0].camera_samples = 0;  // "mis": a row of an early version
  EXPECT_FALSE(find(error_curves(rows, options()), "mis").mse.order.has_value());
  EXPECT_TRUE(find(error_curves(rows, options()), "pmc").mse.order.has_value());
}

TEST(Curves, PointsAreMeansByIncreasingTime) {
  std::vector<RunRow> rows = two_curves();
  std::reverse(rows.begin(), rows.end());
  const Curves curves = error_curves(rows, options());
  ASSERT_EQ(curves.points.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(curves.points[i].curve, i < 4 ? 1 : 2);
    EXPECT_DOUBLE_EQ(curves.points[i].time_s, std::pow(2.0, static_cast<double>(i % 4)));
  }
  const CurvePointRow point = curves.points[0];
  EXPECT_EQ(point.label, "mis");
  EXPECT_EQ(point.n_blocks, 4);
  EXPECT_NEAR(point.err, 1, 0.01);
  EXPECT_LT(*point.err_lo, point.err);
  EXPECT_GT(*point.relmse_hi, *point.relmse);
  EXPECT_NEAR(point.p_eff.value(), 1000, 1e-9);
}

TEST(Curves, SeveralSppWithoutBudgetsAreACurveAndOneIsNone) {
  std::vector<RunRow> rows = two_curves();
  for (RunRow& row : rows) row.budget_s.reset();
  const Curves curves = error_curves(rows, options());
  ASSERT_EQ(curves.rows.size(), 2u);
  EXPECT_EQ(find(curves, "mis").n_points, 4);
  EXPECT_EQ(find(curves, "mis").at_s, 8) << "what all curves reach";
  EXPECT_TRUE(error_curves(two_methods(), options()).rows.empty());
  EXPECT_TRUE(error_curves({}, options()).rows.empty());
}

TEST(Curves, SweepOfSrlMakesSeveralCurvesAndSolvingForItOne) {
  std::vector<RunRow> rows = budget_rows("room", "mis", 1);
  std::vector<RunRow> other = budget_rows("room", "mis", 2);
  for (RunRow& row : other) row.srl = row.srl_initial = 4;
  append(rows, other);
  const Curves swept = error_curves(rows, options());
  ASSERT_EQ(swept.rows.size(), 2u);
  EXPECT_EQ(swept.rows[0].srl.value() + swept.rows[1].srl.value(), 20);
  rows = budget_rows("room", "mis", 1);
  for (RunRow& row : rows) {
    row.srl = row.srl_initial = row.spp;
    row.spp = 8;
  }
  const Curves solved = error_curves(rows, options());
  ASSERT_EQ(solved.rows.size(), 1u);
  EXPECT_FALSE(solved.rows[0].srl.has_value());
  EXPECT_EQ(solved.rows[0].spp.value(), 8);
}

TEST(Curves, FailedBudgetIsLeftOutAndSaidSo) {
  std::vector<RunRow> rows = two_curves();
  rows[17].mse = std::numeric_limits<double>::quiet_NaN();  // pmc at its smallest budget
  const CurveRow row = find(error_curves(rows, options()), "pmc");
  EXPECT_EQ(row.n_points, 3);
  EXPECT_EQ(row.note.find("1 budgets left out, the first because 1 of 4 runs failed"), 0u)
      << row.note;
}

TEST(Curves, OnlyBlocksOfAllBudgetsEnterTheFits) {
  std::vector<RunRow> rows = two_curves();
  const CurveRow before = find(error_curves(rows, options()), "pmc");
  RunRow extra = rows[16];
  extra.block = 9;
  extra.mse = 1000;
  rows.push_back(extra);
  const CurveRow after = find(error_curves(rows, options()), "pmc");
  EXPECT_EQ(after.n_blocks, 4);
  EXPECT_EQ(after.mse, before.mse);
}

TEST(Curves, ErrorBelowReferenceNoiseHasNoSlopeAndSaysWhy) {
  std::vector<RunRow> rows = two_curves();
  for (RunRow& row : rows) {
    if (row.label == "pmc" && row.budget_s == 8) row.mse = -1e-3;
  }
  const CurveRow row = find(error_curves(rows, options()), "pmc");
  EXPECT_FALSE(row.mse.slope || row.mse.at || row.mse.speedup);
  EXPECT_TRUE(row.mse.floor.has_value()) << "a linear fit needs no logarithm";
  EXPECT_EQ(row.note, "no slope: an error is below reference noise");
}

TEST(Curves, BaselineOfAnotherSamplerIsNotComparedWith) {
  std::vector<RunRow> rows = two_curves();
  for (RunRow& row : rows) {
    if (row.label == "pmc") row.sampler = "sobol";
  }
  const CurveRow row = find(error_curves(rows, options()), "pmc");
  EXPECT_FALSE(row.mse.target || row.mse.speedup);
  EXPECT_EQ(row.note, "no single curve of baseline mis to compare with");
}

TEST(Curves, WallTimeIsTheAbscissaWhereItIsPrimary) {
  TableOptions o = options();
  o.primary = PrimaryTime::Wall;
  EXPECT_DOUBLE_EQ(find(error_curves(two_curves(), o), "pmc").time_max_s, 16);
}

}  // namespace
}  // namespace penumbra
