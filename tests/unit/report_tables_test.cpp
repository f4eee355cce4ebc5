// The files of a report: what they hold, read back here and by other programs.

#include "harness/report_tables.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "harness/table_json.h"
#include "scenes/core/error.h"
#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kCsvFiles{"efficiency.csv", "curves.csv", "curve_points.csv",
                                         "aggregate.csv", "ecdf.csv"};

/// Two scenes, two methods, four budgets; one note with commas, quotes and a line end, one failure.
std::vector<RunRow> rows_of_a_study() {
  std::vector<RunRow> rows = budget_rows("room", "mis", 1);
  append(rows, budget_rows("room", "pmc", 0.4));
  append(rows, budget_rows("attic, \"upper\"", "mis", 1));
  append(rows, budget_rows("attic, \"upper\"", "pmc", 0.8));
  rows[17].status = RunStatus::Failed;
  rows[17].failure = "line 1, \"quoted\"\nline 2";
  return rows;
}

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

bool is_installed(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null").c_str()) == 0;
}

class ReportFiles : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    tables_ = make_tables(rows_of_a_study(), options());
    write_tables(folder_, tables_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Runs a script over every CSV file. @return whether all succeeded
  bool all_read(const std::string& command, const std::string& script) const {
    std::ofstream(folder_ / "script") << script;
    for (const std::string& name : kCsvFiles) {
      const std::string call =
          "cd '" + folder_.string() + "' && " + command + " script " + name + " >output.txt 2>&1";
      if (std::system(call.c_str()) != 0) {
        ADD_FAILURE() << name << ": " << read_text(folder_ / "output.txt");
        return false;
      }
    }
    return true;
  }

  fs::path folder_ =
      fs::temp_directory_path() / ("penumbra_report_test_" + std::to_string(::getpid()));
  ReportTables tables_;
};

TEST_F(ReportFiles, EveryTableReadsBack) {
  ASSERT_FALSE(tables_.curves.rows.empty() || tables_.aggregate.empty() || tables_.ecdf.empty());
  EXPECT_EQ(read_efficiency_rows(folder_ / "efficiency.csv"), tables_.efficiency);
  EXPECT_EQ(read_curve_rows(folder_ / "curves.csv"), tables_.curves.rows);
  EXPECT_EQ(read_curve_point_rows(folder_ / "curve_points.csv"), tables_.curves.points);
  EXPECT_EQ(read_aggregate_rows(folder_ / "aggregate.csv"), tables_.aggregate);
  EXPECT_EQ(read_ecdf_rows(folder_ / "ecdf.csv"), tables_.ecdf);
}

TEST_F(ReportFiles, AreReplacedWhenThereIsLessToSay) {
  write_tables(folder_, make_tables(two_methods(), options()));
  EXPECT_TRUE(read_curve_rows(folder_ / "curves.csv").empty());
  EXPECT_TRUE(read_ecdf_rows(folder_ / "ecdf.csv").empty());
  EXPECT_EQ(read_text(folder_ / "efficiency.md").find("Error against time"), std::string::npos);
}

TEST_F(ReportFiles, FolderThatIsNotThereIsARunError) {
  EXPECT_THROW(write_tables(folder_ / "absent", tables_), RunError);
}

TEST_F(ReportFiles, MarkdownHasAllSections) {
  const std::string text = read_text(folder_ / "efficiency.md");
  EXPECT_NE(text.find("## Over scenes"), std::string::npos) << text;
  EXPECT_NE(text.find("## Error against time"), std::string::npos) << text;
  EXPECT_NE(text.find("at the largest budget, 8.00 s,"), std::string::npos) << text;
  EXPECT_NE(text.find("-1.00 [-1.0"), std::string::npos) << "a slope with its interval: " << text;
}

TEST_F(ReportFiles, TerminalStaysBelow120Columns) {
  std::istringstream text(to_terminal(tables_));
  for (std::string line; std::getline(text, line);) EXPECT_LT(line.size(), 120u) << line;
}

TEST_F(ReportFiles, PythonReadsThemWithoutOptions) {
  if (!is_installed("python3")) GTEST_SKIP() << "python3 is not installed";
  EXPECT_TRUE(all_read("python3", R"(
import csv, sys
with open(sys.argv[1], newline="") as file:
    rows = list(csv.DictReader(file))
assert rows, "no rows"
for row in rows:
    assert None not in row and None not in row.values(), row
names = {row.get("scene", row.get("worst_scene")) for row in rows}
assert 'attic, "upper"' in names, names
)"));
}

TEST_F(ReportFiles, RReadsThemWithoutOptions) {
  if (!is_installed("Rscript")) GTEST_SKIP() << "Rscript (package r-base-core) is not installed";
  EXPECT_TRUE(all_read("Rscript", R"(
name <- commandArgs(TRUE)[1]
rows <- read.csv(name)
stopifnot(nrow(rows) > 0)
names <- if ("scene" %in% colnames(rows)) rows$scene else rows$worst_scene
stopifnot('attic, "upper"' %in% names)
numbers <- intersect(c("ratio", "err", "mse_slope", "target", "n_blocks"), colnames(rows))
stopifnot(length(numbers) > 0)
for (n in numbers) stopifnot(is.numeric(rows[[n]]))
)"));
}

TEST_F(ReportFiles, JsonHasTheColumnsUnitsAndValuesOfTheCsvFile) {
  const auto json = nlohmann::json::parse(read_text(folder_ / "efficiency.json"));
  EXPECT_EQ(json["format"], "penumbra-efficiency");
  EXPECT_EQ(json["version"], kEfficiencyJsonVersion);
  EXPECT_EQ(json["baseline"], "mis");
  EXPECT_TRUE(json["tuned_baseline"].is_null());
  const CsvRecord columns = efficiency_columns();
  ASSERT_EQ(json["columns"].size(), columns.size());
  for (std::size_t c = 0; c < columns.size(); ++c)
    EXPECT_EQ(json["columns"][c]["name"], columns[c]);
  EXPECT_EQ(json["columns"][7]["unit"], "s");
  EXPECT_TRUE(json["columns"][0]["unit"].is_null());
  ASSERT_EQ(json["rows"].size(), tables_.efficiency.size());
  for (std::size_t r = 0; r < tables_.efficiency.size(); ++r) {
    const EfficiencyRow& row = tables_.efficiency[r];
    const auto& object = json["rows"][r];
    EXPECT_EQ(object.size(), columns.size());
    EXPECT_EQ(object["scene"], row.scene);
    EXPECT_EQ(object["n_blocks"], row.n_blocks);
    EXPECT_EQ(object["err"].is_null(), !row.err.has_value());
    if (row.err) {
      EXPECT_EQ(object["err"].get<double>(), *row.err);
    }
    EXPECT_TRUE(object["population"].is_null());
  }
}

TEST(EfficiencyJson, NumberThatIsNotFiniteIsAString) {
  EfficiencyRow row;
  row.relmse = std::numeric_limits<double>::quiet_NaN();
  row.note = "12";  // text that looks like a number stays text
  const auto json = nlohmann::json::parse(to_json(std::vector{row}, options()));
  EXPECT_EQ(json["rows"][0]["relmse"], "nan");
  EXPECT_EQ(json["rows"][0]["note"], "12");
  EXPECT_TRUE(json["rows"][0]["best_of"].is_null());
}

}  // namespace
}  // namespace penumbra
