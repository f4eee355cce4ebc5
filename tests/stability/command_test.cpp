// `penumbra stability` and `penumbra list stability` through the executable.

#include "tests/e2e/command_line_fixture.h"

namespace penumbra {
namespace {

using StabilityCommand = CommandLine;

TEST_F(StabilityCommand, OneCaseIsMeasuredPrintedAndWritten) {
  const Outcome outcome =
      run("stability --quick --case small_sphere --estimator light --out results/s");
  EXPECT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("small_sphere (L6)"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("PASS: 8 cells"), std::string::npos) << outcome.output;
  for (const char* file : {"stability.csv", "stability.json", "stability.png"}) {
    EXPECT_TRUE(fs::exists(root_ / "results" / "s" / file)) << file;
  }
}

TEST_F(StabilityCommand, UnknownNamesAreRefusedWithTheNearestOne) {
  const Outcome bad_case = run("stability --case smal_light");
  EXPECT_EQ(bad_case.code, 2);
  EXPECT_NE(bad_case.output.find("did you mean \"small_light\"?"), std::string::npos)
      << bad_case.output;
  const Outcome bad_estimator = run("stability --estimator pmchi");
  EXPECT_EQ(bad_estimator.code, 2);
  EXPECT_NE(bad_estimator.output.find("did you mean \"pmc_hi\"?"), std::string::npos)
      << bad_estimator.output;
}

TEST_F(StabilityCommand, AFolderThatCannotBeMadeIsFoundBeforeTheWork) {
  const Outcome outcome = run("stability --out /proc/nothing/here");
  EXPECT_EQ(outcome.code, 4) << outcome.output;
}

TEST_F(StabilityCommand, ListsItsCases) {
  const Outcome outcome = run("list stability --json");
  EXPECT_EQ(outcome.code, 0);
  const auto json = nlohmann::json::parse(outcome.output);
  ASSERT_GE(json["stability"].size(), 30u);
  EXPECT_EQ(json["stability"][0]["name"], "small_light");
  EXPECT_NE(run("list stability").output.find("small_light"), std::string::npos);
}

}  // namespace
}  // namespace penumbra
