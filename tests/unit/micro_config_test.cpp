#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "harness/micro/micro_config.h"
#include "harness/project_root.h"
#include "scenes/core/error.h"

namespace penumbra::micro {
namespace {

namespace fs = std::filesystem;

class MicroConfigFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    file_ = fs::temp_directory_path() / (std::string("penumbra-micro-") + test->name() + ".json");
  }
  void TearDown() override { fs::remove(file_); }

  const fs::path& write(const std::string& text) {
    std::ofstream(file_) << text;
    return file_;
  }
  std::string fault_of(const std::string& text) {
    try {
      load_micro_config(write(text));
    } catch (const InputError& e) {
      return e.what();
    }
    return {};
  }

  fs::path file_;
};

TEST_F(MicroConfigFile, ShippedConfigsAreValid) {
  for (const char* name : {"micro.json", "micro_quick.json"}) {
    const MicroConfig config = load_micro_config(project_root() / "configs" / name);
    EXPECT_FALSE(config.scenes.empty()) << name;
    EXPECT_EQ(config.hash.size(), 16u) << name;
  }
}

TEST_F(MicroConfigFile, ValuesReachTheirPlacesAndOthersKeepTheirDefaults) {
  const MicroConfig config = load_micro_config(write(
      R"({"version": 1, "seed": 3, "scenes": ["buddha"], "adapt": {"populations": [64, 4]},
          "bsdf": {"alphas": [0.25]}, "shares": {"srl": [8], "rounds": 3}})"));
  EXPECT_EQ(config.seed, 3u);
  EXPECT_EQ(config.scenes, std::vector<std::string>{"buddha"});
  EXPECT_EQ(config.populations, (std::vector<int>{4, 64}));
  EXPECT_EQ(config.alphas, std::vector<float>{0.25f});
  EXPECT_EQ(config.shares_srl, std::vector<int>{8});
  EXPECT_EQ(config.components, MicroConfig{}.components);
}

TEST_F(MicroConfigFile, UnknownKeyNamesItsPlace) {
  const std::string fault = fault_of("{\"version\": 1,\n  \"adapt\": {\"population\": [4]}}");
  EXPECT_NE(fault.find(file_.string() + ":2:"), std::string::npos) << fault;
  EXPECT_NE(fault.find("population"), std::string::npos) << fault;
}

TEST_F(MicroConfigFile, SizeOutOfRangeIsRefusedWithItsRange) {
  const std::string fault = fault_of(R"({"version": 1, "adapt": {"components": [2]}})");
  EXPECT_NE(fault.find("/adapt/components/0"), std::string::npos) << fault;
  EXPECT_NE(fault.find("3"), std::string::npos) << fault;
}

TEST_F(MicroConfigFile, UnknownSceneIsRefusedWithASuggestion) {
  const std::string fault = fault_of(R"({"version": 1, "scenes": ["budda"]})");
  EXPECT_NE(fault.find("did you mean \"buddha\""), std::string::npos) << fault;
}

TEST_F(MicroConfigFile, CommentsDoNotChangeTheHash) {
  const std::string plain = load_micro_config(write(R"({"version": 1})")).hash;
  EXPECT_EQ(load_micro_config(write("// why\n{ \"version\": 1 }\n")).hash, plain);
  EXPECT_NE(load_micro_config(write(R"({"version": 1, "seed": 8})")).hash, plain);
}

}  // namespace
}  // namespace penumbra::micro
