#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/config.h"
#include "scenes/core/error.h"

/// What the tests of configs share.
namespace penumbra {

/// A project of its own with the scenes "checkerboard" (900 x 600 pixels) and "small" (no
/// resolution given).
class ConfigTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    root_ = std::filesystem::temp_directory_path() /
            ("penumbra_config_" + std::string(test->name()) + "_" + std::to_string(::getpid()));
    std::filesystem::create_directories(root_ / "configs");
    std::filesystem::create_directories(root_ / "scenes/checkerboard");
    std::filesystem::create_directories(root_ / "scenes/small");
    std::filesystem::create_directories(root_ / "scenes/core");
    write("scenes/checkerboard/scene.json", R"({"camera": {"resolution": [900, 600]}})");
    write("scenes/small/scene.json", "{}");
    ::setenv("PENUMBRA_ROOT", root_.c_str(), 1);
  }

  void TearDown() override {
    ::unsetenv("PENUMBRA_ROOT");
    std::filesystem::remove_all(root_);
  }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(root_ / name) << text;
    return root_ / name;
  }

  ExperimentConfig load(const nlohmann::json& config,
                        const std::vector<std::string>& overrides = {}) const {
    return load_config(write("configs/c.json", config.dump(2)), overrides);
  }

  /// The errors, one per line, without the folder of the config.
  std::string faults_of_text(const std::string& text,
                             const std::vector<std::string>& overrides = {}) const {
    const std::filesystem::path file = write("configs/c.json", text);
    try {
      load_config(file, overrides);
    } catch (const InputError& error) {
      std::string message = error.what();
      const std::string folder = file.parent_path().string() + "/";
      for (auto at = message.find(folder); at != std::string::npos; at = message.find(folder)) {
        message.erase(at, folder.size());
      }
      return message;
    }
    return "no error";
  }

  std::string faults_of(const nlohmann::json& config,
                        const std::vector<std::string>& overrides = {}) const {
    return faults_of_text(config.dump(2), overrides);
  }

  /// Expects exactly one error, at this pointer and with this message.
  void expect_fault(const nlohmann::json& config, const std::string& pointer,
                    const std::string& message) const {
    const std::string faults = faults_of(config);
    EXPECT_EQ(std::count(faults.begin(), faults.end(), '\n'), 0) << faults;
    EXPECT_NE(faults.find("error: " + pointer + ": " + message), std::string::npos) << faults;
  }

  std::filesystem::path root_;
};

/// A valid config to be spoilt by each test.
inline nlohmann::json small_config() {
  return nlohmann::json::parse(R"({
    "version": 1, "name": "test", "baseline": "MIS", "spp": 8,
    "scenes": [{"name": "checkerboard"}],
    "methods": [{"label": "MIS", "estimator": "mis", "srl": 16},
                {"label": "PMC-HI", "estimator": "pmc_hi", "srl": "4-12", "params": {"population": [8, 16]}}]
  })");
}

}  // namespace penumbra
