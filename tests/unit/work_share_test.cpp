// How work and cores are shared between processes, and rows of ranks put together.

#include "harness/work_share.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <vector>

#include "harness/rank_places.h"
#include "harness/row_parts.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

TEST(WorkShare, PartsOfPartsCoverEverythingOnce) {
  std::multiset<std::size_t> seen;
  for (int shard = 0; shard < 3; ++shard) {
    for (int rank = 0; rank < 4; ++rank) {
      const WorkShare share = WorkShare{shard, 3}.part(rank, 4);
      for (std::size_t i = 0; i < 50; ++i) {
        if (!share.has(i)) continue;
        seen.insert(i);
        EXPECT_EQ(i % 3, static_cast<std::size_t>(shard));
      }
    }
  }
  EXPECT_EQ(seen.size(), 50u);
  EXPECT_EQ(std::set<std::size_t>(seen.begin(), seen.end()).size(), 50u);
}

TEST(WorkShare, TextsAreReadOrRefused) {
  EXPECT_EQ(parse_shard("2/3"), (WorkShare{1, 3}));
  EXPECT_EQ(parse_shard("1/1"), WorkShare{});
  for (const char* text :
       {"", "x", "0/3", "4/3", "1", "1/", "/3", "1/3 ", "1/3/4", "99999999999/3"}) {
    EXPECT_THROW(parse_shard(text), InputError) << text;
  }
}

TEST(CpuShares, RanksOnTheSameCoresGetAPartEach) {
  const std::vector<CpuList> allowed(2, {0, 1, 2, 3, 8});
  const std::vector<CpuShare> shares = share_cpus(allowed);
  EXPECT_EQ(shares[0], (CpuShare{{0, 1}, 2, true}));
  EXPECT_EQ(shares[1], (CpuShare{{2, 3}, 2, true}));
}

TEST(CpuShares, BoundRanksKeepTheirs) {
  const std::vector<CpuList> allowed{{0, 1}, {2}, {3, 4, 5}};
  const std::vector<CpuShare> shares = share_cpus(allowed);
  EXPECT_EQ(shares[0], (CpuShare{{0, 1}, 2, true}));
  EXPECT_EQ(shares[1], (CpuShare{{2}, 1, true}));
  EXPECT_EQ(shares[2], (CpuShare{{3, 4, 5}, 3, true}));
}

TEST(CpuShares, TooManyRanksHaveOneThreadAndAreNotPinned) {
  const std::vector<CpuList> allowed(3, {0, 1});
  for (const CpuShare& share : share_cpus(allowed)) EXPECT_EQ(share, (CpuShare{{0, 1}, 1, false}));
}

TEST(CpuShares, SetsThatOverlapInPartAreNotPinned) {
  const std::vector<CpuList> allowed{{0, 1, 2, 3}, {2, 3}};
  for (const CpuShare& share : share_cpus(allowed)) EXPECT_FALSE(share.is_own);
}

TEST(CpuShares, TextJoinsNeighbours) {
  EXPECT_EQ(to_text({0, 1, 2, 5, 7, 8}), "0-2,5,7-8");
  EXPECT_EQ(to_text({}), "");
}

class RowParts : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("penumbra_row_parts_" + std::to_string(::getpid()));
    std::filesystem::create_directory(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static RunRow row(const std::string& id, int block, int order) {
    RunRow result;
    result.run_id = id;
    result.block = block;
    result.order = order;
    return result;
  }
  void write(const std::filesystem::path& file, const std::vector<RunRow>& rows) const {
    CsvWriter writer(file, run_columns());
    for (const RunRow& r : rows) writer.append(run_record(r));
  }
  std::vector<std::string> joined() const {
    std::vector<std::string> ids;
    for (const RunRow& r : read_run_rows(row_file(folder_)).rows) ids.push_back(r.run_id);
    return ids;
  }

  std::filesystem::path folder_;
};

TEST_F(RowParts, AreAppendedInTheOrderOfOneProcessWithoutRepeats) {
  write(row_file(folder_), {row("a", 0, 0)});
  write(row_part(folder_, 0), {row("d", 4, 0), row("a", 0, 0)});
  write(row_part(folder_, 1), {row("c", 2, 1), row("b", 2, 0)});
  std::ofstream(row_part(folder_, 1), std::ios::app) << "half a li";
  EXPECT_EQ(join_row_parts(folder_), 3u);
  EXPECT_EQ(joined(), (std::vector<std::string>{"a", "b", "c", "d"}));
  EXPECT_FALSE(std::filesystem::exists(row_part(folder_, 0)));
  EXPECT_EQ(join_row_parts(folder_), 0u);
}

TEST_F(RowParts, OfARankThatStillWritesAreLeftAlone) {
  const CsvWriter writer(row_part(folder_, 1), run_columns());
  write(row_part(folder_, 0), {row("a", 0, 0)});
  EXPECT_THROW(join_row_parts(folder_), RunError);
  EXPECT_TRUE(std::filesystem::exists(row_part(folder_, 0)));
}

}  // namespace
}  // namespace penumbra
