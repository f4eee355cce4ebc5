#include "harness/table_latex.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNasty = "a_b&c%d$e#f{g}h~i^j\\k<l>m|n\"o'p`q--r \xC3\xA9\xCE\xB1";

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// The table of two methods on a scene and under a label with every special character.
std::vector<EfficiencyRow> nasty_table() {
  std::vector<RunRow> rows = two_methods();
  std::vector<RunRow> more = two_methods();
  for (RunRow& row : more) {
    row.scene = kNasty;
    row.reference_id = "r2";
    if (row.label == "pmc") row.label = kNasty;
    row.params = "cone=always,population=8";
    row.srl_initial = 4;
    row.srl_adaptive = 12;
  }
  append(rows, more);
  return efficiency_table(rows, options());
}

TEST(Latex, EscapesEverySpecialCharacter) {
  EXPECT_EQ(latex_escaped("a_b&c%d$e#f{g}"), "a\\_b\\&c\\%d\\$e\\#f\\{g\\}");
  EXPECT_EQ(latex_escaped("\\~^"), "\\textbackslash{}\\textasciitilde{}\\textasciicircum{}");
  EXPECT_EQ(latex_escaped("4-12\n"), "4{-}12 ");
  EXPECT_EQ(latex_escaped("\xC3\xA9\xE2\x82\xAC\xF0\x9F\x98\x80"), "U+00E9U+20ACU+1F600");
  EXPECT_EQ(latex_escaped("\xC3"), "U+FFFD");
}

TEST(Latex, MacrosHaveTheNumbersOfTheTable) {
  const std::vector<EfficiencyRow> rows = efficiency_table(two_methods(), options());
  const std::string text = to_latex(rows, options());
  EXPECT_TRUE(contains(text, "\\csname penumbra@Ratio@checkerboard@pmc\\endcsname{$2.00$}"))
      << text;
  EXPECT_TRUE(contains(text, "\\csname penumbra@Verdict@checkerboard@pmc\\endcsname{better}"));
  EXPECT_TRUE(
      contains(text, "\\csname penumbra@RatioInterval@checkerboard@mis\\endcsname{$1.00$}"));
  EXPECT_TRUE(contains(text, "\\begin{tabular}")) << text;
}

TEST(Latex, LabelWithSeveralCellsIsToldApartByWhatDiffers) {
  std::vector<RunRow> rows = two_methods();
  for (int block = 0; block < 4; ++block) {
    rows.push_back(run("pmc", block, 1, 0.4));
    rows.back().params = "population=8";
    rows.push_back(run("pmc", block, 1, 0.3));
    rows.back().params = "population=8";
    rows.back().srl_initial = 4;
    rows.back().srl_adaptive = 12;
  }
  const std::string text = to_latex(efficiency_table(rows, options()), options());
  EXPECT_TRUE(contains(text, "% checkerboard@pmc\n")) << text;
  EXPECT_TRUE(contains(text, "% checkerboard@pmc/population=8/SRL16\n")) << text;
  EXPECT_TRUE(contains(text, "% checkerboard@pmc/population=8/SRL4-12\n")) << text;
  EXPECT_TRUE(contains(text, "% checkerboard@mis\n")) << text;
}

TEST(Latex, NamesThatCoincideAreNumbered) {
  std::vector<EfficiencyRow> rows = efficiency_table(two_methods(), options());
  rows[0].label = "x&y";
  rows[1].label = "x%y";
  const std::string text = to_latex(rows, options());
  EXPECT_TRUE(contains(text, "% checkerboard@x-y\n")) << text;
  EXPECT_TRUE(contains(text, "% checkerboard@x-y/2\n")) << text;
}

/// A folder of the test, removed after it.
class LatexDocument : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"pdflatex", "xelatex", "tectonic"}) {
      if (std::system(("command -v " + std::string(name) + " >/dev/null").c_str()) == 0) {
        engine_ = name;
        break;
      }
    }
    if (engine_.empty()) GTEST_SKIP() << "none of pdflatex, xelatex and tectonic is installed";
    folder_ = fs::temp_directory_path() / ("penumbra_latex_test_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// @return whether the document with that body compiles
  bool compiles(const std::string& body) const {
    std::ofstream(folder_ / "document.tex")
        << "\\documentclass{article}\n\\usepackage{booktabs}\n\\input{efficiency}\n"
        << "\\begin{document}\n"
        << body << "\n\\end{document}\n";
    const std::string mode =
        engine_ == "tectonic" ? "" : " -halt-on-error -interaction=nonstopmode";
    return std::system(("cd '" + folder_.string() + "' && " + engine_ + mode +
                        " document.tex >output.txt 2>&1")
                           .c_str()) == 0;
  }
  std::string output() const { return read_text(folder_ / "output.txt"); }

  fs::path folder_;
  std::string engine_;
};

TEST_F(LatexDocument, CompilesWithTableAndMacrosWhateverTheNames) {
  std::ofstream(folder_ / "efficiency.tex") << to_latex(nasty_table(), options());
  std::string body = "\\PenumbraTable\n\nText with ";
  for (const char* macro :
       {"Ratio", "RatioInterval", "RatioLow", "RatioHigh", "MSE", "RelMSE", "Time", "Verdict"}) {
    body += std::string("\\Penumbra") + macro + "{checkerboard}{pmc}, ";
  }
  EXPECT_TRUE(compiles(body + "\\PenumbraRatio{checkerboard}{absent}.")) << output();
  const std::string log = read_text(folder_ / "document.log") + output();
  EXPECT_TRUE(contains(log, "Penumbra has no Ratio of checkerboard, absent")) << log;
  EXPECT_FALSE(contains(log, "of checkerboard, pmc")) << log;
}

TEST_F(LatexDocument, UnescapedNameIsFoundOut) {
  std::ofstream(folder_ / "efficiency.tex") << to_latex(nasty_table(), options());
  EXPECT_FALSE(compiles(std::string("\\PenumbraTable ") + kNasty));
}

TEST_F(LatexDocument, EmptyTableCompiles) {
  std::ofstream(folder_ / "efficiency.tex") << to_latex({}, options());
  EXPECT_TRUE(compiles("\\PenumbraTable")) << output();
}

}  // namespace
}  // namespace penumbra
