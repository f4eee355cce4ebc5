#include "harness/gate/gate_words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "harness/gate/gate_text.h"
#include "tests/unit/gate_fixture.h"

namespace penumbra {
namespace {

std::vector<std::string> names_worst_first(std::vector<GateCell> cells) {
  const GateResult result = gate_result(std::move(cells), GateVerdict::Fail, 1);
  std::vector<std::string> names;
  for (const GateCell* cell : worst_first(result)) names.push_back(cell->name);
  return names;
}

GateCell passing(const std::string& name, double ratio) {
  return gate_cell(name, ratio, GateVerdict::Pass, GateReason::WithinLimits);
}

GateCell failing(const std::string& name, double ratio, GateReason reason) {
  return gate_cell(name, ratio, GateVerdict::Fail, reason);
}

TEST(GateWords, OrderIsFailThenInconclusiveThenPassAndByLossWithin) {
  const std::vector<std::string> expected = {"biased", "fail 0.8", "fail 0.9", "open 0.7",
                                             "open 1", "pass 0.6", "pass 1.2"};
  EXPECT_EQ(
      names_worst_first(
          {passing("pass 1.2", 1.2), passing("pass 0.6", 0.6),
           gate_cell("open 1", 1.0, GateVerdict::Inconclusive, GateReason::TooNoisy),
           failing("fail 0.9", 0.9, GateReason::Noisier),
           failing("biased", 1.3, GateReason::Biased), failing("fail 0.8", 0.8, GateReason::Slower),
           gate_cell("open 0.7", 0.7, GateVerdict::Inconclusive, GateReason::TooNoisy)}),
      expected);
}

TEST(GateWords, AnUnknownLossComesBeforeKnownOnes) {
  GateCell not_a_number = passing("nan", 1.0);
  not_a_number.efficiency->log_ratio = std::numeric_limits<double>::quiet_NaN();
  GateCell missing = passing("missing", 1.0);
  missing.efficiency.reset();
  missing.efficiency_cpu.reset();
  const std::vector<std::string> expected = {"nan", "missing", "0.5", "0.9"};
  EXPECT_EQ(names_worst_first({passing("0.9", 0.9), not_a_number, passing("0.5", 0.5), missing}),
            expected);
}

TEST(GateWords, ALossOfTimeAloneCounts) {
  GateCell slow = passing("slow", 1.0);
  slow.efficiency_cpu = effect_of(0.7, 0.01);
  const std::vector<std::string> expected = {"slow", "other"};
  EXPECT_EQ(names_worst_first({passing("other", 0.9), slow}), expected);
}

TEST(GateWords, EqualsStayInTheOrderOfTheConfig) {
  const std::vector<std::string> expected = {"z", "a", "m"};
  EXPECT_EQ(names_worst_first({passing("z", 1), passing("a", 1), passing("m", 1)}), expected);
}

TEST(GateWords, EffectsAreChangesInPercent) {
  GateEffect effect;
  effect.log_ratio = std::log(0.95);
  effect.interval = {std::log(0.93), std::log(0.972)};
  EXPECT_EQ(effect_text(effect), "-5.00 % [-7.00, -2.80]");
  EXPECT_EQ(effect_text(std::nullopt), "-");
  EXPECT_EQ(ratio_change_text(1.041), "+4.1 %");
  EXPECT_EQ(ratio_change_text(1.0), "±0");
  EXPECT_EQ(ratio_change_text(std::nullopt), "-");
}

TEST(GateWords, CountersShowBothSides) {
  GateCell cell;
  EXPECT_EQ(counters_text(cell), "");
  cell.counters = {{"rays", 1000, 1200}, {"lit", 0, 3}};
  EXPECT_EQ(counters_text(cell), "rays 1000 -> 1200 (+20.0 %), lit 0 -> 3");
}

TEST(GateWords, CommandComparesTheSameAgain) {
  EXPECT_EQ(repeat_command(passing_result()),
            "penumbra gate --base-exe build/base/penumbra --head-exe build/head/penumbra "
            "--config configs/gate.json");
  GateResult result = stored_result();
  EXPECT_EQ(repeat_command(result),
            "penumbra gate --baseline 'baselines/quick gate' --head-exe build/head/penumbra "
            "--config configs/gate.json");
  result.base = {"results/a", "{}", ""};
  result.head = {"results/b", "{}", ""};
  EXPECT_EQ(repeat_command(result),
            "penumbra gate --base results/a --head results/b --config configs/gate.json");
}

TEST(GateWords, APlainPassNeedsNoStep) { EXPECT_TRUE(next_steps(passing_result()).empty()); }

TEST(GateWords, ALossNamesTheTrailerThatAcceptsIt) {
  const auto steps = next_steps(failing_result(GateReason::Noisier));
  ASSERT_EQ(steps.size(), 1U);
  EXPECT_NE(steps[0].find("Perf-Ack: s/B/sobol -10% <reason>"), std::string::npos) << steps[0];
}

TEST(GateWords, WrongImagesNameNoTrailer) {
  for (const GateReason reason :
       {GateReason::Biased, GateReason::NonDeterministic, GateReason::Failed}) {
    const auto steps = next_steps(failing_result(reason));
    ASSERT_EQ(steps.size(), 1U) << to_string(reason);
    EXPECT_EQ(steps[0].find("Perf-Ack"), std::string::npos) << steps[0];
  }
}

TEST(GateText, EndsWithTheVerdictAndPutsTheWorstCellFirst) {
  const std::string text = gate_text(failing_result(GateReason::Slower));
  EXPECT_NE(text.find("\nFAIL: the sentence of the gate\n"), std::string::npos);
  EXPECT_LT(text.find("s/B/sobol"), text.find("s/A/sobol"));
  EXPECT_NE(text.find("FAIL slower"), std::string::npos);
  EXPECT_NE(text.find("-9.80 % ["), std::string::npos);
  EXPECT_NE(text.find("s/B/sobol: sentence of s/B/sobol."), std::string::npos);
  EXPECT_NE(text.find("Next: "), std::string::npos);
}

TEST(GateText, FitsATerminal) {
  GateResult result = inconclusive_result();
  result.cells[0].name = std::string(100, 'n') + "/" + std::string(100, 'm');
  result.cells[0].reason = GateReason::NotRepeated;
  const std::string text = gate_text(result);
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = text.find('\n', start);
    const std::string line = text.substr(start, end - start);
    const auto characters =
        std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
    EXPECT_LE(characters, 119) << line;
    start = end + 1;
  }
}

TEST(GateText, ShowsARejectedNullControl) {
  GateResult result = inconclusive_result();
  EXPECT_EQ(gate_text(result).find("REJECTED"), std::string::npos);
  result.null_control->rejected = true;
  EXPECT_NE(gate_text(result).find("REJECTED"), std::string::npos);
}

}  // namespace
}  // namespace penumbra
