#include "harness/row_log.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace penumbra {
namespace {

class RowLogTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = std::filesystem::temp_directory_path() /
            ("penumbra_row_log_" + std::to_string(::getpid()) + ".csv");
    cell_.id = "cell";
    cell_.spp = 4;
  }
  void TearDown() override { std::filesystem::remove(file_); }

  RunRow row(int attempt, const std::string& contaminated) const {
    RunRow result;
    result.run_id = run_id(cell_, 0, attempt);
    result.cell = cell_.id;
    result.attempt = attempt;
    result.contaminated = contaminated;
    return result;
  }

  std::filesystem::path file_;
  Cell cell_;
};

TEST_F(RowLogTest, CleanRunIsDone) {
  RowLog log(file_, 3);
  EXPECT_EQ(log.next_attempt(cell_, 0), 0);
  log.append(row(0, ""));
  EXPECT_EQ(log.next_attempt(cell_, 0), std::nullopt);
  EXPECT_EQ(log.next_attempt(cell_, 1), 0);
}

TEST_F(RowLogTest, DisturbedRunIsTriedAgainTwiceAndKept) {
  {
    RowLog log(file_, 3);
    log.append(row(0, "stolen"));
    EXPECT_EQ(log.next_attempt(cell_, 0), 1);
    log.append(row(1, "stolen"));
    EXPECT_EQ(log.next_attempt(cell_, 0), 2);
  }
  RowLog log(file_, 3);
  EXPECT_EQ(log.next_attempt(cell_, 0), 2);
  log.append(row(2, "stolen"));
  EXPECT_EQ(log.next_attempt(cell_, 0), std::nullopt);
  EXPECT_EQ(log.last_row(cell_, 0).attempt, 2);
  EXPECT_EQ(read_run_rows(file_).rows.size(), 3u);
}

TEST_F(RowLogTest, FailedRunIsNotTriedAgain) {
  RowLog log(file_, 3);
  RunRow failed = row(0, "stolen");
  failed.status = RunStatus::Failed;
  log.append(failed);
  EXPECT_EQ(log.next_attempt(cell_, 0), std::nullopt);
}

TEST_F(RowLogTest, OtherFrozenNumbersAreAnotherRun) {
  RowLog log(file_, 3);
  log.append(row(0, ""));
  cell_.spp = 8;
  EXPECT_EQ(log.next_attempt(cell_, 0), 0);
}

}  // namespace
}  // namespace penumbra
