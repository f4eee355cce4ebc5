#include "harness/run_conditions.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace penumbra {
namespace {

TEST(RunConditions, FullCoresAreClean) {
  EXPECT_EQ(contamination({}, 1.0, 1.9, 2), "");
  EXPECT_EQ(contamination({}, 1.0, 1.0, 1), "");
}

TEST(RunConditions, WaitingForCoresIsContamination) {
  EXPECT_NE(contamination({}, 1.0, 1.6, 2), "");
  EXPECT_EQ(contamination({}, 1.0, 1.6, 2), "wall time x threads is 1.25 x CPU time");
}

TEST(RunConditions, StolenTimeIsContamination) {
  RunConditions conditions;
  conditions.steal_share = 0.05;
  EXPECT_EQ(contamination(conditions, 1.0, 2.0, 2), "5 % of the cores' time was stolen");
  conditions.steal_share = 0.01;
  EXPECT_EQ(contamination(conditions, 1.0, 2.0, 2), "");
}

TEST(RunConditions, ShortRunsAreNotJudged) { EXPECT_EQ(contamination({}, 0.1, 0.05, 2), ""); }

TEST(RunConditions, SleepingIsAVoluntarySwitch) {
  const ConditionsWatch watch;
  std::this_thread::sleep_for(std::chrono::milliseconds(2));
  const RunConditions conditions = watch.since();
  EXPECT_GE(conditions.switches_voluntary, 1);
  EXPECT_GE(conditions.switches_involuntary, 0);
  EXPECT_GE(conditions.steal_share, 0.0);
  EXPECT_LE(conditions.steal_share, 1.0);
}

}  // namespace
}  // namespace penumbra
