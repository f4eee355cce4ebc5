// The suite itself: its cases, its bits on any number of threads, its files, and estimators that
// are wrong on purpose, which must be found where their fault shows and nowhere else.

#include "harness/stability/stability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "harness/csv.h"
#include "harness/stability/matrix.h"
#include "tests/stability/suite_support.h"

namespace penumbra::stability {
namespace {

// The cases.

TEST(StabilityCases, NamesAreUniqueAndSweepsHaveEightStepsOrMore) {
  std::set<std::string_view> names;
  for (const StabilityCase& c : stability_cases()) {
    EXPECT_TRUE(names.insert(c.name).second) << c.name;
    EXPECT_GE(c.values.size(), 8u) << c.name;
    EXPECT_TRUE(std::set<double>(c.values.begin(), c.values.end()).size() == c.values.size())
        << c.name;
    for (const std::string_view text : {c.ids, c.summary, c.parameter, c.answer}) {
      EXPECT_FALSE(text.empty()) << c.name;
    }
  }
}

TEST(StabilityCases, EveryAnswerIsANumber) {
  for (const StabilityCase& c : stability_cases()) {
    for (const double value : {c.values.front(), c.values.back()}) {
      const StabilityStep step = c.build(value);
      for (const double exact : step.exact) {
        EXPECT_TRUE(std::isfinite(exact) && exact >= 0) << c.name << ' ' << value;
      }
      for (const ShadingPoint& point : step.points) EXPECT_TRUE(point.valid()) << c.name;
      EXPECT_LT(tolerance_of(step.condition), 0.05) << c.name << ' ' << value;
    }
  }
}

// The suite.

TEST(StabilitySuite, AnyNumberOfThreadsGivesTheSameNumbers) {
  const std::vector<const StabilityCase*> cases{case_of("visible_cone"), case_of("convex_sphere")};
  std::vector<const EstimatorEntry*> entries(all_estimators().begin(), all_estimators().end());
  const StabilityResult one = run_on(cases, entries, true, 1);
  const StabilityResult three = run_on(cases, entries, true, 3);
  ASSERT_EQ(one.rows.size(), three.rows.size());
  for (std::size_t i = 0; i < one.rows.size(); ++i) {
    const StabilityRow& a = one.rows[i];
    const StabilityRow& b = three.rows[i];
    EXPECT_EQ(a.method, b.method);
    EXPECT_EQ(a.bias, b.bias) << a.method;
    EXPECT_EQ(a.rel_variance, b.rel_variance) << a.method;
    EXPECT_EQ(a.p_adjusted, b.p_adjusted) << a.method;
    EXPECT_EQ(a.slope, b.slope) << a.method;
    EXPECT_EQ(a.verdict, b.verdict) << a.method;
  }
}

class StabilityFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "stability-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    // A dark step, one that is never seen (an infinite interval), a name with a comma.
    result_ = run_on({case_of("turned_light"), case_of("small_light")},
                     {find_estimator("mis"), find_estimator("uniform"), &kNanOnce});
    std::ofstream(folder_ / "stability.csv", std::ios::binary) << to_csv(result_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  int run(const std::string& program, const std::string& code) const {
    const std::string script = (folder_ / "script").string();
    std::ofstream(script) << code;
    return std::system(
        (program + " " + script + " " + (folder_ / "stability.csv").string()).c_str());
  }
  static bool is_installed(const std::string& program) {
    return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
  }

  std::filesystem::path folder_;
  StabilityResult result_;
};

TEST_F(StabilityFiles, CsvHasALinePerStepAndMethod) {
  const CsvTable table = read_csv(folder_ / "stability.csv");
  EXPECT_EQ(table.rows.size(), result_.rows.size());
  EXPECT_EQ(table.rows.size(), 2u * 4u * 4u);  // cases, quick steps, methods
  const std::size_t verdict = table.column("verdict").value();
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    EXPECT_EQ(table.rows[i][verdict], to_string(result_.rows[i].verdict));
  }
}

TEST_F(StabilityFiles, PythonReadsThemWithoutOptions) {
  if (!is_installed("python3")) GTEST_SKIP() << "python3 is not installed";
  EXPECT_EQ(run("python3", R"(
import csv, sys
with open(sys.argv[1], newline="") as file:
    rows = list(csv.DictReader(file))
assert len(rows) == 32, len(rows)
for row in rows:
    assert None not in row and None not in row.values(), row
    assert row["verdict"] in ("ok", "noisy", "biased", "breaks"), row
    if row["bias_hi"]: float(row["bias_hi"])
)"),
            0);
}

TEST_F(StabilityFiles, RReadsThemWithoutOptions) {
  if (!is_installed("Rscript")) GTEST_SKIP() << "Rscript (package r-base-core) is not installed";
  EXPECT_EQ(run("Rscript", R"(
rows <- read.csv(commandArgs(TRUE)[1])
stopifnot(nrow(rows) == 32)
for (n in c("bias", "bias_hi", "kurtosis", "slope", "cpu_s")) stopifnot(is.numeric(rows[[n]]))
)"),
            0);
}

TEST_F(StabilityFiles, JsonHasTheColumnsOfTheCsvFileAndTheRules) {
  const auto json = nlohmann::json::parse(to_json(result_));
  EXPECT_EQ(json["format"], "penumbra-stability");
  EXPECT_FALSE(json["passed"].get<bool>());
  EXPECT_EQ(json["rules"].size(), 4u);
  EXPECT_EQ(json["cases"].size(), 2u);
  EXPECT_EQ(json["rows"].size(), result_.rows.size());
  const CsvTable table = read_csv(folder_ / "stability.csv");
  ASSERT_EQ(json["columns"].size(), table.header.size());
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    EXPECT_EQ(json["columns"][i]["name"], table.header[i]);
  }
}

TEST_F(StabilityFiles, TextNamesWhatFailsAndThePictureIsAPng) {
  const std::string text = to_terminal(result_);
  EXPECT_NE(text.find("FAIL"), std::string::npos);
  EXPECT_NE(text.find("small_light at 1, nan once: breaks, 1 estimates are not finite"),
            std::string::npos)
      << text;
  write_matrix_picture(folder_ / "matrix.png", result_);
  std::ifstream file(folder_ / "matrix.png", std::ios::binary);
  std::string head(4, ' ');
  file.read(head.data(), 4);
  EXPECT_EQ(head, "\x89PNG");
}

}  // namespace
}  // namespace penumbra::stability
