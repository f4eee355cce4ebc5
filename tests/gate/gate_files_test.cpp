#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "harness/csv.h"
#include "harness/gate/gate.h"
#include "harness/gate/gate_run.h"
#include "harness/gate/protocol.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

GateRun example_run() {
  GateRun run;
  run.phase = GatePhase::Confirm;
  run.side = GateSide::Base;
  run.cell = "scene/MIS, 1/sobol";
  run.block = 100'003;
  run.seed = 18'446'744'073'709'551'557U;
  run.threads = 2;
  run.image_hash = "0123";
  run.half_hash = "4567";
  run.estimates = 1;
  run.samples = 2;
  run.rays = 3;
  run.lit = 4;
  run.iterations = 5;
  run.instructions = 6;
  run.time_cpu_s = 0.125;
  run.error = -1e-9;
  run.tiles.values = {0.1, 1.0 / 3.0, 0.0};
  return run;
}

TEST(GateRows, AreReadAsTheyWereWritten) {
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / "gate_rows_test.csv";
  std::filesystem::remove(file);
  GateRun failed;
  failed.failure = "ended by signal 6, \"Aborted\"";
  {
    CsvWriter writer(file, gate_run_columns());
    writer.append(gate_run_record(example_run()));
    writer.append(gate_run_record(failed));
  }
  const std::vector<GateRun> runs = read_gate_runs(file);
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(runs[0], example_run());
  EXPECT_EQ(runs[1], failed);
}

TEST(GateRows, AnUnknownPhaseIsRefused) {
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / "gate_rows_bad_test.csv";
  std::filesystem::remove(file);
  {
    CsvWriter writer(file, gate_run_columns());
    CsvRecord record = gate_run_record(example_run());
    record[0] = "later";
    writer.append(record);
  }
  EXPECT_THROW(read_gate_runs(file), InputError);
}

TEST(GateProtocol, LinesAreReadAsTheyWereWritten) {
  WorkerGreeting greeting;
  greeting.cells = {"a/MIS/sobol"};
  greeting.references = {{"a", "0123"}};
  greeting.build = R"({"commit":"x"})";
  greeting.machine = "machine";
  const WorkerGreeting greeted = read_greeting(to_line(greeting));
  EXPECT_EQ(greeted.cells, greeting.cells);
  EXPECT_EQ(greeted.references.at("a"), "0123");
  EXPECT_EQ(greeted.build, greeting.build);

  const WorkerRequest request{"a/MIS/sobol", 18'446'744'073'709'551'557U, 3, 0, "x.exr"};
  const WorkerRequest requested = read_request(to_line(request));
  EXPECT_EQ(requested.seed, request.seed);
  EXPECT_EQ(requested.image, "x.exr");

  const GateRun reply = read_reply(to_line(example_run()));
  EXPECT_EQ(reply.rays, 3U);
  EXPECT_EQ(reply.instructions, 6U);
  EXPECT_FALSE(reply.time_wall_s);
}

TEST(GateProtocol, WhatIsNoLineOfItIsRefusedAndNamed) {
  EXPECT_THROW(read_reply("Segmentation fault"), RunError);
  EXPECT_THROW(read_request(R"({"cell": 5})"), RunError);
  EXPECT_THROW(read_greeting(R"({"penumbra_worker": 2})"), ReferenceError);
  try {
    read_reply(R"({"cell": "a"})");
    FAIL() << "a reply without its members was read";
  } catch (const RunError& error) {
    EXPECT_NE(std::string(error.what()).find("image_hash"), std::string::npos) << error.what();
  }
}

TEST(Acknowledgement, WidensTheThresholdsByTheLossThatItNames) {
  const GateOverride accepted = parse_acknowledgement("scene/MIS/* -4% fewer bugs", {});
  EXPECT_EQ(accepted.cells, "scene/MIS/*");
  EXPECT_EQ(accepted.reason, "fewer bugs");
  EXPECT_DOUBLE_EQ(accepted.thresholds.fail, 0.04);
  EXPECT_NEAR(accepted.thresholds.pass, 1 - 0.96 * 0.95, 1e-12);
  EXPECT_NEAR(accepted.thresholds.instructions, 1 / 0.96 - 1, 1e-12);
}

TEST(Acknowledgement, OtherTextsAreRefused) {
  for (const char* text : {"", "scene", "scene -4%", "scene -x% reason", "scene 4% reason",
                           "scene -0% reason", "scene -96% reason", " -4% reason"}) {
    EXPECT_THROW(parse_acknowledgement(text, {}), InputError) << text;
  }
}

TEST(GateConfig, TheFirstOverrideThatMatchesCounts) {
  GateConfig config;
  config.overrides = {{"a/*", "noisy", {0.02, 0.06, 0.1, 0.01, 0.03}}};
  EXPECT_DOUBLE_EQ(config.thresholds_of("a/MIS/sobol").fail, 0.06);
  EXPECT_DOUBLE_EQ(config.thresholds_of("b/MIS/sobol").fail, 0.03);
}

GateCell cell_with(GateVerdict verdict, GateReason reason) {
  GateCell cell;
  cell.verdict = verdict;
  cell.reason = reason;
  return cell;
}

TEST(Conclusion, TheGravestFindingDecidesTheExitCode) {
  struct Example {
    std::vector<GateCell> cells;
    int code;
  };
  const GateCell fine = cell_with(GateVerdict::Pass, GateReason::Unchanged);
  const GateCell lost = cell_with(GateVerdict::Fail, GateReason::Noisier);
  const GateCell open = cell_with(GateVerdict::Inconclusive, GateReason::TooNoisy);
  const GateCell biased = cell_with(GateVerdict::Fail, GateReason::Biased);
  const GateCell random = cell_with(GateVerdict::Fail, GateReason::NonDeterministic);
  const GateCell failed = cell_with(GateVerdict::Fail, GateReason::Failed);
  for (const Example& example :
       {Example{{fine}, 0}, Example{{fine, open}, 3}, Example{{open, lost}, 1},
        Example{{lost, biased}, 6}, Example{{lost, random}, 6}, Example{{biased, failed}, 4}}) {
    GateResult result;
    result.suite.verdict = GateVerdict::Pass;
    result.cells = example.cells;
    conclude(result);
    EXPECT_EQ(result.exit_code, example.code) << result.sentence;
  }
}

}  // namespace
}  // namespace penumbra
