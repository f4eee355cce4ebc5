// The real executable, as a user calls it: exit codes, files, resuming, bad input.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "harness/csv.h"
#include "harness/exr.h"
#include "harness/run_row.h"
#include "tests/e2e/command_line_fixture.h"
#include "tests/e2e/timeless_rows.h"

namespace penumbra {
namespace {

TEST_F(CommandLine, RunWritesTheColumnsOfTheDesign) {
  const Outcome run_outcome = run("run configs/smoke.json --out out");
  ASSERT_EQ(run_outcome.code, 0) << run_outcome.output;
  const std::vector<std::string> measurements = {"run_id",
                                                 "scene",
                                                 "label",
                                                 "estimator",
                                                 "sampler",
                                                 "spp",
                                                 "srl",
                                                 "srl_initial",
                                                 "srl_adaptive",
                                                 "population",
                                                 "iterations",
                                                 "budget_s",
                                                 "block",
                                                 "seed",
                                                 "width",
                                                 "height",
                                                 "threads",
                                                 "estimates",
                                                 "rays",
                                                 "time_wall_s",
                                                 "time_cpu_s",
                                                 "time_prepare_s",
                                                 "instructions",
                                                 "mse",
                                                 "mse_naive",
                                                 "relmse",
                                                 "mape",
                                                 "mean_error",
                                                 "p_eff",
                                                 "reference_id",
                                                 "reference_share",
                                                 "nonfinite",
                                                 "status"};
  const std::vector<std::string> efficiency = {
      "scene",    "label",    "estimator", "spp",     "srl",      "population",
      "n_blocks", "T_s",      "err",       "eff",     "eff_lo",   "eff_hi",
      "ratio",    "ratio_lo", "ratio_hi",  "eff_cpu", "eff_rays", "eff_instructions",
      "bias_rel", "bias_p",   "verdict"};
  const CsvTable raw = read_csv(root_ / "out/measurements.csv");
  const CsvTable table = read_csv(root_ / "out/efficiency.csv");
  EXPECT_EQ(raw.rows.size(), 4u * 3u);
  EXPECT_EQ(table.rows.size(), 4u);
  ASSERT_GE(raw.header.size(), measurements.size());
  ASSERT_GE(table.header.size(), efficiency.size());
  EXPECT_TRUE(std::equal(measurements.begin(), measurements.end(), raw.header.begin()));
  EXPECT_TRUE(std::equal(efficiency.begin(), efficiency.end(), table.header.begin()));
}

TEST_F(CommandLine, RunWritesAStripForEveryGroupOfMaps) {
  const Outcome outcome =
      run("run configs/smoke.json --out out --set blocks=1 --set 'scenes.0.resolution=[32,16]' "
          "--only '*/PMC-HI/independent'");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  std::vector<std::string> missing = {"-maps.png", "-maps-2.png", "-maps-3.png"};
  for (const fs::directory_entry& entry : fs::directory_iterator(root_ / "out/images")) {
    std::erase_if(missing, [&](const std::string& end) {
      return entry.path().filename().string().ends_with(end);
    });
  }
  EXPECT_EQ(missing, std::vector<std::string>{});
}

TEST_F(CommandLine, SecondCallOfRunMeasuresNothing) {
  ASSERT_EQ(run("run configs/smoke.json --out out").code, 0);
  const std::string before = read_text(root_ / "out/measurements.csv");
  const Outcome second = run("run configs/smoke.json --out out");
  EXPECT_EQ(second.code, 0);
  EXPECT_NE(second.output.find("0 runs measured, 12 found"), std::string::npos) << second.output;
  EXPECT_EQ(read_text(root_ / "out/measurements.csv"), before);
}

TEST_F(CommandLine, RunKilledTwentyTimesResumesToTheRowsOfAnUninterruptedOne) {
  const std::string config = smoke_config("24");
  ASSERT_EQ(run("run smoke.json --out whole").code, 0);
  // The first kills hit the reference and the plan, the others the blocks.
  fs::rename(root_ / "references", root_ / "references of whole");
  fs::create_directory(root_ / "references");
  std::mt19937 generator(20);
  int killed = 0;
  while (killed < 20) {
    const int delay_ms = killed < 5 ? std::uniform_int_distribution<int>(2, 60)(generator)
                                    : std::uniform_int_distribution<int>(20, 120)(generator);
    const int code = run_and_kill(config, root_ / "killed", delay_ms);
    ASSERT_TRUE(code == 128 + SIGKILL || code == 0) << code;
    if (code == 0) break;
    ++killed;
  }
  EXPECT_EQ(killed, 20) << "the run ended before the last kill: more blocks are needed";
  // A kill in the middle of a write leaves half a line.
  std::ofstream(root_ / "killed/measurements.csv", std::ios::app) << "0123,checkerboard,MI";
  const Outcome resumed = run("run smoke.json --out killed");
  ASSERT_EQ(resumed.code, 0) << resumed.output;
  EXPECT_EQ(timeless_rows(root_ / "killed/measurements.csv"),
            timeless_rows(root_ / "whole/measurements.csv"));
}

TEST_F(CommandLine, RunOnAFullDiskEndsWithCode4AndGoesOnWhenThereIsRoom) {
  // Pictures of runs stay below the limit, the growing table of rows does not.
  const std::string small =
      "--set 'scenes.0.resolution=[24,14]' --set images.maps=false --out full";
  const std::string limited =
      "trap '' XFSZ; ulimit -f 12; '" PENUMBRA_EXECUTABLE "' run configs/smoke.json " + small;
  ASSERT_EQ(run("reference configs/smoke.json --set 'scenes.0.resolution=[24,14]'").code, 0);
  const Outcome full = run_shell(limited);
  EXPECT_EQ(full.code, 4) << full.output;
  EXPECT_NE(full.output.find("File too large"), std::string::npos) << full.output;
  const std::size_t kept = read_run_rows(root_ / "full/measurements.csv").rows.size();
  EXPECT_GT(kept, 0u);
  EXPECT_LT(kept, 12u);
  const Outcome resumed = run("run configs/smoke.json " + small);
  ASSERT_EQ(resumed.code, 0) << resumed.output;
  EXPECT_EQ(read_run_rows(root_ / "full/measurements.csv").rows.size(), 12u);
}

TEST_F(CommandLine, RunIntoAFileInsteadOfAFolderMeasuresNothing) {
  write_file("taken", "text");
  const Outcome outcome = run("run configs/smoke.json --out taken");
  EXPECT_EQ(outcome.code, 4) << outcome.output;
  EXPECT_NE(outcome.output.find("taken"), std::string::npos) << outcome.output;
  EXPECT_EQ(read_text(root_ / "taken"), "text");
}

TEST_F(CommandLine, InterruptEndsAfterTheRunUnderWayWithCode130) {
  const std::string config = smoke_config("60");
  EXPECT_EQ(run_and_signal(config, root_ / "out", 3, SIGINT), 130);
  const RunRows rows = read_run_rows(root_ / "out/measurements.csv");
  EXPECT_FALSE(rows.torn_tail);
  EXPECT_LT(rows.rows.size(), 4u * 60u);
}

TEST_F(CommandLine, RunRefusesAFolderOfAnotherExperiment) {
  ASSERT_EQ(run("run configs/smoke.json --out out --set blocks=1").code, 0);
  const std::string rows = read_text(root_ / "out/measurements.csv");
  const Outcome other = run("run configs/smoke.json --out out --set name=other");
  EXPECT_EQ(other.code, 2);
  EXPECT_NE(other.output.find("another experiment, \"smoke\""), std::string::npos) << other.output;
  EXPECT_EQ(read_text(root_ / "out/measurements.csv"), rows);
}

TEST_F(CommandLine, ChangedConfigMeasuresOnlyWhatIsNew) {
  ASSERT_EQ(run("run configs/smoke.json --out out").code, 0);
  const Outcome changed =
      run("run configs/smoke.json --out out --set methods.PMC-HI.srl=2-6 --set blocks=4");
  ASSERT_EQ(changed.code, 0) << changed.output;
  // MIS keeps 2 samplers x 3 blocks and gets a fourth; PMC-HI is another cell.
  EXPECT_NE(changed.output.find("10 runs measured, 6 found"), std::string::npos) << changed.output;
  EXPECT_NE(changed.output.find("6 rows are of cells that the config no longer has"),
            std::string::npos)
      << changed.output;
  EXPECT_EQ(read_run_rows(root_ / "out/measurements.csv").rows.size(), 22u);
  EXPECT_EQ(read_efficiency_rows(root_ / "out/efficiency.csv").size(), 4u);
}

TEST_F(CommandLine, ReportMakesTheSameTablesAgain) {
  ASSERT_EQ(run("run configs/smoke.json --out out").code, 0);
  const std::string csv = read_text(root_ / "out/efficiency.csv");
  const std::string markdown = read_text(root_ / "out/efficiency.md");
  fs::remove(root_ / "out/efficiency.csv");
  fs::remove(root_ / "out/efficiency.md");
  const Outcome outcome = run("report out");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_EQ(read_text(root_ / "out/efficiency.csv"), csv);
  EXPECT_EQ(read_text(root_ / "out/efficiency.md"), markdown);
  EXPECT_EQ(run("report scenes").code, 2);
}

TEST_F(CommandLine, TagSelectsMethods) {
  const std::string set = " --set 'methods.MIS.tags=[\"plain\"]' --set blocks=1";
  const Outcome outcome = run("run configs/smoke.json --out out --tag plain" + set);
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("2 runs measured"), std::string::npos) << outcome.output;
  EXPECT_EQ(run("run configs/smoke.json --out out --tag plan" + set).code, 2);
}

TEST_F(CommandLine, EveryCallIsASessionOfTheEnvironment) {
  ASSERT_EQ(run("run configs/smoke.json --out out --set blocks=1").code, 0);
  ASSERT_EQ(run("run configs/smoke.json --out out --set blocks=2").code, 0);
  const nlohmann::json environment =
      nlohmann::json::parse(read_text(root_ / "out/environment.json"));
  ASSERT_EQ(environment["sessions"].size(), 2u);
  EXPECT_NE(environment["sessions"][0]["command_line"], environment["sessions"][1]["command_line"]);
  EXPECT_FALSE(environment["config_hash"].get<std::string>().empty());
}

TEST_F(CommandLine, ValidateReportsFiveMistakesWithTheirPlaces) {
  write_file("bad.json",
             "{\n"                                                            // 1
             "  \"version\": 1,\n"                                            // 2
             "  \"name\": \"bad\",\n"                                         // 3
             "  \"sed\": 3,\n"                                                // 4 unknown key
             "  \"scenes\": [{\"name\": \"checkerboad\"}],\n"                 // 5 unknown scene
             "  \"methods\": [\n"                                             // 6
             "    {\"label\": \"A\", \"estimator\": \"pmc\", \"srl\": 8},\n"  // 7 unknown estimator
             "    {\"label\": \"B\", \"estimator\": \"mis\", \"srl\": 8, \"params\": {\"layuot\": "
             "\"pairs\"}}\n"             // 8
             "  ],\n"                    // 9
             "  \"baseline\": \"B\",\n"  // 10
             "  \"blocks\": \"five\"\n"  // 11 wrong type
             "}\n");
  const Outcome outcome = run("validate bad.json");
  EXPECT_EQ(outcome.code, 2);
  for (const char* place :
       {"bad.json:4:3:", "bad.json:5:23:", "bad.json:7:33:", "bad.json:8:", "bad.json:11:13:"}) {
    EXPECT_NE(outcome.output.find(place), std::string::npos) << place << " in\n" << outcome.output;
  }
  for (const char* suggestion : {"seed", "checkerboard", "pmc_hi", "layout"}) {
    EXPECT_NE(outcome.output.find(suggestion), std::string::npos) << suggestion;
  }
}

TEST_F(CommandLine, UnknownSceneAndEstimatorAndOptionAreUsageErrors) {
  EXPECT_EQ(run("render nowhere -o x.png").code, 2);
  EXPECT_EQ(run("render furnace --estimator nothing -o x.png").code, 2);
  EXPECT_EQ(run("render furnace --set layout=pears -o x.png").code, 2);
  EXPECT_EQ(run("render furnace -o x.jpg").code, 2);
  EXPECT_EQ(run("run missing.json").code, 2);
  EXPECT_EQ(run("frobnicate").code, 2);
}

TEST_F(CommandLine, UnwritableOutputIsARunFailure) {
  EXPECT_EQ(run("render furnace --spp 1 -o /proc/nowhere/x.png").code, 4);
}

TEST_F(CommandLine, ReferenceOfAnotherSceneIsRefusedWithCode5) {
  ASSERT_EQ(run("reference configs/smoke.json").code, 0);
  fs::path file;
  for (const fs::directory_entry& entry : fs::directory_iterator(root_ / "references"))
    file = entry.path();
  ExrFile reference = read_exr(file);
  reference.metadata["reference_id"] = "0123456789abcdef";
  write_exr(file, reference.layers, reference.metadata);
  const Outcome outcome = run("run configs/smoke.json --out out");
  EXPECT_EQ(outcome.code, 5) << outcome.output;
}

TEST_F(CommandLine, ReferenceHasIndependentHalvesAndIsExtended) {
  ASSERT_EQ(run("reference configs/smoke.json").code, 0);
  fs::path file;
  for (const fs::directory_entry& entry : fs::directory_iterator(root_ / "references"))
    file = entry.path();
  const ExrFile before = read_exr(file);
  EXPECT_EQ(before.metadata.at("spp"), "64");
  EXPECT_NE(before.image("half_a").pixels, before.image("half_b").pixels);
  ASSERT_EQ(run("reference configs/smoke.json --add-spp 32").code, 0);
  const ExrFile after = read_exr(file);
  EXPECT_EQ(after.metadata.at("spp"), "96");
  EXPECT_EQ(nlohmann::json::parse(after.metadata.at("lineage")).size(), 2u);
}

TEST_F(CommandLine, ImagesHaveTheSameBitsOnOneTwoAndFiveThreads) {
  for (const char* estimator : {"mis --srl 7", "pmc_hi --srl 4-12"}) {
    std::string first;
    for (const char* threads : {"1", "2", "5"}) {
      const Outcome outcome =
          run("render checkerboard --resolution 80 45 --spp 2 --sampler sobol --estimator " +
              std::string(estimator) + " --threads " + threads + " -o x.exr");
      ASSERT_EQ(outcome.code, 0) << outcome.output;
      const std::string bytes = read_text(root_ / "x.exr");
      if (first.empty()) first = bytes;
      EXPECT_EQ(bytes, first) << estimator << " on " << threads << " threads";
    }
  }
}

TEST_F(CommandLine, ListNamesEstimatorsWithCitationBiasAndParameters) {
  const Outcome outcome = run("list --json");
  ASSERT_EQ(outcome.code, 0);
  const nlohmann::json json = nlohmann::json::parse(outcome.output);
  std::vector<std::string> names;
  for (const nlohmann::json& estimator : json.at("estimators")) {
    names.push_back(estimator.at("name"));
    EXPECT_FALSE(estimator.at("citation").get<std::string>().empty());
    EXPECT_TRUE(estimator.at("unbiased").is_boolean());
    EXPECT_NE(estimator.at("unbiased").get<bool>(),
              !estimator.at("bias_reason").get<std::string>().empty());
    for (const nlohmann::json& param : estimator.at("params")) {
      EXPECT_TRUE(param.contains("default"));
      EXPECT_FALSE(param.at("doc").get<std::string>().empty());
    }
  }
  for (const char* name : {"mis", "alsd", "mdhi", "pmc_hi", "light", "bsdf", "uniform"}) {
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
  }
}

TEST_F(CommandLine, PlanIsFrozenAndKeptByALaterRun) {
  const std::string set = " --set 'budget={\"time_cpu_s\":0.2,\"pilots\":1}' --set blocks=1";
  ASSERT_EQ(run("run configs/smoke.json --out out" + set).code, 0);
  const std::string plan = read_text(root_ / "out/plan.lock.json");
  EXPECT_NE(plan.find("predicted_cpu_s"), std::string::npos);
  const Outcome second = run("run configs/smoke.json --out out" + set);
  EXPECT_NE(second.output.find("0 runs measured, 4 found"), std::string::npos) << second.output;
  EXPECT_EQ(read_text(root_ / "out/plan.lock.json"), plan);
}

TEST_F(CommandLine, InspectPrintsWhereTheTimeOfEveryEstimatorGoes) {
  const Outcome outcome = run("inspect furnace --json");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  const nlohmann::json json = nlohmann::json::parse(outcome.output);
  ASSERT_EQ(json.at("costs").size(), json.at("estimates").size());
  for (const nlohmann::json& cost : json.at("costs")) {
    double sum = 0.0;
    for (const nlohmann::json& stage : cost.at("stages_ns")) sum += stage.get<double>();
    // Shares are medians of their own, so that their sum is 1 to within their spread.
    EXPECT_NEAR(sum / cost.at("total_ns").get<double>(), 1.0, 0.2) << cost;
    EXPECT_GT(cost.at("stages_ns").at("trace").get<double>(), 0.0) << cost;
    EXPECT_GT(cost.at("limit_ns").get<double>(), 0.0) << cost;
  }
}

}  // namespace
}  // namespace penumbra
