// `mpirun -n K penumbra ...` through the real executable: any number of ranks gives the same bits,
// and a rank that dies takes nothing with it that was finished. Skipped where the build has no MPI
// or there is no mpirun.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "tests/e2e/spread_fixture.h"

namespace penumbra {
namespace {

using Json = nlohmann::json;

class MpiRanks : public SpreadRuns {
 protected:
  void SetUp() override {
    SpreadRuns::SetUp();
#ifndef PENUMBRA_HAS_MPI
    GTEST_SKIP() << "built without MPI (scripts/setup --mpi)";
#endif
    if (std::system("command -v mpirun >/dev/null") != 0) GTEST_SKIP() << "there is no mpirun";
    // As root, which containers are.
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  }

  /// More ranks than cores are allowed. Plugins of MPI leak, and are unloaded before a sanitizer
  /// could tell them apart from us.
  static std::string ranks(int count) {
    return R"(env ASAN_OPTIONS="$ASAN_OPTIONS:detect_leaks=0" mpirun --oversubscribe -n )" +
           std::to_string(count) + " ";
  }
  static std::string program() { return "'" PENUMBRA_EXECUTABLE "' "; }

  Outcome run_ranks(int count, const std::string& arguments) const {
    return run_shell(ranks(count) + program() + arguments);
  }

  /// The references so far, which the next call renders again.
  std::map<std::string, std::string> take_references() const {
    const auto result = pictures(root_ / "references");
    fs::remove_all(root_ / "references");
    fs::create_directory(root_ / "references");
    return result;
  }

  /// Rows that ranks have written and nobody has put together yet.
  std::vector<RunRow> rows_of_ranks(const fs::path& out) const {
    std::vector<RunRow> rows;
    if (!fs::is_directory(out)) return rows;
    for (const fs::directory_entry& entry : fs::directory_iterator(out)) {
      if (!contains(entry.path().filename().string(), "measurements.")) continue;
      for (RunRow& row : read_run_rows(entry.path()).rows) rows.push_back(std::move(row));
    }
    return rows;
  }

  std::size_t lines_of_ranks(const fs::path& out) const {
    std::size_t lines = 0;
    for (int rank = 0; rank < 4; ++rank) {
      const std::size_t own =
          line_count(out / ("measurements.rank-" + std::to_string(rank) + ".csv"));
      lines += own > 0 ? own - 1 : 0;
    }
    return lines;
  }

  /// Starts ranks in the background, and kills one of them once there are as many rows.
  /// @return how mpirun ended
  int run_and_kill_a_rank(int count, const std::string& arguments, const fs::path& out,
                          std::size_t rows) const {
    std::fflush(nullptr);
    const std::string command = "cd '" + root_.string() + "' && exec " + ranks(count) + program() +
                                arguments + " >killed.txt 2>&1";
    const pid_t launcher = fork();
    if (launcher == 0) {
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(99);
    }
    for (int i = 0; i < 12000 && lines_of_ranks(out) < rows; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    const std::string id = std::to_string(launcher);
    std::istringstream children(read_text("/proc/" + id + "/task/" + id + "/children"));
    pid_t rank = 0;
    for (pid_t child = 0; children >> child;) rank = child;
    EXPECT_GT(rank, 0) << read_text(root_ / "killed.txt");
    if (rank > 0) kill(rank, SIGKILL);
    int status = 0;
    waitpid(launcher, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
};

TEST_F(MpiRanks, AnyNumberGivesTheBitsOfOneProcess) {
  ASSERT_EQ(run("run tiny.json --out whole").code, 0);
  const auto references = take_references();
  ASSERT_EQ(references.size(), 1u);
  for (const int count : {1, 2, 3}) {
    const std::string out = "out" + std::to_string(count);
    const Outcome outcome = run_ranks(count, "run tiny.json --out " + out);
    ASSERT_EQ(outcome.code, 0) << outcome.output;
    EXPECT_TRUE(contains(outcome.output, "12 runs measured, 0 found")) << outcome.output;
    EXPECT_TRUE(take_references() == references) << count << " ranks";
    expect_same_results(root_ / out, root_ / "whole");
    EXPECT_EQ(lines_of_ranks(root_ / out), 0u) << "parts are put together";
    EXPECT_EQ(read_efficiency_rows(root_ / out / "efficiency.csv").size(), 2u);
  }
}

TEST_F(MpiRanks, EnvironmentSaysWhereEachWas) {
  ASSERT_EQ(run_ranks(3, "run tiny.json --out out").code, 0);
  const Json environment = Json::parse(read_text(root_ / "out/environment.json"));
  const Json& session = environment["sessions"].at(0);
  ASSERT_EQ(session["ranks"].size(), 3u);
  for (std::size_t r = 0; r < 3; ++r) {
    EXPECT_EQ(session["ranks"][r]["rank"], r);
    EXPECT_EQ(session["ranks"][r]["host"], session["host"]);
    EXPECT_FALSE(session["ranks"][r]["cpus"].get<std::string>().empty());
  }
  EXPECT_GE(session["threads"], 1);
  for (const RunRow& row : read_run_rows(root_ / "out/measurements.csv").rows) {
    EXPECT_EQ(row.threads, session["threads"]);
    EXPECT_EQ(row.host, session["host"]);
  }
}

TEST_F(MpiRanks, ReferencesAreExtendedAndExactOnesAreTheSame) {
  ASSERT_EQ(run("reference tiny.json").code, 0);
  ASSERT_EQ(run("reference tiny.json --add-spp 8").code, 0);
  const auto references = take_references();
  ASSERT_EQ(run_ranks(3, "reference tiny.json").code, 0);
  const Outcome more = run_ranks(2, "reference tiny.json --add-spp 8");
  ASSERT_EQ(more.code, 0) << more.output;
  EXPECT_TRUE(take_references() == references);
  EXPECT_EQ(more.output.find("24 spp"), more.output.rfind("24 spp")) << "said once";

  write_file("points.json", R"({
    "format": "penumbra-scene", "version": 1, "name": "points",
    "camera": {"position": [0, 2, 3], "look_at": [0, 0, 0], "vertical_fov_deg": 40,
               "resolution": [40, 24]},
    "materials": {"grey": {"type": "lambert", "reflectance": 0.5}},
    "shapes": [{"name": "floor", "type": "rectangle", "origin": [-2, 0, 2], "edge_u": [4, 0, 0],
                "edge_v": [0, 0, -4], "material": "grey"}],
    "point_lights": [{"name": "bulb", "position": [0.3, 1.7, 0.2], "intensity": 3}]})");
  write_file("exact.json", R"({
    "version": 1, "name": "exact", "baseline": "MIS", "spp": 4, "blocks": 2,
    "scenes": [{"name": "points", "file": "points.json", "camera_samples": 2}],
    "methods": [{"label": "MIS", "estimator": "mis", "srl": 4}]})");
  ASSERT_EQ(run("reference exact.json").code, 0);
  const auto exact = take_references();
  ASSERT_EQ(run_ranks(3, "reference exact.json").code, 0);
  EXPECT_TRUE(take_references() == exact);
}

TEST_F(MpiRanks, KilledRankLosesNothingThatWasFinished) {
  const std::string call = "run tiny.json --set blocks=60 --out ";
  ASSERT_EQ(run(call + "whole").code, 0);
  const int code = run_and_kill_a_rank(3, call + "killed", root_ / "killed", 12);
  EXPECT_NE(code, 0) << read_text(root_ / "killed.txt");
  const std::vector<RunRow> finished = rows_of_ranks(root_ / "killed");
  EXPECT_GE(finished.size(), 12u);
  EXPECT_LT(finished.size(), 120u) << "the run ended before the kill";
  const Outcome resumed = run_ranks(2, call + "killed");
  ASSERT_EQ(resumed.code, 0) << resumed.output;
  EXPECT_TRUE(contains(resumed.output, std::to_string(120 - finished.size()) + " runs measured, " +
                                           std::to_string(finished.size()) + " found"))
      << resumed.output;
  std::set<std::string> rows;
  for (const RunRow& row : read_run_rows(root_ / "killed/measurements.csv").rows) {
    rows.insert(csv_line(run_record(row)));
  }
  EXPECT_EQ(rows.size(), 120u);
  for (const RunRow& row : finished) {
    EXPECT_EQ(rows.count(csv_line(run_record(row))), 1u) << "measured again: " << row.run_id;
  }
  EXPECT_EQ(timeless_rows(root_ / "killed/measurements.csv"),
            timeless_rows(root_ / "whole/measurements.csv"));
  for (const char* name : {"images", "runs"}) {
    EXPECT_TRUE(pictures(root_ / "killed" / name) == pictures(root_ / "whole" / name)) << name;
  }
}

TEST_F(MpiRanks, RowsOfAStoppedRunAreFoundByOneProcess) {
  const std::string call = "run tiny.json --set blocks=60 --out out";
  run_and_kill_a_rank(2, call, root_ / "out", 8);
  // A kill in the middle of a write leaves half a line.
  std::ofstream(root_ / "out/measurements.rank-1.csv", std::ios::app) << "0123,checkerboard,MI";
  const std::size_t finished = rows_of_ranks(root_ / "out").size();
  const Outcome resumed = run(call);
  ASSERT_EQ(resumed.code, 0) << resumed.output;
  EXPECT_TRUE(contains(resumed.output, std::to_string(finished) + " found")) << resumed.output;
  EXPECT_EQ(timeless_rows(root_ / "out/measurements.csv").size(), 120u);
}

TEST_F(MpiRanks, FaultOfOneEndsAllAndNamesRankAndHost) {
  ASSERT_EQ(run("reference tiny.json").code, 0);
  // The second rank may write no picture.
  const std::string call = program() + "run tiny.json --out out";
  const Outcome outcome =
      run_shell(ranks(1) + call + " : -n 1 sh -c \"trap '' XFSZ; ulimit -f 2; exec " + call + "\"");
  EXPECT_EQ(outcome.code, 4) << outcome.output;
  EXPECT_TRUE(contains(outcome.output, "penumbra: error: rank 1 on host ")) << outcome.output;
  EXPECT_TRUE(contains(outcome.output, "File too large")) << outcome.output;
  const Outcome again = run_ranks(3, "run tiny.json --out out");
  EXPECT_EQ(again.code, 0) << again.output;
  EXPECT_EQ(timeless_rows(root_ / "out/measurements.csv").size(), 12u);
}

TEST_F(MpiRanks, MistakesOfTheConfigAreSaidOnce) {
  const Outcome outcome = run_ranks(3, "run tiny.json --out out --set blocks=no");
  EXPECT_EQ(outcome.code, 2) << outcome.output;
  const std::string mistake = "/blocks";
  EXPECT_NE(outcome.output.find(mistake), std::string::npos) << outcome.output;
  EXPECT_EQ(outcome.output.find(mistake), outcome.output.rfind(mistake)) << outcome.output;
}

TEST_F(MpiRanks, ShardsMayHaveRanks) {
  ASSERT_EQ(run("run tiny.json --out whole").code, 0);
  ASSERT_EQ(run_ranks(2, "run tiny.json --shard 1/2 --out s1").code, 0);
  ASSERT_EQ(run("run tiny.json --shard 2/2 --out s2").code, 0);
  const Outcome merged = run("merge s1 s2 --out merged");
  ASSERT_EQ(merged.code, 0) << merged.output;
  EXPECT_EQ(timeless_rows(root_ / "merged/measurements.csv"),
            timeless_rows(root_ / "whole/measurements.csv"));
}

}  // namespace
}  // namespace penumbra
