// An experiment on irradiance against its closed form: below a luminous sphere of radiance L every
// point of a plane receives pi L, whatever its material.
// Significance: each of the two intervals below excludes the truth with probability 1e-5; seeds are
// those of the configs, so the outcome repeats.

#include <gtest/gtest.h>

#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>

#include "harness/exr.h"
#include "harness/run_row.h"
#include "harness/statistics.h"
#include "tests/e2e/command_line_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;

constexpr double kFalseAlarm = 1e-5;
constexpr double kRadiance = 2.0;

class Irradiance : public CommandLine {
 protected:
  // The furnace from above, so that every pixel shows the plane, with another radiance.
  void SetUp() override {
    CommandLine::SetUp();
    json scene =
        json::parse(read_text(fs::path(PENUMBRA_SOURCE_DIR) / "scenes/furnace/scene.json"));
    scene["camera"] = {{"position", {0, 1.6, 0}},
                       {"look_at", {0, 0, 0}},
                       {"up", {0, 0, -1}},
                       {"vertical_fov_deg", 40},
                       {"resolution", {24, 24}}};
    scene["shapes"][1]["emission"]["radiance"] = kRadiance;
    write_file("above.json", scene.dump());
    write_file("irradiance.json", R"({
      "version": 1, "name": "irradiance", "baseline": "MIS", "spp": 4, "blocks": 8,
      "quantity": "irradiance",
      "scenes": [{"name": "above", "file": "above.json", "camera_samples": 2,
                  "reference": {"spp": 16, "srl": 8, "sampler": "independent"}}],
      "methods": [{"label": "MIS", "estimator": "mis", "srl": 8},
                  {"label": "PMC-HI", "estimator": "pmc_hi", "srl": "4-4"}]
    })");
  }
};

TEST_F(Irradiance, MeanOfEveryMethodIsPiTimesRadiance) {
  const Outcome outcome = run("run irradiance.json --out out");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  const double exact = std::numbers::pi * kRadiance;
  const std::vector<RunRow> rows = read_run_rows(root_ / "out/measurements.csv").rows;
  for (const char* label : {"MIS", "PMC-HI"}) {
    Welford means;
    for (const RunRow& row : rows) {
      if (row.label == label) means.add(*row.reference_mean + *row.mean_error);
    }
    const auto interval = mean_interval(means, 1.0 - kFalseAlarm);
    ASSERT_TRUE(interval.has_value());
    EXPECT_GT(interval->hi, exact) << label;
    EXPECT_LT(interval->lo, exact) << label;
    // An interval that holds everything would prove nothing.
    EXPECT_LT(interval->hi - interval->lo, 0.1 * exact) << label;
  }
}

TEST_F(Irradiance, FilesSayWhatTheyHoldAndReferencesAreApart) {
  const Outcome outcome = run("run irradiance.json --out out --set blocks=1");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  const json resolved = json::parse(read_text(root_ / "out/config.resolved.json"));
  EXPECT_EQ(resolved.at("quantity"), "irradiance");
  for (const fs::directory_entry& entry : fs::directory_iterator(root_ / "references")) {
    EXPECT_EQ(read_exr(entry.path()).metadata.at("quantity"), "irradiance");
  }
  const auto references = [&] {
    return std::distance(fs::directory_iterator(root_ / "references"), fs::directory_iterator());
  };
  EXPECT_EQ(references(), 1);
  ASSERT_EQ(run("reference irradiance.json --set quantity=radiance").code, 0);
  EXPECT_EQ(references(), 2) << "irradiance and radiance have references of their own";
  EXPECT_EQ(run("validate irradiance.json --set quantity=radiosity").code, 2);
}

TEST_F(Irradiance, RenderAddsNoEmissionOfTheLightInView) {
  for (const char* quantity : {"radiance", "irradiance"}) {
    const Outcome outcome = run("render furnace --resolution 32 18 --spp 1 --quantity " +
                                std::string(quantity) + " -o x.exr");
    ASSERT_EQ(outcome.code, 0) << outcome.output;
    const ExrFile file = read_exr(root_ / "x.exr");
    const bool same = file.image().pixels == file.image("reflected").pixels;
    EXPECT_EQ(same, std::string(quantity) == "irradiance") << quantity;
  }
  EXPECT_EQ(run("render furnace --quantity light -o x.exr").code, 2);
}

}  // namespace
}  // namespace penumbra
