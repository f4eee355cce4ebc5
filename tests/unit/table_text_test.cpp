#include "harness/table_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <sstream>
#include <string>
#include <vector>

#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

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
  EXPECT_TRUE(contains(text, "| Ref share |")) << text;
  EXPECT_TRUE(contains(text, "|    10.0 % |")) << text;
  EXPECT_TRUE(contains(text, "more than 5 %")) << text;
  EXPECT_TRUE(contains(text, "fewer than 200 effective pixels")) << text;
}

TEST(Tables, ShowPublishedRatiosWithTheirSourceWhereThereAreAny) {
  TableOptions o = options();
  o.published_source = "Anyone 2014, table 1";
  for (const bool given : {false, true}) {
    if (given) o.published = {{"mis", {{"checkerboard", 1.0}}}, {"pmc", {{"checkerboard", 2.21}}}};
    const std::vector<EfficiencyRow> rows = efficiency_table(two_methods(), o);
    for (const std::string& text : {to_markdown(rows, o), to_terminal(rows, o)}) {
      EXPECT_EQ(contains(text, "published ratio"), given) << text;
      EXPECT_EQ(contains(text, "2.21"), given) << text;
      EXPECT_EQ(contains(text, "Published ratio: Anyone 2014, table 1"), given) << text;
      EXPECT_EQ(contains(text, "published 2.21 lies outside ["), given) << text;
    }
  }
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
  rows[1].ratio_published = 2.21;
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

TEST(Terminal, CellsOfWhichTheSameIsToBeSaidShareALine) {
  std::vector<RunRow> runs = budget_rows("room", "mis", 1);
  append(runs, budget_rows("room", "pmc", 0.4));
  std::vector<EfficiencyRow> rows = efficiency_table(runs, options());
  rows[0].note = rows[2].note = "disturbed";
  rows[1].note = "alone";
  const std::string text = to_markdown(rows, options());
  EXPECT_TRUE(contains(text,
                       "- room, mis (independent, SRL 16, 1.00 s); room, mis (independent, "
                       "SRL 16, 2.00 s): disturbed.\n"))
      << text;
  EXPECT_TRUE(contains(text, "- room, pmc (independent, SRL 16, 1.00 s): alone.\n")) << text;
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
