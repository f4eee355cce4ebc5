#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "harness/config.h"
#include "tests/unit/config_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;

class ConfigOverrides : public ConfigTest {};

TEST_F(ConfigOverrides, SetReplacesAddsAndAddresses) {
  const ExperimentConfig config =
      load(small_config(),
           {"spp=32", "scenes.0.camera_samples=1", "scenes.checkerboard.reference.spp=128",
            "methods.MIS.srl=8", "methods.PMC-HI.srl=2-6", "budget.time_cpu_s=3",
            "methods.MIS.params.heuristic=power2"});
  EXPECT_EQ(config.spp, 32);
  EXPECT_EQ(config.scenes[0].camera_samples, 1);
  EXPECT_EQ(config.scenes[0].reference.spp, 128);
  EXPECT_EQ(config.methods[0].srl[0].text(), "8");
  EXPECT_EQ(config.methods[1].srl[0].text(), "2-6");
  EXPECT_EQ(config.budget->times, std::vector<double>{3.0});
  EXPECT_EQ(config.methods[0].params.at("heuristic"),
            std::vector<ParamValue>{std::string("power2")});
}

TEST_F(ConfigOverrides, SetFindsLabelsWithDots) {
  json config = small_config();
  config["methods"][1]["label"] = "MIS.v2";
  EXPECT_EQ(load(config, {"methods.MIS.v2.srl=8"}).methods[1].srl[0].text(), "8");
}

TEST_F(ConfigOverrides, SetOfAnUnknownKeyNamesTheOption) {
  const std::string faults = faults_of(small_config(), {"blokcs=3"});
  EXPECT_TRUE(faults.starts_with(
      "--set blokcs=3: error: /blokcs: unknown key \"blokcs\"; did you mean \"blocks\"?"))
      << faults;
}

TEST_F(ConfigOverrides, SetOfAnUnknownLabelSuggests) {
  EXPECT_EQ(faults_of(small_config(), {"methods.PMC_HI.srl=8"}),
            "--set methods.PMC_HI.srl=8: error: /methods: unknown element \"PMC_HI\"; did you mean "
            "\"PMC-HI\"? (allowed: MIS, PMC-HI)");
}

TEST_F(ConfigOverrides, SetBeyondAnArrayIsRefused) {
  EXPECT_EQ(
      faults_of(small_config(), {"scenes.3.camera_samples=8"}),
      "--set scenes.3.camera_samples=8: error: /scenes: element 3 does not exist; there are 1, "
      "counted from 0");
}

TEST_F(ConfigOverrides, SetBelowAScalarIsRefused) {
  EXPECT_EQ(faults_of(small_config(), {"spp.x=1"}),
            "--set spp.x=1: error: /spp: has no keys; it is number 8");
}

TEST_F(ConfigOverrides, SetWithoutAValueIsRefused) {
  EXPECT_EQ(faults_of(small_config(), {"spp"}), "--set spp: error: expected key.path=value");
}

TEST_F(ConfigOverrides, SetIsCheckedLikeTheFile) {
  EXPECT_EQ(faults_of(small_config(), {"blocks=0"}),
            "--set blocks=0: error: /blocks: expected an integer in [1, 10000], found 0");
}

}  // namespace
}  // namespace penumbra
