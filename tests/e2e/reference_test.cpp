// References and the pictures of runs, as a user meets them.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "harness/csv.h"
#include "harness/exr.h"
#include "harness/metrics.h"
#include "harness/run_row.h"
#include "tests/e2e/command_line_fixture.h"

namespace penumbra {
namespace {

// Grey floor with a ball under two lights without extent.
constexpr const char* kPointLights = R"({
  "format": "penumbra-scene", "version": 1, "name": "points",
  "camera": {"position": [0, 2, 3], "look_at": [0, 0, 0], "vertical_fov_deg": 40,
             "resolution": [24, 16]},
  "materials": {"grey": {"type": "lambert", "reflectance": 0.5}},
  "shapes": [{"name": "floor", "type": "rectangle", "origin": [-2, 0, 2], "edge_u": [4, 0, 0],
              "edge_v": [0, 0, -4], "material": "grey"},
             {"name": "ball", "type": "sphere", "center": [0.2, 0.3, 0], "radius": 0.3,
              "material": "grey"}],
  "point_lights": [{"name": "bulb", "position": [0.3, 1.7, 0.2], "intensity": 3}],
  "directional_lights": [{"name": "sun", "direction": [1, -2, 0.5], "irradiance": 0.7}]
})";

class References : public CommandLine {
 protected:
  // The references of the repository, as a checkout has them.
  void link_shipped() const {
    const fs::path shipped = fs::path(PENUMBRA_SOURCE_DIR) / "references";
    fs::create_directory_symlink(shipped / "small", root_ / "references/small");
    fs::create_symlink(shipped / "manifest.json", root_ / "references/manifest.json");
  }
  std::vector<std::string> rendered() const {
    std::vector<std::string> names;
    for (const fs::directory_entry& entry : fs::directory_iterator(root_ / "references")) {
      if (entry.path().extension() == ".exr") names.push_back(entry.path().filename().string());
    }
    return names;
  }
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// Fails when the scene core or the scene changed the truth: then the reference has to be made again
// with `penumbra reference configs/smoke.json --small --add-spp 960`.
TEST_F(References, OfTheSmokeConfigAreInTheRepositorySoThatNothingIsRendered) {
  link_shipped();
  const Outcome outcome = run("run configs/smoke.json --out out");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_TRUE(contains(outcome.output, "references/small/checkerboard-")) << outcome.output;
  EXPECT_TRUE(contains(outcome.output, "% of the mean per pixel")) << outcome.output;
  EXPECT_FALSE(contains(outcome.output, "--add-spp")) << "noisy: " << outcome.output;
  EXPECT_EQ(rendered(), std::vector<std::string>{});
  const Outcome plan = run("plan configs/smoke.json");
  EXPECT_TRUE(contains(plan.output, "references/small/checkerboard-")) << plan.output;
  EXPECT_TRUE(contains(plan.output, "of single runs (images.runs)")) << plan.output;
}

TEST_F(References, OfTheRepositoryAreSmallAndInTheManifest) {
  const fs::path folder = fs::path(PENUMBRA_SOURCE_DIR) / "references";
  const nlohmann::json manifest = nlohmann::json::parse(read_text(folder / "manifest.json"));
  std::size_t files = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "small")) {
    EXPECT_LE(entry.file_size(), 300'000u) << entry.path();
    ++files;
  }
  EXPECT_GT(files, 0u);
  EXPECT_EQ(files, manifest.at("references").size());
}

TEST_F(References, ThatAreSmallAreWrittenWithTheirManifestAndCheckedAgainstIt) {
  const std::string config = "configs/smoke.json --set 'scenes.0.resolution=[32,16]'";
  const Outcome made = run("reference " + config + " --small");
  ASSERT_EQ(made.code, 0) << made.output;
  EXPECT_TRUE(contains(made.output, "references/small/checkerboard-")) << made.output;
  ASSERT_TRUE(fs::exists(root_ / "references/manifest.json"));
  fs::remove(root_ / "references" / rendered().at(0));
  EXPECT_EQ(run("reference " + config).code, 0);
  EXPECT_EQ(rendered().size(), 0u) << "the small one was used";
  for (const fs::directory_entry& entry : fs::directory_iterator(root_ / "references/small")) {
    std::ofstream(entry.path(), std::ios::app) << ' ';
  }
  const Outcome changed = run("run " + config + " --out out");
  EXPECT_EQ(changed.code, 5) << changed.output;
  EXPECT_TRUE(contains(changed.output, "manifest.json says")) << changed.output;
}

TEST_F(References, OfLightsWithoutExtentAreExactAndLeaveNothingToCompare) {
  write_file("points.json", kPointLights);
  write_file("exact.json", R"({
    "version": 1, "name": "exact", "baseline": "MIS", "spp": 4, "blocks": 2,
    "scenes": [{"name": "points", "file": "points.json", "camera_samples": 2,
                "reference": {"type": "exact_sum"}}],
    "methods": [{"label": "MIS", "estimator": "mis", "srl": 4},
                {"label": "PMC-HI", "estimator": "pmc_hi", "srl": "4-4"}]})");
  const Outcome outcome = run("run exact.json --out out");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_TRUE(contains(outcome.output, "exact sum, 2 spp")) << outcome.output;
  EXPECT_FALSE(contains(outcome.output, "warning")) << outcome.output;
  for (const EfficiencyRow& row : read_efficiency_rows(root_ / "out/efficiency.csv")) {
    EXPECT_EQ(row.verdict, Verdict::Exact) << row.label;
    EXPECT_EQ(row.err, 0.0) << row.label;
    EXPECT_EQ(row.variance, 0.0) << row.label;
    EXPECT_FALSE(row.eff.has_value()) << row.label;
  }
  const Outcome more = run("reference exact.json --add-spp 8");
  EXPECT_EQ(more.code, 0);
  EXPECT_TRUE(contains(more.output, "none were added")) << more.output;
}

TEST_F(References, ThatCannotBeExactAreRefusedByValidate) {
  const Outcome outcome =
      run("validate configs/smoke.json --set scenes.checkerboard.reference.type=exact_sum");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_TRUE(contains(outcome.output, "(rectangle)")) << outcome.output;
  EXPECT_TRUE(contains(outcome.output, "allowed here: \"auto\", \"sampled\"")) << outcome.output;
}

TEST_F(References, ThatAreNoisyAreNamedWithTheCommandThatLowersTheirShare) {
  const std::string config = "configs/smoke.json --set scenes.0.reference.spp=8";
  const Outcome noisy = run("run " + config + " --out noisy");
  ASSERT_EQ(noisy.code, 0) << noisy.output;
  // The largest of the numbers that are advised.
  std::string command;
  int most = 0;
  const std::string begin = "lower it with: penumbra ";
  for (auto at = noisy.output.find(begin); at != std::string::npos;
       at = noisy.output.find(begin, at + 1)) {
    const std::size_t from = at + begin.size();
    const std::string call = noisy.output.substr(from, noisy.output.find('\n', from) - from);
    const int spp = std::stoi(call.substr(call.rfind(' ')));
    if (spp > most) command = call;
    most = std::max(most, spp);
  }
  ASSERT_FALSE(command.empty()) << noisy.output;
  ASSERT_EQ(run(command).code, 0) << command;
  ASSERT_EQ(run("run " + config + " --out better").code, 0);
  for (const EfficiencyRow& row : read_efficiency_rows(root_ / "better/efficiency.csv")) {
    EXPECT_LT(row.reference_share.value_or(1.0), 0.1) << row.label << ", " << command;
  }
}

TEST_F(References, PicturesOfRunsAreThoseThatWereMeasured) {
  const Outcome outcome = run("run configs/smoke.json --out out --set blocks=5");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  const ExrFile reference = read_exr(root_ / "references" / rendered().at(0));
  const Image& half_a = reference.image("half_a");
  const Image& half_b = reference.image("half_b");
  const std::vector<RunRow> rows = read_run_rows(root_ / "out/measurements.csv").rows;
  ASSERT_EQ(rows.size(), 20u);
  for (const RunRow& row : rows) {
    const ExrFile picture = read_exr(root_ / "out/runs" / (row.run_id + ".exr"));
    const ImageMetrics metrics =
        image_metrics(picture.image().pixels, {half_a.pixels, half_b.pixels}, 0.01);
    EXPECT_DOUBLE_EQ(metrics.mse, row.mse.value());
    EXPECT_DOUBLE_EQ(metrics.relmse_trim.value(), row.relmse_trim.value());
    EXPECT_EQ(row.reference_spp, 64);
  }
  for (const EfficiencyRow& row : read_efficiency_rows(root_ / "out/efficiency.csv")) {
    // Both are E|x - mu|^2 by the same sums.
    EXPECT_NEAR(row.variance.value() + row.bias2.value(), row.err.value(), 1e-5 * *row.err);
    EXPECT_GT(row.p_eff_runs.value(), 0.0);
    EXPECT_TRUE(row.bias_smallest_p.has_value());
    EXPECT_TRUE(row.bias_tost == "shown" || row.bias_tost == "not shown") << row.bias_tost;
  }
}

TEST_F(References, PicturesOfRunsCanBeLeftOut) {
  const Outcome outcome =
      run("run configs/smoke.json --out out --set blocks=2 --set images.runs=false --set "
          "'scenes.0.resolution=[32,16]'");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_FALSE(fs::exists(root_ / "out/runs"));
  for (const EfficiencyRow& row : read_efficiency_rows(root_ / "out/efficiency.csv")) {
    EXPECT_FALSE(row.variance.has_value());
    EXPECT_TRUE(row.bias_tost.empty());
  }
}

}  // namespace
}  // namespace penumbra
