#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "command_line_fixture.h"

// `penumbra gate` from end to end: programs with planted faults (tests/gate/planted.cpp), every
// exit code, every file.
namespace penumbra {
namespace {

using nlohmann::json;

class Gate : public CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    write_config(json::object());
  }

  // One cell on a dozen tiles, with a quiet reference.
  void write_config(const json& changes) const {
    json config = json::parse(R"({
      "version": 1, "name": "tiny_gate", "seed": 3, "threads": 1,
      "scenes": [{"name": "checkerboard", "resolution": [96, 32], "camera_samples": 2,
                  "reference": {"estimator": "mis", "sampler": "sobol", "srl": 32, "spp": 256,
                                "params": {"light_sampling": "solid_angle", "heuristic": "power2"}}}],
      "methods": [{"label": "MIS", "estimator": "mis", "srl": 4}],
      "baseline": "MIS", "spp": 4,
      "gate": {"looks": [8]}
    })");
    config.merge_patch(changes);
    write_file("gate_config.json", config.dump(2));
  }

  // A gate of the program against itself with a planted fault. No test may depend on times.
  Outcome gate(const std::string& plant, const std::string& more = "") const {
    return run_shell("PENUMBRA_PLANT=" + plant +
                     " '" PENUMBRA_EXECUTABLE "' gate --base-exe '" PENUMBRA_EXECUTABLE
                     "' --head-exe '" PENUMBRA_PLANTED
                     "' --config gate_config.json --no-times --out out/gate.json " +
                     more);
  }

  json result() const { return json::parse(read_text(root_ / "out/gate.json")); }
};

TEST_F(Gate, TheSameProgramPassesAndLeavesAllItsFiles) {
  const Outcome outcome = gate("");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  const json found = result();
  EXPECT_EQ(found["verdict"], "PASS");
  EXPECT_EQ(found["exit_code"], 0);
  EXPECT_EQ(found["cells"][0]["reason"], "unchanged");
  EXPECT_EQ(found["cells"][0]["same_images"], true);
  for (const char* name : {"gate.md", "gate.junit.xml", "gate.rows.csv",
                           "gate.benchmark-action.json", "gate.bencher.json"}) {
    EXPECT_TRUE(fs::exists(root_ / "out" / name)) << name;
  }
  EXPECT_FALSE(fs::exists(root_ / "out/gate.state"));
  EXPECT_NE(outcome.output.find("PASS"), std::string::npos);
}

TEST_F(Gate, MoreRaysForTheSameImagesAreARegression) {
  const Outcome outcome = gate("more_rays");
  EXPECT_EQ(outcome.code, 1) << outcome.output;
  const json found = result();
  EXPECT_EQ(found["cells"][0]["reason"], "more_rays");
  EXPECT_EQ(found["cells"][0]["same_images"], true);
  EXPECT_EQ(found["cells"][0]["confirmed"], true);
}

TEST_F(Gate, AnAcknowledgedLossPasses) {
  const Outcome outcome = gate("more_rays", "--ack 'checkerboard/* -20% for the test'");
  EXPECT_EQ(outcome.code, 0) << outcome.output;
}

TEST_F(Gate, ExitCodesCanBeNarrowed) {
  EXPECT_EQ(gate("more_rays", "--exit-zero").code, 0);
  EXPECT_EQ(gate("more_rays", "--fail-on correctness,failure").code, 0);
  EXPECT_EQ(gate("more_rays", "--fail-on regression").code, 1);
  EXPECT_EQ(result()["exit_code"], 1);
}

TEST_F(Gate, TwoPercentMoreLightAreABias) {
  const Outcome outcome = gate("energy");
  EXPECT_EQ(outcome.code, 6) << outcome.output;
  EXPECT_EQ(result()["cells"][0]["reason"], "biased");
}

TEST_F(Gate, OtherBitsForTheSameSeedAreNonDeterministic) {
  const Outcome outcome = gate("random");
  EXPECT_EQ(outcome.code, 6) << outcome.output;
  EXPECT_EQ(result()["cells"][0]["reason"], "non_deterministic");
}

TEST_F(Gate, OtherRandomNumbersAreNoBias) {
  write_config(json::parse(R"({"gate": {"looks": [2]}})"));
  const Outcome outcome = gate("streams");
  EXPECT_EQ(outcome.code, 3) << outcome.output;
  EXPECT_EQ(result()["verdict"], "INCONCLUSIVE");
  EXPECT_EQ(result()["cells"][0]["same_images"], false);
}

TEST_F(Gate, ProgramsThatFailAreAFailureOfTheRun) {
  write_config(json::parse(R"({"gate": {"timeout_s": 2}})"));
  for (const char* plant : {"nan", "crash", "hang"}) {
    const Outcome outcome = gate(plant);
    EXPECT_EQ(outcome.code, 4) << plant << ": " << outcome.output;
    EXPECT_EQ(result()["cells"][0]["reason"], "failed") << plant;
  }
  EXPECT_NE(gate("nan").output.find("pixel 0,0"), std::string::npos);
}

TEST_F(Gate, FaultsOfTheCommandLineAreNamed) {
  struct Example {
    const char* arguments;
    const char* said;
  };

  for (const Example& example :
       {Example{"gate", "expected one of --base-exe"}, Example{"gate --base x", "belong together"},
        Example{"gate --baseline x --base y --head z", "expected one of"},
        Example{"gate --base-exe no_such_program --config gate_config.json", "no_such_program"},
        Example{"gate --baseline x --config gate_config.json --out gate.txt", ".json"},
        Example{"gate --baseline x --config gate_config.json --ack nonsense", "--ack"},
        Example{"gate --baseline x --config no_such_config.json", "no_such_config.json"},
        Example{"gate --baseline x --config gate_config.json --set gate.fail=2", "/gate/fail"},
        Example{"gate --baseline x --config gate_config.json --set gate.fail=0.5",
                "noise <= fail <= pass"},
        Example{"gate --baseline x --config gate_config.json --set budget.time_cpu_s=1", "/budget"},
        Example{"baseline update --config gate_config.json", "--reason"}}) {
    const Outcome outcome = run(example.arguments);
    EXPECT_EQ(outcome.code, 2) << example.arguments << ": " << outcome.output;
    EXPECT_NE(outcome.output.find(example.said), std::string::npos) << outcome.output;
  }
}

TEST_F(Gate, AProgramThatIsNoPenumbraIsRefused) {
  const Outcome outcome =
      run("gate --base-exe /bin/false --config gate_config.json --out out/gate.json");
  EXPECT_NE(outcome.code, 0);
  EXPECT_NE(outcome.output.find("/bin/false"), std::string::npos) << outcome.output;
}

TEST_F(Gate, AMissingBaseIsMissing) {
  const Outcome folders = run("gate --base no_such --head no_such --config gate_config.json");
  EXPECT_EQ(folders.code, 5) << folders.output;
  EXPECT_NE(folders.output.find("no_such"), std::string::npos);
  const Outcome stored = run("gate --baseline no_such --config gate_config.json");
  EXPECT_EQ(stored.code, 5) << stored.output;
  EXPECT_NE(stored.output.find("checkerboard.json"), std::string::npos);
}

TEST_F(Gate, StoredBaselinesAreWrittenComparedAndRefused) {
  const Outcome update =
      run("baseline update --config gate_config.json --baseline stored --reason 'first of them'");
  ASSERT_EQ(update.code, 0) << update.output;
  const json stored = json::parse(read_text(root_ / "stored/checkerboard.json"));
  EXPECT_EQ(stored["reasons"][0]["reason"], "first of them");
  EXPECT_FALSE(stored.dump().find("time_cpu") != std::string::npos);

  const std::string against =
      " gate --baseline stored --config gate_config.json --out out/gate.json";
  const Outcome same = run(against);
  EXPECT_EQ(same.code, 0) << same.output;
  EXPECT_EQ(result()["cells"][0]["reason"], "unchanged");
  const Outcome wrong = run_shell("PENUMBRA_PLANT=energy '" PENUMBRA_PLANTED "'" + against);
  EXPECT_EQ(wrong.code, 6) << wrong.output;
  // More rays than the stored runs, and the same images.
  const Outcome more = run_shell("PENUMBRA_PLANT=more_rays '" PENUMBRA_PLANTED "'" + against);
  EXPECT_EQ(more.code, 1) << more.output;
  EXPECT_EQ(result()["cells"][0]["reason"], "more_rays");

  const Outcome biased = run_shell("PENUMBRA_PLANT=energy '" PENUMBRA_PLANTED
                                   "' baseline update --config gate_config.json --baseline stored "
                                   "--reason 'should not be'");
  EXPECT_EQ(biased.code, 6) << biased.output;
  EXPECT_EQ(json::parse(read_text(root_ / "stored/checkerboard.json")), stored);

  write_config(json::parse(R"({"methods": [{"label": "MIS", "estimator": "mis", "srl": 8}]})"));
  const Outcome other = run(against);
  EXPECT_EQ(other.code, 5) << other.output;
  EXPECT_NE(other.output.find("other parameters"), std::string::npos) << other.output;
}

TEST_F(Gate, ResultFoldersAreCompared) {
  const std::string config = "gate_config.json --set blocks=4 ";
  ASSERT_EQ(run("run " + config + "--out a").code, 0);
  ASSERT_EQ(run("run " + config + "--out b").code, 0);
  const Outcome same = run("gate --base a --head b --out out/gate.json");
  EXPECT_EQ(same.code, 0) << same.output;
  ASSERT_EQ(run("run " + config + "--set seed=4 --out c").code, 0);
  const Outcome few = run("gate --base a --head c --out out/gate.json");
  EXPECT_EQ(few.code, 3) << few.output;
  ASSERT_EQ(run("run " + config + "--set 'scenes.0.resolution=[64,32]' --out d").code, 0);
  const Outcome other = run("gate --base a --head d --out out/gate.json");
  EXPECT_EQ(other.code, 5) << other.output;
}

TEST_F(Gate, AnInterruptedGateGoesOn) {
  write_config(json::parse(R"({"gate": {"looks": [40]}})"));
  const std::string command = "'" PENUMBRA_EXECUTABLE "' gate --base-exe '" PENUMBRA_EXECUTABLE
                              "' --config gate_config.json --no-times --out out/gate.json";
  // exec, so that the signal reaches the program and not the shell.
  const Outcome interrupted = run_shell(
      "(exec " + command +
      ") & child=$!; for i in $(seq 600); do "
      "[ $(wc -l < out/gate.rows.csv 2>/dev/null || echo 0) -gt 12 ] && break; sleep 0.05; done; "
      "kill -INT $child; wait $child");
  ASSERT_EQ(interrupted.code, 130) << interrupted.output;
  EXPECT_FALSE(fs::exists(root_ / "out/gate.json"));
  const std::string before = read_text(root_ / "out/gate.rows.csv");
  write_file("note", "");
  const Outcome resumed = run_shell(command);
  EXPECT_EQ(resumed.code, 0) << resumed.output;
  EXPECT_NE(resumed.output.find("going on"), std::string::npos) << resumed.output;
  EXPECT_EQ(read_text(root_ / "out/gate.rows.csv").substr(0, before.size()), before);
}

}  // namespace
}  // namespace penumbra
