// What becomes of estimates that are not finite: events.txt with a command that replays each, a
// failed row in every table, no reference, and a picture that shows them.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "harness/exr.h"
#include "harness/run_row.h"
#include "tests/e2e/command_line_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;

class Events : public CommandLine {
 protected:
  // A mirror of alpha 1e-4 at a grazing angle has f of order 1e9 / sr at its peak, so radiance of
  // 4e29 overflows a float where a sample of the BSDF meets the peak.
  void SetUp() override {
    CommandLine::SetUp();
    write_file("grazing.json", R"({
      "format": "penumbra-scene", "version": 1, "name": "grazing", "summary": "overflow",
      "camera": {"position": [0, 0.008, 0.9], "look_at": [0, 0, 0], "up": [0, 1, 0],
                 "vertical_fov_deg": 0.4, "resolution": [1, 1]},
      "materials": {"mirror": {"type": "conductor", "eta": [0.2, 0.9, 1.1], "k": [3.9, 2.4, 2.1],
                               "alpha": 1e-4},
                    "black": {"type": "lambert", "reflectance": 0}},
      "shapes": [
        {"name": "plane", "type": "rectangle", "origin": [-1, 0, 1], "edge_u": [2, 0, 0],
         "edge_v": [0, 0, -2], "material": "mirror"},
        {"name": "sky", "type": "sphere", "center": [0, 0, 0], "radius": 3, "material": "black",
         "emission": {"radiance": 4.2e29, "two_sided": true}}]
    })");
  }

  Outcome run_study(const json& reference) const {
    json study = json::parse(R"({
      "version": 1, "name": "overflow", "baseline": "MIS", "spp": 200, "blocks": 1,
      "scenes": [{"name": "grazing", "file": "grazing.json", "camera_samples": 1}],
      "methods": [{"label": "MIS", "estimator": "mis", "srl": 64}]
    })");
    study["scenes"][0]["reference"] = reference;
    write_file("overflow.json", study.dump());
    return run("run overflow.json --out 'folder with blanks'");
  }

  fs::path out(const std::string& name) const { return root_ / "folder with blanks" / name; }
};

// The reference draws two samples of the BSDF in all, the run 6400.
TEST_F(Events, CommandLeadsToTheEstimateThatIsNotFinite) {
  const Outcome outcome = run_study({{"srl", 2}, {"spp", 2}});
  ASSERT_EQ(outcome.code, 4) << outcome.output;
  const RunRow failed = read_run_rows(out("measurements.csv")).rows.at(0);
  EXPECT_EQ(failed.status, RunStatus::Failed);
  EXPECT_EQ(failed.image_hash.size(), 32u);
  const std::string events = read_text(out("events.txt"));
  EXPECT_NE(events.find("; component bsdf, sample "), std::string::npos) << events;
  const std::string prefix = "replay: ";
  const std::size_t begin = events.find(prefix);
  ASSERT_NE(begin, std::string::npos) << events;
  const std::string command =
      events.substr(begin + prefix.size(), events.find('\n') - begin - prefix.size());
  // As it stands there, from another folder.
  const std::string path =
      "PATH='" + fs::path(PENUMBRA_EXECUTABLE).parent_path().string() + "':$PATH && ";
  const Outcome as_it_is = run_shell("cd / && " + path + command);
  ASSERT_EQ(as_it_is.code, 0) << command << "\n" << as_it_is.output;
  EXPECT_NE(as_it_is.output.find("the row failed: "), std::string::npos) << as_it_is.output;
  const Outcome replayed = run_shell(path + command + " --json --verify");
  ASSERT_EQ(replayed.code, 0) << command << "\n" << replayed.output;
  const json result = json::parse(replayed.output);
  ASSERT_EQ(result.at("estimates").size(), 1u);
  EXPECT_EQ(result["estimates"][0]["value"][0], "inf");
  EXPECT_TRUE(result.at("verify").at("same").get<bool>());
}

TEST_F(Events, TablesTellOfTheFailureInPlaceOfNumbers) {
  ASSERT_EQ(run_study({{"srl", 2}, {"spp", 2}}).code, 4);
  const std::vector<EfficiencyRow> table = read_efficiency_rows(out("efficiency.csv"));
  ASSERT_EQ(table.size(), 1u);
  EXPECT_EQ(table[0].verdict, Verdict::Failed);
  EXPECT_FALSE(table[0].err.has_value());
  EXPECT_NE(table[0].note.find("not finite or negative"), std::string::npos) << table[0].note;
  EXPECT_NE(read_text(out("efficiency.md")).find("failed"), std::string::npos);
}

TEST_F(Events, AReferenceWithSuchEstimatesIsNotMade) {
  const Outcome outcome = run_study({{"srl", 64}, {"spp", 400}});
  EXPECT_EQ(outcome.code, 4) << outcome.output;
  EXPECT_NE(outcome.output.find("reference of scene \"grazing\": "), std::string::npos)
      << outcome.output;
  EXPECT_NE(outcome.output.find("are not finite or negative, the first at pixel 0,0 estimate "),
            std::string::npos)
      << outcome.output;
  EXPECT_NE(outcome.output.find("; component bsdf, sample "), std::string::npos) << outcome.output;
  EXPECT_EQ(std::distance(fs::directory_iterator(root_ / "references"), fs::directory_iterator()),
            0);
}

TEST_F(Events, APictureKeepsThem) {
  const Outcome outcome = run("render grazing.json --spp 200 --srl 64 -o x.exr");
  EXPECT_EQ(outcome.code, 4) << outcome.output;
  EXPECT_NE(outcome.output.find("pixel 0,0 estimate "), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("; component bsdf, sample "), std::string::npos) << outcome.output;
  EXPECT_TRUE(std::isinf(read_exr(root_ / "x.exr").image("reflected").at(0, 0).x));
}

}  // namespace
}  // namespace penumbra
