#include "harness/tables.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>

#include "harness/metrics.h"
#include "harness/statistics.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

/// A complete run; tests change what they are about.
RunRow run(const std::string& label, int block, double cpu_s, double mse) {
  RunRow row;
  row.run_id = label + "-" + std::to_string(block);
  row.scene = "checkerboard";
  row.label = label;
  row.estimator = label;
  row.sampler = "independent";
  row.spp = 8;
  row.srl = row.srl_initial = 16;
  row.block = block;
  row.rays = 1000;
  row.time_cpu_s = cpu_s;
  row.time_wall_s = 2 * cpu_s;
  row.mse = mse;
  row.mse_naive = mse + 0.001;
  row.relmse = 0.5;
  row.mean_error = block % 2 == 0 ? 0.01 : -0.01;
  row.p_eff = 1000;
  row.reference_id = "r1";
  row.reference_mean = 2;
  row.reference_mean_se = 0;
  return row;
}

/// "mis" and "pmc" in 4 blocks; pmc takes as long and errs half as much, with the same small
/// spread.
std::vector<RunRow> two_methods() {
  std::vector<RunRow> rows;
  for (int block = 0; block < 4; ++block) {
    const double spread = 1 + 0.01 * block;
    rows.push_back(run("pmc", block, 1.0, 0.5 * spread));
    rows.push_back(run("mis", block, 1.0, 1.0 * spread * (block % 2 == 0 ? 1.01 : 0.99)));
  }
  return rows;
}

TableOptions options(const std::string& baseline = "mis") {
  TableOptions o;
  o.baseline = baseline;
  return o;
}

EfficiencyRow find(const std::vector<EfficiencyRow>& rows, const std::string& label,
                   const std::string& sampler = "independent") {
  for (const EfficiencyRow& row : rows) {
    if (row.label == label && row.sampler == sampler) return row;
  }
  ADD_FAILURE() << "no row " << label;
  return {};
}

std::string joined(const CsvRecord& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

TEST(RunColumns, AreThoseOfTheDesignInItsOrder) {
  EXPECT_EQ(joined(run_columns()),
            "run_id, scene, label, estimator, sampler, spp, srl, srl_initial, srl_adaptive, "
            "population, iterations, budget_s, block, seed, width, height, threads, estimates, "
            "rays, time_wall_s, time_cpu_s, time_prepare_s, instructions, mse, mse_naive, relmse, "
            "mape, mean_error, p_eff, reference_id, reference_share, nonfinite, status, cell, "
            "params, camera_samples, samples, order, failure, reference_mean, reference_mean_se, "
            "reference_floor");
}

TEST(EfficiencyColumns, AreThoseOfTheDesignInItsOrder) {
  EXPECT_EQ(joined(efficiency_columns()),
            "scene, label, estimator, spp, srl, population, n_blocks, T_s, err, eff, eff_lo, "
            "eff_hi, ratio, ratio_lo, ratio_hi, eff_cpu, eff_rays, eff_instructions, bias_rel, "
            "bias_p, verdict, sampler, params, budget_s, baseline, err_lo, err_hi, relmse, p_eff, "
            "reference_share, ratio_tuned, ratio_tuned_lo, ratio_tuned_hi, T_cpu_s, srl_initial, "
            "srl_adaptive, note");
}

TEST(RunColumns, HoldEveryMetricButTheRoot) {
  const CsvRecord columns = run_columns();
  for (const MetricInfo& metric : metric_table()) {
    const bool present = std::find(columns.begin(), columns.end(), metric.name) != columns.end();
    EXPECT_EQ(present, metric.name != "rmse") << metric.name;
  }
}

class TableFile : public testing::Test {
 protected:
  ~TableFile() override { std::filesystem::remove(file_); }
  void put(const std::string& text) const { std::ofstream(file_, std::ios::binary) << text; }

  std::filesystem::path file_ = std::filesystem::temp_directory_path() /
                                ("penumbra_tables_test_" + std::to_string(::getpid()) + ".csv");
};

TEST_F(TableFile, EveryFieldOfARunReadsBack) {
  RunRow full = run("pmc, \"hi\"", 3, 0.1, 1e-7);
  full.srl_adaptive = 12;
  full.population = 8;
  full.iterations = 1234567890123;
  full.budget_s = 1.0 / 3.0;
  full.seed = std::numeric_limits<std::uint64_t>::max();
  full.width = 640;
  full.height = 360;
  full.threads = 2;
  full.estimates = 5;
  full.time_prepare_s = 0.5;
  full.instructions = 99;
  full.mape = 0.25;
  full.reference_share = 0.01;
  full.nonfinite = 3;
  full.status = RunStatus::Failed;
  full.cell = "c1";
  full.params = "a=1,b=2";
  full.camera_samples = 4;
  full.samples = 6;
  full.order = 7;
  full.failure = "line 1\nline 2";
  full.reference_floor = 1e-9;
  // No field of the row above has the text of an untouched one, so a swapped column cannot go
  // unnoticed.
  const std::vector<RunRow> rows{full, RunRow{}};
  {
    CsvWriter writer(file_, run_columns());
    for (const RunRow& row : rows) writer.append(run_record(row));
  }
  const RunRows back = read_run_rows(file_);
  EXPECT_FALSE(back.torn_tail);
  EXPECT_EQ(back.rows, rows);
}

TEST_F(TableFile, ColumnsAreFoundByNameNotByPlace) {
  CsvRecord names = run_columns();
  CsvRecord record = run_record(run("mis", 2, 0.5, 0.25));
  std::reverse(names.begin(), names.end());
  std::reverse(record.begin(), record.end());
  put(csv_line(names) + csv_line(record));
  EXPECT_EQ(read_run_rows(file_).rows.at(0), run("mis", 2, 0.5, 0.25));
}

TEST_F(TableFile, MissingAndUnknownColumnsAreNamed) {
  CsvRecord names = run_columns();
  names[0] = "run_idx";
  put(csv_line(names));
  try {
    read_run_rows(file_);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("missing columns: \"run_id\""), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("unknown columns: \"run_idx\""), std::string::npos);
  }
}

TEST_F(TableFile, BadValueIsNamedWithRowAndColumn) {
  CsvRecord record = run_record(run("mis", 0, 1, 1));
  record[32] = "maybe";  // status
  put(csv_line(run_columns()) + csv_line(record));
  try {
    read_run_rows(file_);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("row 1: column status: \"maybe\""), std::string::npos)
        << error.what();
  }
}

TEST_F(TableFile, EfficiencyRowsReadBack) {
  const std::vector<EfficiencyRow> rows = efficiency_table(two_methods(), options());
  put(to_csv(rows));
  EXPECT_EQ(read_efficiency_rows(file_), rows);
}

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

TEST(EfficiencyTable, OneBlockHasAnEfficiencyButNoVerdict) {
  const std::vector<RunRow> rows{run("mis", 0, 1, 1), run("pmc", 0, 1, 0.01)};
  const EfficiencyRow row = find(efficiency_table(rows, options()), "pmc");
  EXPECT_NEAR(row.ratio.value(), 100, 1e-9);
  EXPECT_FALSE(row.ratio_lo || row.eff_lo || row.err_lo || row.bias_p);
  EXPECT_EQ(row.verdict, Verdict::Inconclusive);
  EXPECT_EQ(row.note, "one block: no interval");
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

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Markdown, TableIsAlignedAndStatesItsIntervalAndEpsilon) {
  const std::string text = to_markdown(efficiency_table(two_methods(), options()), options());
  const std::vector<std::string> lines = lines_of(text);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(lines[i].size(), lines[0].size()) << lines[i];
  EXPECT_TRUE(contains(text, "95 % interval (block jackknife")) << text;
  EXPECT_TRUE(contains(text, "0.01 mean(reference)^2")) << text;
  EXPECT_FALSE(contains(text, "effective pixels")) << text;
  EXPECT_FALSE(contains(text, "more than 5 %")) << text;
}

TEST(Markdown, NumbersAreForPeople) {
  EfficiencyRow row;
  row.scene = "a|b";
  row.label = "pmc";
  row.time_cpu_s = 0.01234;
  row.err = 1.234e-7;
  row.relmse = 0.5;
  row.eff_cpu = 1234567;
  row.ratio = 1.421;
  row.ratio_lo = 1.3149;
  row.ratio_hi = 1.536;
  row.bias_rel = -0.001;
  const std::string text = to_markdown(std::vector<EfficiencyRow>{row}, options());
  for (const char* part : {"| a\\|b ", " 12.3 ms |", " 1.23e-7 |", " 0.500 |", " 1.23e6 |",
                           " 1.42 [1.31, 1.54] |", " -0.10 % |"}) {
    EXPECT_TRUE(contains(text, part)) << part << " in\n" << text;
  }
}

TEST(Markdown, DoubtfulErrorsAreMarkedAndExplained) {
  std::vector<RunRow> rows = two_methods();
  for (RunRow& row : rows) {
    row.p_eff = 17;
    row.mse_naive = 1.1 * *row.mse;
  }
  const std::string text = to_markdown(efficiency_table(rows, options()), options());
  EXPECT_TRUE(contains(text, "rp |")) << text;
  EXPECT_TRUE(contains(text, "more than 5 %")) << text;
  EXPECT_TRUE(contains(text, "fewer than 200 effective pixels")) << text;
}

TEST(Terminal, StaysBelow120ColumnsWithLongNamesAndKeepsItsNumbers) {
  std::vector<EfficiencyRow> rows = efficiency_table(two_methods(), options());
  rows[0].scene = std::string(60, 's');
  rows[1].label = "a_very_long_label_of_a_method_\xC3\xA4\xC3\xB6\xC3\xBC_with_a_distinct_end";
  rows[1].sampler = "independent";
  rows[1].err = -1.234e-10;
  rows[1].ratio = 1234;
  rows[1].ratio_lo = 1e3;
  rows[1].ratio_hi = 2e12;
  rows[1].verdict = Verdict::ReferenceLimited;
  rows[1].note = std::string(300, 'n') + " and " + std::string(100, 'm');
  const std::string text = to_terminal(rows, options());
  for (const std::string& line : lines_of(text)) {
    const auto points =
        std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
    EXPECT_LT(points, 120) << line;
  }
  EXPECT_TRUE(contains(text, "1234 [1000, 2.00e12]")) << text;
  EXPECT_TRUE(contains(text, "-1.23e-10")) << text;
  EXPECT_TRUE(contains(text, "ref-limited")) << text;
}

TEST(Terminal, ParametersAppearWhereTheyTellCellsApart) {
  std::vector<RunRow> rows = two_methods();
  for (int block = 0; block < 4; ++block) {
    rows.push_back(run("pmc", block, 1, 0.4));
    rows.back().params = "population=8";
  }
  const std::string text = to_terminal(efficiency_table(rows, options()), options());
  EXPECT_TRUE(contains(text, "pmc population=8")) << text;
}

}  // namespace
}  // namespace penumbra
