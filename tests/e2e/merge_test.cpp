// Shards and their merging through the real executable: what is put together equals a single run,
// and what does not belong together is refused.

#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "tests/e2e/spread_fixture.h"

namespace penumbra {
namespace {

using Json = nlohmann::json;

class Merge : public SpreadRuns {
 protected:
  /// Runs the shards of the tiny config into s1, s2, ...
  void run_shards(int count, const std::string& more = "") const {
    for (int i = 1; i <= count; ++i) {
      const std::string number = std::to_string(i);
      const Outcome outcome = run("run tiny.json --shard " + number + "/" + std::to_string(count) +
                                  " --out s" + number + " " + more);
      ASSERT_EQ(outcome.code, 0) << outcome.output;
    }
  }

  void change_rows(const std::string& folder, const std::function<void(RunRow&)>& change) const {
    const fs::path file = root_ / folder / "measurements.csv";
    std::string text = csv_line(run_columns());
    for (RunRow& row : read_run_rows(file).rows) {
      change(row);
      text += csv_line(run_record(row));
    }
    write_file(folder + "/measurements.csv", text);
  }

  void change_json(const std::string& file, const std::function<void(Json&)>& change) const {
    Json json = Json::parse(read_text(root_ / file));
    change(json);
    write_file(file, json.dump(2));
  }

  /// Expects that s1 and s2 are refused with code 5 for a reason, and leave nothing behind.
  void expect_refused(const std::string& reason) const {
    const Outcome outcome = run("merge s1 s2 --out merged");
    EXPECT_EQ(outcome.code, 5) << outcome.output;
    EXPECT_TRUE(contains(outcome.output, "s1 and s2 cannot be merged: ")) << outcome.output;
    EXPECT_TRUE(contains(outcome.output, reason)) << outcome.output;
    for (const fs::directory_entry& entry : fs::directory_iterator(root_)) {
      EXPECT_FALSE(contains(entry.path().filename().string(), "merged")) << entry.path();
    }
  }
};

TEST_F(Merge, ThreeShardsEqualTheUnshardedRun) {
  ASSERT_EQ(run("run tiny.json --out whole").code, 0);
  run_shards(3);
  EXPECT_EQ(read_run_rows(root_ / "s1/measurements.csv").rows.size(), 4u);
  for (const RunRow& row : read_run_rows(root_ / "s2/measurements.csv").rows) {
    EXPECT_EQ(row.block / 2, 1);
  }
  const Outcome merged = run("merge s3 s1 s2 --out merged");
  ASSERT_EQ(merged.code, 0) << merged.output;
  expect_same_results(root_ / "merged", root_ / "whole");
  const auto table = read_efficiency_rows(root_ / "merged/efficiency.csv");
  const auto expected = read_efficiency_rows(root_ / "whole/efficiency.csv");
  ASSERT_EQ(table.size(), expected.size());
  for (std::size_t i = 0; i < table.size(); ++i) {
    EXPECT_EQ(table[i].err, expected[i].err);
    EXPECT_EQ(table[i].eff_rays, expected[i].eff_rays);
    EXPECT_EQ(table[i].ratio_rays_lo, expected[i].ratio_rays_lo);
    EXPECT_EQ(table[i].variance, expected[i].variance);
    EXPECT_TRUE(table[i].ratio) << "one machine: times can be compared";
  }
  EXPECT_TRUE(fs::exists(root_ / "merged/report.html"));
  const Outcome again = run("run tiny.json --out merged");
  EXPECT_TRUE(contains(again.output, "0 runs measured, 12 found")) << again.output;
}

TEST_F(Merge, EnvironmentHasTheSessionsOfAllShards) {
  run_shards(2);
  ASSERT_EQ(run("merge s1 s2 --out merged").code, 0);
  const Json environment = Json::parse(read_text(root_ / "merged/environment.json"));
  ASSERT_EQ(environment["sessions"].size(), 3u);
  EXPECT_EQ(environment["sessions"][0]["shard"], "1/2");
  EXPECT_EQ(environment["sessions"][1]["shard"], "2/2");
  const std::vector<RunRow> rows = read_run_rows(root_ / "merged/measurements.csv").rows;
  EXPECT_TRUE(environment["machines"].contains(rows.at(0).machine)) << environment["machines"];
  EXPECT_TRUE(environment["builds"].contains(rows.at(0).build));
}

TEST_F(Merge, ShardTextsWithoutMeaningAreUsageErrors) {
  for (const char* text : {"0/3", "4/3", "x", "1/", "/3", "1/3x", "-1/3", "1/0"}) {
    const Outcome outcome = run("run tiny.json --out out --shard=" + std::string(text));
    EXPECT_EQ(outcome.code, 2) << text << ": " << outcome.output;
    EXPECT_TRUE(contains(outcome.output, "1 <= I <= N")) << text << ": " << outcome.output;
  }
  EXPECT_FALSE(fs::exists(root_ / "out"));
}

TEST_F(Merge, MissingShardIsNamedByItsBlocksAndAllowedOnlyWhenAskedFor) {
  run_shards(3);
  const Outcome missing = run("merge s1 s3 --out merged");
  EXPECT_EQ(missing.code, 5) << missing.output;
  EXPECT_TRUE(contains(missing.output, "blocks 2, 3: 2 of 2 runs")) << missing.output;
  EXPECT_FALSE(fs::exists(root_ / "merged"));
  const Outcome partial = run("merge s1 s3 --partial --out merged");
  EXPECT_EQ(partial.code, 0) << partial.output;
  EXPECT_TRUE(contains(partial.output, "blocks 2, 3: 2 of 2 runs")) << partial.output;
  EXPECT_EQ(read_efficiency_rows(root_ / "merged/efficiency.csv").at(0).n_blocks, 4);
}

TEST_F(Merge, OtherBuildsConfigsPlansAndReferencesAreRefused) {
  run_shards(2);
  const fs::path kept = root_ / "kept";
  fs::copy(root_ / "s2", kept, fs::copy_options::recursive);
  const auto restore = [&] {
    fs::remove_all(root_ / "s2");
    fs::copy(kept, root_ / "s2", fs::copy_options::recursive);
  };
  change_rows("s2", [](RunRow& row) { row.build = "0123456789abcdef"; });
  expect_refused("rows are of builds");
  restore();
  change_json("s2/config.resolved.json", [](Json& config) { config["blocks"] = 7; });
  expect_refused("their configs differ: /blocks is 6 and 7");
  restore();
  change_json("s2/plan.lock.json", [](Json& plan) { plan["cells"][1]["spp"] = 3; });
  expect_refused("their plans differ: /cells/1/spp is 2 and 3");
  restore();
  change_rows("s2", [](RunRow& row) { row.reference_id = "0123456789abcdef"; });
  expect_refused("scene \"checkerboard\" has the references");
  restore();
  change_rows("s2", [](RunRow& row) { row.reference_spp = 32; });
  expect_refused("scene \"checkerboard\" has the references");
  restore();
  EXPECT_EQ(run("merge s1 s2 --out merged").code, 0);
  EXPECT_EQ(run("merge s1 s2 --out merged").code, 2) << "the folder exists";
}

TEST_F(Merge, RunsThatSeveralShardsHaveMustBeTheSame) {
  run_shards(2);
  fs::copy(root_ / "s1", root_ / "copy", fs::copy_options::recursive);
  change_rows("copy", [](RunRow& row) { *row.time_cpu_s += 1; });
  EXPECT_EQ(run("merge s1 s2 copy --out merged").code, 0);
  fs::remove_all(root_ / "merged");
  change_rows("copy", [](RunRow& row) {
    if (row.block == 1) *row.mse *= 2;
  });
  const Outcome outcome = run("merge s1 s2 copy --out merged");
  EXPECT_EQ(outcome.code, 5) << outcome.output;
  EXPECT_TRUE(contains(outcome.output, "differs: mse is ")) << outcome.output;
}

TEST_F(Merge, SeveralMachinesLeaveErrorsAndNoTimes) {
  run_shards(2);
  change_rows("s2", [](RunRow& row) { row.machine = "another"; });
  const Outcome outcome = run("merge s1 s2 --out merged");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_TRUE(contains(outcome.output, "no times: measured on")) << outcome.output;
  for (const EfficiencyRow& row : read_efficiency_rows(root_ / "merged/efficiency.csv")) {
    EXPECT_TRUE(row.err && row.eff_rays && row.relmse && row.ratio_rays) << row.label;
    EXPECT_FALSE(row.time_wall_s || row.time_cpu_s || row.eff || row.eff_lo || row.eff_cpu)
        << row.label;
    EXPECT_FALSE(row.ratio || row.ratio_lo || row.ratio_wall || row.log_ratio_se) << row.label;
    EXPECT_TRUE(contains(row.note, "\"another\"")) << row.note;
  }
}

class MergeBudget : public Merge {
 protected:
  const std::string budget_ = "--set 'budget={\"time_cpu_s\":0.05,\"pilots\":1}' --set blocks=4";
};

TEST_F(MergeBudget, ShardsNeedOnePlan) {
  const Outcome without = run("run tiny.json --shard 1/2 --out s1 " + budget_);
  EXPECT_EQ(without.code, 5) << without.output;
  EXPECT_TRUE(contains(without.output, "penumbra plan tiny.json --lock plan.lock.json"))
      << without.output;
  EXPECT_FALSE(fs::exists(root_ / "s1/measurements.csv"));
  const Outcome plan = run("plan tiny.json --lock frozen.json --hosts 2 " + budget_);
  ASSERT_EQ(plan.code, 0) << plan.output;
  EXPECT_TRUE(contains(plan.output, "on 2 hosts (--shard)")) << plan.output;
  run_shards(2, "--plan frozen.json " + budget_);
  EXPECT_EQ(read_text(root_ / "s2/plan.lock.json"), read_text(root_ / "frozen.json"));
  const Outcome merged = run("merge s1 s2 --out merged");
  EXPECT_EQ(merged.code, 0) << merged.output;
  EXPECT_TRUE(read_efficiency_rows(root_ / "merged/efficiency.csv").at(1).time_cpu_s);

  fs::remove_all(root_ / "merged");
  change_rows("s2", [](RunRow& row) { row.threads += 1; });
  expect_refused("the config has a time budget, and rows were measured with numbers of threads");
  change_rows("s2", [](RunRow& row) {
    row.threads -= 1;
    row.machine = "another";
  });
  expect_refused("the config has a time budget, and rows were measured on machines");
}

TEST_F(MergeBudget, ReferencesAndPlansMayBeMadeBySceneToo) {
  const std::string two =
      "--set blocks=2 --set 'budget={\"time_cpu_s\":0.05,\"pilots\":1}' "
      "--set 'scenes=[{\"name\":\"checkerboard\",\"resolution\":[40,24],\"camera_samples\":2,"
      "\"reference\":{\"spp\":8}},{\"name\":\"furnace\",\"resolution\":[16,16],"
      "\"camera_samples\":2,\"reference\":{\"spp\":8}}]'";
  ASSERT_EQ(run("reference tiny.json --shard 2/2 " + two).code, 0);
  EXPECT_EQ(pictures(root_ / "references").size(), 1u);
  EXPECT_TRUE(contains(pictures(root_ / "references").begin()->first, "furnace"));
  ASSERT_EQ(run("plan tiny.json --shard 1/2 --lock plan1.json " + two).code, 0);
  ASSERT_EQ(run("plan tiny.json --shard 2/2 --lock plan2.json " + two).code, 0);
  EXPECT_EQ(Json::parse(read_text(root_ / "plan1.json"))["cells"].size(), 2u);
  const Outcome half = run("run tiny.json --plan plan1.json --out out " + two);
  EXPECT_EQ(half.code, 5) << half.output;
  EXPECT_TRUE(contains(half.output, "of scene \"furnace\"")) << half.output;
  run_shards(2, "--plan plan2.json --plan plan1.json " + two);
  for (const RunRow& row : read_run_rows(root_ / "s2/measurements.csv").rows) {
    EXPECT_EQ(row.scene, "furnace") << "one pair of blocks, so shards are scenes";
  }
  EXPECT_EQ(read_text(root_ / "s1/plan.lock.json"), read_text(root_ / "s2/plan.lock.json"));
  const Outcome merged = run("merge s1 s2 --out merged");
  EXPECT_EQ(merged.code, 0) << merged.output;
}

TEST_F(MergeBudget, PlansOfOtherConfigsAreRefused) {
  ASSERT_EQ(run("plan tiny.json --lock frozen.json").code, 0);
  const Outcome other = run("run tiny.json --plan frozen.json --out out " + budget_);
  EXPECT_EQ(other.code, 5) << other.output;
  EXPECT_TRUE(contains(other.output, "frozen.json: no cell \"MIS\" of scene \"checkerboard\""))
      << other.output;
  ASSERT_EQ(run("run tiny.json --plan frozen.json --out out --set blocks=1 --set spp=2").code, 0);
  change_json("frozen.json", [](Json& plan) { plan["cells"][0]["spp"] = 4; });
  const Outcome changed = run("run tiny.json --plan frozen.json --out out");
  EXPECT_EQ(changed.code, 5) << changed.output;
  EXPECT_TRUE(contains(changed.output, "is another plan than")) << changed.output;
}

}  // namespace
}  // namespace penumbra
