// References: exact sums, the manifest of the small ones, advice on noise. The project is a folder
// of its own with scenes of a plane under point and area lights.

#include "harness/reference.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "harness/plan.h"
#include "harness/reference_manifest.h"
#include "harness/render.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

TEST(SppToAdd, BringsTheShareToFivePercent) {
  // The share falls as 1/spp: 64 x 20 % / 5 % = 256.
  EXPECT_EQ(spp_to_add(0.20, 64, 2), 192);
  EXPECT_EQ(spp_to_add(0.051, 64, 2), 4) << "1.28, in whole passes of both halves";
  EXPECT_EQ(spp_to_add(0.05, 64, 2), 0);
  EXPECT_EQ(spp_to_add(std::nullopt, 64, 2), 192) << "four times as many";
  EXPECT_EQ(spp_to_add(1e6, 1000, 4), 19999999000) << "more than an int holds";
}

class ReferenceTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::temp_directory_path() /
            ("penumbra_reference_" + std::string(test->name()) + std::to_string(::getpid()));
    fs::create_directories(root_ / "configs");
    write_scene("points",
                R"(, "spot_lights": [{"name": "lamp", "position": [-1, 1.1, 0],
                                      "direction": [0.5, -1, 0.1], "intensity": 5}])",
                "");
    write_scene("mixed", "",
                R"(, {"name": "panel", "type": "rectangle", "origin": [-0.5, 2, -0.5],
                      "edge_u": [1, 0, 0], "edge_v": [0, 0, 1], "material": "grey",
                      "emission": {"radiance": 2}})");
    ::setenv("PENUMBRA_ROOT", root_.c_str(), 1);
  }
  void TearDown() override {
    ::unsetenv("PENUMBRA_ROOT");
    fs::remove_all(root_);
  }

  // A grey plane with a block on it that throws shadows.
  void write_scene(const std::string& name, const std::string& more_lights,
                   const std::string& more_shapes) const {
    fs::create_directories(root_ / "scenes" / name);
    std::ofstream(root_ / "scenes" / name / "scene.json") << R"({
      "format": "penumbra-scene", "version": 1, "name": ")"
                                                          << name << R"(",
      "camera": {"position": [0, 2, 3], "look_at": [0, 0, 0], "up": [0, 1, 0],
                 "vertical_fov_deg": 40, "resolution": [24, 16]},
      "materials": {"grey": {"type": "lambert", "reflectance": 0.5}},
      "shapes": [{"name": "plane", "type": "rectangle", "origin": [-2, 0, 2], "edge_u": [4, 0, 0],
                  "edge_v": [0, 0, -4], "material": "grey"},
                 {"name": "ball", "type": "sphere", "center": [0.2, 0.3, 0], "radius": 0.3,
                  "material": "grey"})" << more_shapes << R"(],
      "point_lights": [{"name": "bulb", "position": [0.3, 1.7, 0.2], "intensity": [3, 2, 1]}])"
                                                          << more_lights << "}";
  }

  // The config must outlive what is loaded of it.
  ExperimentConfig config(const std::string& scene, const nlohmann::json& reference = {}) const {
    nlohmann::json json = {{"version", 1},
                           {"name", "test"},
                           {"baseline", "MIS"},
                           {"spp", 6},
                           {"scenes", {{{"name", scene}, {"camera_samples", 3}}}},
                           {"methods", {{{"label", "MIS"}, {"estimator", "mis"}, {"srl", 4}}}}};
    if (!reference.is_null()) json["scenes"][0]["reference"] = reference;
    std::ofstream(root_ / "configs/c.json") << json.dump(2);
    return load_config(root_ / "configs/c.json");
  }
  static LoadedScene load(const ExperimentConfig& config) {
    return load_scene(config.scenes[0], config.tile, config.quantity);
  }

  fs::path root_;
};

TEST_F(ReferenceTest, LightsWithoutExtentAreSummedUpExactly) {
  const ExperimentConfig c = config("points");
  const LoadedScene scene = load(c);
  const Reference r = provide_reference(scene, 1);
  EXPECT_TRUE(r.exact());
  EXPECT_EQ(r.spp, 3);
  EXPECT_EQ(r.half_a.pixels, r.half_b.pixels);
  const ReferenceNoise noise = reference_noise(r.halves());
  EXPECT_GT(noise.mean, 0.01);
  EXPECT_EQ(noise.variance, 0.0);
  EXPECT_EQ(noise.floor, 0.0);
  EXPECT_NE(describe("points", r).find("exact sum, 3 spp"), std::string::npos);
  const ExrFile file = read_exr(r.file);
  EXPECT_EQ(file.metadata.at("reference_type"), "exact_sum");
  EXPECT_NE(file.metadata.at("lineage").find("\"type\":\"exact_sum\""), std::string::npos);
}

// Every estimator. Twelve estimates are four at each shading point, whose mean is exact in binary;
// seven are not, and single pixels round to the next float.
TEST_F(ReferenceTest, ErrorAgainstAnExactSumIsZeroToTheRoundingOfFloat) {
  const ExperimentConfig c = config("points");
  const LoadedScene scene = load(c);
  const Reference r = provide_reference(scene, 1);
  for (const EstimatorEntry* entry : all_estimators()) {
    std::vector<ParamProblem> problems;
    RenderSettings settings;
    settings.estimator = entry;
    settings.params = resolve_params(entry->params(), {}, problems);
    const Srl srl = split_srl(16, entry->adaptive);
    settings.budget = {SamplerKind::Independent, srl.initial, srl.adaptive};
    settings.seed = 5;
    for (const int spp : {12, 7}) {
      settings.spp = spp;
      const Image image = render(*scene.scene, scene.points, settings).image();
      const ImageMetrics m = image_metrics(image.pixels, r.halves(), 0.01);
      const double rounding = spp == 12 ? 0.0 : 0x1p-24 * m.reference.mean;
      EXPECT_LE(std::sqrt(m.mse_naive), rounding) << entry->name << ", " << spp;
      EXPECT_EQ(m.mse, m.mse_naive) << entry->name << ", " << spp;
      EXPECT_EQ(m.reference_share.value_or(0.0), 0.0) << entry->name << ", " << spp;
    }
  }
}

TEST_F(ReferenceTest, DebiasedMseAgainstAnExactSumIsThePlainOne) {
  const ExperimentConfig c = config("points");
  const Reference r = provide_reference(load(c), 1);
  std::vector<Rgb> image = r.half_a.pixels;
  for (std::size_t p = 0; p < image.size(); p += 2) image[p] += Rgb(0.5f, 0.0f, 0.25f);
  const ImageMetrics m = image_metrics(image, r.halves(), 0.01);
  EXPECT_EQ(m.mse, m.mse_naive);
  EXPECT_NEAR(m.mse, (0.25 + 0.0625) / 6.0, 1e-6);
  EXPECT_EQ(m.reference_share.value(), 0.0);
}

TEST_F(ReferenceTest, ExactSumOfASceneWithOtherLightsIsAnInputError) {
  const ExperimentConfig c = config("mixed", {{"type", "exact_sum"}});
  try {
    load(c);
    FAIL() << "no error";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("scene \"mixed\""), std::string::npos) << text;
    EXPECT_NE(text.find("found \"panel\" (rectangle)"), std::string::npos) << text;
    EXPECT_EQ(text.find("bulb"), std::string::npos) << text;
    EXPECT_NE(text.find("allowed here: \"auto\", \"sampled\""), std::string::npos) << text;
  }
  const ExperimentConfig automatic = config("mixed");
  EXPECT_EQ(reference_type(load(automatic)), ReferenceType::Sampled);
}

TEST_F(ReferenceTest, SampledOneGivesWayToAnExactSum) {
  const ExperimentConfig sampled = config("points", {{"type", "sampled"}, {"spp", 6}});
  EXPECT_FALSE(provide_reference(load(sampled), 1).exact());
  const ExperimentConfig automatic = config("points");
  const Reference exact = provide_reference(load(automatic), 1);
  EXPECT_TRUE(exact.exact());
  // What a scene without sampled lights gives has no noise either way.
  EXPECT_TRUE(provide_reference(load(sampled), 1).exact());
}

TEST_F(ReferenceTest, AddingSamplesToAnExactSumChangesNothing) {
  const ExperimentConfig c = config("points");
  const LoadedScene scene = load(c);
  const Reference before = provide_reference(scene, 1);
  const auto written = fs::last_write_time(before.file);
  testing::internal::CaptureStderr();
  const Reference after = provide_reference(scene, 1, 12);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("none were added"), std::string::npos);
  EXPECT_EQ(after.spp, before.spp);
  EXPECT_EQ(fs::last_write_time(after.file), written);
}

TEST_F(ReferenceTest, SmallReferenceIsFoundThroughItsManifest) {
  const ExperimentConfig c = config("mixed", {{"spp", 12}});
  const LoadedScene scene = load(c);
  const Reference made = provide_reference(scene, 1);
  const fs::path copy = publish_small_reference(made.file);
  fs::remove(made.file);
  const Reference found = find_reference(scene).value();
  EXPECT_EQ(found.file, copy);
  EXPECT_EQ(found.half_a.pixels, made.half_a.pixels);
  const nlohmann::json manifest = nlohmann::json::parse(std::ifstream(reference_manifest()));
  ASSERT_EQ(manifest["references"].size(), 1u);
  const nlohmann::json& entry = manifest["references"][0];
  EXPECT_EQ(entry["id"], made.id);
  EXPECT_EQ(entry["scene"], "mixed");
  EXPECT_EQ(entry["resolution"], (nlohmann::json{24, 16}));
  EXPECT_EQ(entry["camera_samples"], 3);
  EXPECT_EQ(entry["type"], "sampled");
  EXPECT_EQ(entry["spp"], 12);
  EXPECT_EQ(entry["lineage"][0]["estimator"], "mis");
}

TEST_F(ReferenceTest, PublishingAgainReplacesTheEntry) {
  const ExperimentConfig mixed = config("mixed", {{"spp", 12}});
  const LoadedScene scene = load(mixed);
  publish_small_reference(provide_reference(scene, 1).file);
  const ExperimentConfig points = config("points");
  publish_small_reference(provide_reference(load(points), 1).file);
  publish_small_reference(provide_reference(scene, 1, 12).file);
  const nlohmann::json manifest = nlohmann::json::parse(std::ifstream(reference_manifest()));
  ASSERT_EQ(manifest["references"].size(), 2u);
  EXPECT_EQ(manifest["references"][0]["scene"], "mixed");
  EXPECT_EQ(manifest["references"][0]["spp"], 24);
  EXPECT_EQ(manifest["references"][1]["type"], "exact_sum");
  EXPECT_EQ(find_reference(scene).value().spp, 24);
}

TEST_F(ReferenceTest, MoreSamplesThanASmallReferenceHasGoIntoTheCache) {
  const ExperimentConfig c = config("mixed", {{"spp", 12}});
  const LoadedScene scene = load(c);
  const Reference made = provide_reference(scene, 1);
  const fs::path copy = publish_small_reference(made.file);
  fs::remove(made.file);
  const Reference more = provide_reference(scene, 1, 12);
  EXPECT_EQ(more.spp, 24);
  EXPECT_EQ(more.file, made.file);
  EXPECT_EQ(read_reference(copy, made.id).spp, 12) << "the file of the repository stays";
  EXPECT_EQ(find_reference(scene).value().spp, 24);
}

TEST_F(ReferenceTest, SmallReferenceThatIsNotTheManifestsIsRefused) {
  const ExperimentConfig c = config("mixed", {{"spp", 12}});
  const LoadedScene scene = load(c);
  const Reference made = provide_reference(scene, 1);
  const fs::path copy = publish_small_reference(made.file);
  const auto message = [&] {
    try {
      find_reference(scene);
    } catch (const ReferenceError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(message(), "no error");
  std::ofstream(copy, std::ios::app | std::ios::binary) << 'x';
  EXPECT_NE(message().find(copy.string() + ": its bytes have the hash"), std::string::npos)
      << message();
  EXPECT_NE(message().find(reference_manifest().string()), std::string::npos) << message();
  fs::remove(reference_manifest());
  EXPECT_NE(message().find("has no entry in " + reference_manifest().string()), std::string::npos)
      << message();
}

TEST_F(ReferenceTest, NoiseOfPixelsIsIndependentUnlessTheEstimatorShares) {
  const ExperimentConfig mis = config("mixed", {{"spp", 12}});
  EXPECT_EQ(provide_reference(load(mis), 1).correlated_side, 1);
  const ExperimentConfig alsd = config("mixed", {{"spp", 24}, {"estimator", "alsd"}, {"srl", 4}});
  EXPECT_EQ(provide_reference(load(alsd), 1).correlated_side, 16) << "the side of a tile";
}

}  // namespace
}  // namespace penumbra
