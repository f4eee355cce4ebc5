#include "harness/gate/gate_markdown.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/gate_fixture.h"

namespace penumbra {
namespace {

/// Fields of a line of a pipe table as GitHub reads them: a backslash hides any punctuation.
std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\\' && i + 1 < line.size() && std::ispunct(line[i + 1]) != 0) {
      fields.back() += line[++i];
    } else if (line[i] == '|') {
      fields.emplace_back();
    } else {
      fields.back() += line[i];
    }
  }
  for (std::string& field : fields) {
    field.erase(0, field.find_first_not_of(' '));
    field.erase(field.find_last_not_of(' ') + 1);
  }
  return fields;
}

/// The table whose first line begins so.
std::vector<std::vector<std::string>> table_after(const std::string& text,
                                                  const std::string& title) {
  std::vector<std::vector<std::string>> lines;
  std::size_t start = text.find("\n" + title) + 1;  // 0 where there is none
  while (start > 0 && start < text.size() && text[start] == '|') {
    const std::size_t end = text.find('\n', start);
    lines.push_back(fields_of(text.substr(start, end - start)));
    start = end + 1;
  }
  return lines;
}

GateResult mixed_result() {
  return gate_result(
      {unchanged_cell("s/same/sobol"),
       gate_cell("s/open/sobol", 0.97, GateVerdict::Inconclusive, GateReason::TooNoisy),
       gate_cell("s/small/sobol", 0.95, GateVerdict::Fail, GateReason::Noisier),
       gate_cell("s/large/sobol", 0.85, GateVerdict::Fail, GateReason::Slower)},
      GateVerdict::Fail, 1);
}

TEST(GateMarkdown, BeginsWithTheVerdictAndItsSentence) {
  const std::string text = gate_markdown(mixed_result());
  EXPECT_EQ(
      text.rfind("## Regression gate quick gate: FAIL\n\n**FAIL**: the sentence of the gate\n", 0),
      0U)
      << text;
}

TEST(GateMarkdown, ListsTheSuiteThenTheWorstCellFirstEachWithItsSentence) {
  const auto table = table_after(gate_markdown(mixed_result()), "| Verdict");
  ASSERT_EQ(table.size(), 7U);
  std::vector<std::string> names;
  for (std::size_t i = 2; i < table.size(); ++i) names.push_back(table[i].at(2));
  const std::vector<std::string> expected = {"all cells", "s/large/sobol", "s/small/sobol",
                                             "s/open/sobol", "s/same/sobol"};
  EXPECT_EQ(names, expected);
  EXPECT_EQ(table[3].at(1), "**FAIL**");
  EXPECT_EQ(table[3].at(4), "slower: sentence of s/large/sobol");
  EXPECT_EQ(table[5].at(4), "too_noisy: sentence of s/open/sobol");
  EXPECT_EQ(table[6].at(4), "unchanged: sentence of s/same/sobol");
}

TEST(GateMarkdown, AwkwardNamesShowAsTheyAre) {
  GateResult result = mixed_result();
  result.cells[0].name = kAwkwardName;
  result.cells[0].sentence = "error | of\n" + kAwkwardName + " \\| end\\";
  const std::string text = gate_markdown(result);
  for (const char* title : {"| Verdict", "| Cell"}) {
    const auto table = table_after(text, title);
    ASSERT_GT(table.size(), 2U);
    for (const auto& line : table) EXPECT_EQ(line.size(), table[0].size()) << title;
  }
  const auto verdicts = table_after(text, "| Verdict");
  EXPECT_EQ(verdicts.back().at(2), kAwkwardName);
  EXPECT_EQ(verdicts.back().at(4), "unchanged: error | of " + kAwkwardName + " \\| end\\");
  EXPECT_EQ(text.find("<i>"), std::string::npos);
}

TEST(GateMarkdown, FoldsTheDetailsAndClosesThem) {
  const std::string text = gate_markdown(mixed_result());
  const auto count = [&](const std::string& word) {
    std::size_t n = 0;
    for (std::size_t i = 0; (i = text.find(word, i)) != std::string::npos; ++i) ++n;
    return n;
  };
  EXPECT_EQ(count("<details><summary>"), 3U);
  EXPECT_EQ(count("\n</details>\n"), 3U);
  EXPECT_LT(text.find("\n| Verdict"), text.find("<details>"));
  EXPECT_GT(text.find("\n| Cell"), text.find("<details>"));
}

TEST(GateMarkdown, ShowsCommandNullControlAndNotes) {
  const std::string text = gate_markdown(mixed_result());
  EXPECT_NE(text.find("```\npenumbra gate --base-exe build/base/penumbra --head-exe "
                      "build/head/penumbra --config configs/gate.json\n```\n"),
            std::string::npos);
  EXPECT_NE(text.find("**Null control.** Base against itself, 16 pairs"), std::string::npos);
  EXPECT_NE(text.find("- first note\n- second note\n"), std::string::npos);
  const auto sides = table_after(text, "| Side");
  ASSERT_EQ(sides.size(), 4U);
  EXPECT_EQ(sides[2].at(3), "aaa");
  EXPECT_EQ(sides[3].at(3), "bbb");
}

TEST(GateMarkdown, StoredBaselineHasNoNullControl) {
  const std::string text = gate_markdown(stored_result());
  EXPECT_EQ(text.find("Null control"), std::string::npos);
  EXPECT_EQ(table_after(text, "| Side")[2].at(3), "-");
}

TEST(GateMarkdown, ACommandWithBackticksStaysInItsBlock) {
  GateResult result = mixed_result();
  result.config_file = "a```b.json";
  const std::string text = gate_markdown(result);
  EXPECT_NE(text.find("\n````\npenumbra gate"), std::string::npos);
  EXPECT_NE(text.find("'a```b.json'\n````\n"), std::string::npos);
}

}  // namespace
}  // namespace penumbra
