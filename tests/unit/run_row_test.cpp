#include "harness/run_row.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "harness/metric_columns.h"
#include "harness/table_text.h"
#include "scenes/core/error.h"
#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

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
            "reference_floor, image_hash, geometry, attempt, contaminated, load_average, "
            "steal_share, switches_voluntary, switches_involuntary, relmse_trim, reference_spp, "
            "build, machine, host");
}

TEST(EfficiencyColumns, AreThoseOfTheDesignInItsOrder) {
  EXPECT_EQ(
      joined(efficiency_columns()),
      "scene, label, estimator, spp, srl, population, n_blocks, T_s, err, eff, eff_lo, "
      "eff_hi, ratio, ratio_lo, ratio_hi, eff_cpu, eff_rays, eff_instructions, bias_rel, "
      "bias_p, verdict, sampler, params, budget_s, baseline, err_lo, err_hi, relmse, p_eff, "
      "reference_share, ratio_tuned, ratio_tuned_lo, ratio_tuned_hi, T_cpu_s, srl_initial, "
      "srl_adaptive, note, ratio_published, geometry, ratio_wall, ratio_wall_lo, "
      "ratio_wall_hi, ratio_rays, ratio_rays_lo, ratio_rays_hi, ratio_instructions, "
      "ratio_instructions_lo, ratio_instructions_hi, ratio_blocks, log_ratio_se, detectable, "
      "ratio_tuned_blocks, log_ratio_tuned_se, bias_p_holm, best_of, n_contaminated, variance, "
      "bias2, p_eff_runs, bias_smallest_p, bias_tost, bias_rel_lo, bias_rel_hi");
}

TEST(RunColumns, HoldEveryMetricButTheRoot) {
  const CsvRecord columns = run_columns();
  for (const MetricInfo& metric : metric_table()) {
    const bool present = std::find(columns.begin(), columns.end(), metric.name) != columns.end();
    EXPECT_EQ(present, metric.name != "rmse") << metric.name;
  }
}

TEST(RunColumns, AreFilledFromTheTableOfMetrics) {
  const std::vector<Rgb> image{{1, 2, 3}, {4, 5, 6}};
  const std::vector<Rgb> half_a{{1, 1, 1}, {4, 4, 4}};
  const std::vector<Rgb> half_b{{0, 2, 2}, {6, 4, 6}};
  const ImageMetrics metrics = image_metrics(image, {half_a, half_b}, 0.01);
  RunRow row;
  record_metrics(metrics, row);
  const CsvRecord columns = run_columns();
  const CsvRecord record = run_record(row);
  int written = 0;
  for (const MetricInfo& metric : metric_table()) {
    const auto place = std::find(columns.begin(), columns.end(), metric.name);
    if (place == columns.end()) continue;
    const double expected = metric.value(metrics).value();
    EXPECT_EQ(record[static_cast<std::size_t>(place - columns.begin())], csv_text(expected))
        << metric.name;
    ++written;
  }
  EXPECT_EQ(written, 8);
  EXPECT_EQ(row.reference_mean, metrics.reference.mean);
  EXPECT_EQ(row.reference_mean_se, metrics.reference.mean_se);
  EXPECT_EQ(row.reference_floor, metrics.reference.floor);
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
  full.image_hash = "00ff";
  full.attempt = 1;
  full.contaminated = "steal 3 %";
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

TEST_F(TableFile, ColumnThatOlderFilesLackIsEmpty) {
  CsvRecord names = run_columns();
  CsvRecord record = run_record(run("mis", 2, 0.5, 0.25));
  const auto later = std::find(names.begin(), names.end(), "image_hash");
  ASSERT_NE(later, names.end());
  record.resize(static_cast<std::size_t>(later - names.begin()));
  names.erase(later, names.end());
  put(csv_line(names) + csv_line(record));
  EXPECT_EQ(read_run_rows(file_).rows.at(0), run("mis", 2, 0.5, 0.25));
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

}  // namespace
}  // namespace penumbra
