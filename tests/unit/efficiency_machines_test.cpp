// Times are compared within one machine and one host only; errors and work everywhere.

#include <gtest/gtest.h>

#include <vector>

#include "harness/efficiency.h"
#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

TEST(EfficiencyMachines, TimesOfSeveralAreNoNumbers) {
  std::vector<RunRow> rows = two_methods();
  const EfficiencyRow one = find(efficiency_table(rows, options()), "pmc");
  for (RunRow& row : rows) row.machine = row.block < 2 ? "slow" : "fast";
  const EfficiencyRow several = find(efficiency_table(rows, options()), "pmc");
  EXPECT_EQ(several.err, one.err);
  EXPECT_EQ(several.eff_rays, one.eff_rays);
  EXPECT_EQ(several.ratio_rays, one.ratio_rays);
  EXPECT_EQ(several.bias_p, one.bias_p);
  EXPECT_FALSE(several.time_wall_s || several.time_cpu_s || several.eff || several.eff_cpu);
  EXPECT_FALSE(several.ratio || several.ratio_wall || several.ratio_blocks || several.detectable);
  EXPECT_EQ(several.verdict, Verdict::Inconclusive);
  EXPECT_NE(several.note.find("several machines, \"slow\" and \"fast\""), std::string::npos)
      << several.note;
}

TEST(EfficiencyMachines, NumbersOfThreadsAreLikeMachines) {
  std::vector<RunRow> rows = two_methods();
  rows.back().threads += 1;
  for (const EfficiencyRow& row : efficiency_table(rows, options())) {
    if (row.label == rows.back().label) {
      EXPECT_FALSE(row.time_cpu_s);
    } else {
      EXPECT_TRUE(row.time_cpu_s);
      EXPECT_EQ(row.ratio.has_value(), row.label == options().baseline) << row.label;
    }
  }
}

TEST(EfficiencyMachines, BlocksOfTwoHostsAreLeftOutOfRatiosOfTimes) {
  std::vector<RunRow> rows = two_methods();
  const EfficiencyRow before = find(efficiency_table(rows, options()), "pmc");
  for (RunRow& row : rows) {
    row.host = "a";
    if (row.block == 1 && row.label == "pmc") {
      row.host = "b";
      row.time_cpu_s = *row.time_cpu_s * 50;
    }
  }
  const EfficiencyRow row = find(efficiency_table(rows, options()), "pmc");
  ASSERT_TRUE(row.ratio);
  EXPECT_EQ(*row.ratio_blocks, *before.ratio_blocks - 1);
  EXPECT_NEAR(*row.ratio / *before.ratio, 1.0, 0.5) << "the slow host takes part";
  EXPECT_EQ(row.ratio_rays, before.ratio_rays);
  EXPECT_NE(row.note.find("1 blocks left out, measured on two hosts"), std::string::npos);
}

}  // namespace
}  // namespace penumbra
