// What a number says about the program that made it: the build in every row, work and times of a
// picture.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "harness/run_row.h"
#include "tests/e2e/command_line_fixture.h"

namespace penumbra {
namespace {

using Json = nlohmann::json;

constexpr const char* kSwitches[] = {"version",    "commit", "compiler", "flags",    "preset",
                                     "build_type", "arch",   "march",    "sanitize", "embree",
                                     "ipo",        "fuzz",   "asserts"};

/// Pictures of a small scene on stdout as JSON, without the notes on stderr.
class RenderJson : public CommandLine {
 protected:
  Json render(const std::string& arguments) const {
    const Outcome outcome = run("render rectangle_over_plane --resolution 20 12 -o a.png --json " +
                                arguments + " 2>notes.txt");
    EXPECT_EQ(outcome.code, 0) << outcome.output << read_text(root_ / "notes.txt");
    return Json::parse(outcome.output, nullptr, false);
  }
};

TEST_F(CommandLine, EveryRowNamesItsBuildAndTheEnvironmentKnowsItsSwitches) {
  ASSERT_EQ(run("run configs/smoke.json --out out --set blocks=1").code, 0);
  const Json environment = Json::parse(read_text(root_ / "out/environment.json"));
  const std::vector<RunRow> rows = read_run_rows(root_ / "out/measurements.csv").rows;
  ASSERT_FALSE(rows.empty());
  for (const RunRow& row : rows) {
    ASSERT_TRUE(environment["builds"].contains(row.build)) << "build \"" << row.build << "\"";
    for (const char* name : kSwitches) {
      EXPECT_TRUE(environment["builds"][row.build].contains(name)) << name;
    }
  }
  EXPECT_EQ(environment["penumbra"]["build"], rows[0].build);
  EXPECT_EQ(environment["sessions"][0]["build"], rows[0].build);
  EXPECT_NE(environment["penumbra"]["flags"].get<std::string>().find("-ffp-contract=off"),
            std::string::npos)
      << environment["penumbra"]["flags"];
}

TEST_F(CommandLine, BuildsOfEarlierSessionsAreKept) {
  ASSERT_EQ(run("run configs/smoke.json --out out --set blocks=1").code, 0);
  const fs::path file = root_ / "out/environment.json";
  Json environment = Json::parse(read_text(file));
  environment["builds"]["0123456789abcdef"] = {{"flags", "-O7"}};
  std::ofstream(file) << environment.dump(2);
  ASSERT_EQ(run("run configs/smoke.json --out out --set blocks=2").code, 0);
  environment = Json::parse(read_text(file));
  EXPECT_EQ(environment["builds"].size(), 2u);
  EXPECT_EQ(environment["builds"]["0123456789abcdef"]["flags"], "-O7");
}

TEST_F(RenderJson, HasTheWorkAndTheTimes) {
  const Json json = render("--estimator mis --spp 2 --srl 4 --threads 2 --seed 5");
  ASSERT_TRUE(json.is_object());
  EXPECT_EQ(json["scene"], "rectangle_over_plane");
  EXPECT_EQ(json["width"], 20);
  EXPECT_EQ(json["height"], 12);
  EXPECT_EQ(json["threads"], 2);
  EXPECT_EQ(json["spp"], 2);
  EXPECT_EQ(json["srl"], 4);
  EXPECT_EQ(json["seed"], 5);
  EXPECT_EQ(json["lights"], 1);
  const auto valid = json["valid_points"].get<std::uint64_t>();
  EXPECT_GT(valid, 0u);
  EXPECT_LE(valid, 20u * 12u * 2u);
  EXPECT_EQ(json["estimates"], valid);
  EXPECT_LE(json["samples"].get<std::uint64_t>(), 4 * valid);
  EXPECT_GT(json["rays"].get<std::uint64_t>(), 0u);
  EXPECT_LE(json["rays"], json["samples"]);
  EXPECT_GT(json["time_wall_s"].get<double>(), 0.0);
  EXPECT_GT(json["time_cpu_s"].get<double>(), 0.0);
  EXPECT_GE(json["time_prepare_s"].get<double>(), 0.0);
  for (const char* stage : {"read_ms", "build_ms", "ray_tracer_build_ms", "points_ms"}) {
    EXPECT_GE(json["load"][stage].get<double>(), 0.0) << stage;
  }
  for (const char* name : kSwitches) EXPECT_TRUE(json["build"].contains(name)) << name;
}

TEST_F(RenderJson, HashIsOfThePictureAndNotOfTheThreads) {
  const std::string call = "--estimator pmc_hi --spp 2 --srl 2-6 --set population=4 ";
  const Json one = render(call + "--threads 1");
  const Json two = render(call + "--threads 2");
  const Json other = render(call + "--threads 1 --seed 9");
  EXPECT_EQ(one["image_hash"].get<std::string>().size(), 32u);
  EXPECT_EQ(one["image_hash"], two["image_hash"]);
  EXPECT_NE(one["image_hash"], other["image_hash"]);
}

}  // namespace
}  // namespace penumbra
