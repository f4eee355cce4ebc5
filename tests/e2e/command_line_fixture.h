#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>

/// What the tests of the executable share.
namespace penumbra {

namespace fs = std::filesystem;

/// How a call of the executable ended.
struct Outcome {
  int code{-1};
  std::string output;  ///< stdout and stderr
};

/// The bytes of a file.
inline std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// The executable in a project root of its own (PENUMBRA_ROOT with links to the shipped scenes and
/// configs), so that nothing is written into the source tree.
class CommandLine : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "penumbra-e2e-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    root_ = pattern;
    for (const char* folder : {"scenes", "configs"}) {
      fs::create_directory_symlink(fs::path(PENUMBRA_SOURCE_DIR) / folder, root_ / folder);
    }
    fs::create_directory(root_ / "references");
    setenv("PENUMBRA_ROOT", root_.c_str(), 1);
  }
  void TearDown() override { fs::remove_all(root_); }

  /// Runs `penumbra <arguments>` through the shell in the test's folder.
  Outcome run(const std::string& arguments) const {
    const fs::path out = root_ / "stdout.txt";
    const std::string command = "cd '" + root_.string() + "' && '" PENUMBRA_EXECUTABLE "' " +
                                arguments + " >'" + out.string() + "' 2>&1";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(out)};
  }

  /// Starts a run, sends it a signal once `rows` rows are on disk, and waits for its end.
  int run_and_signal(const std::string& config, const fs::path& out, std::size_t rows,
                     int signal) const {
    const pid_t child = start_run(config, out);
    for (int i = 0; i < 6000 && line_count(out / "measurements.csv") < rows + 1; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    kill(child, signal);
    return wait_for(child);
  }

  /// Starts a run and kills it after a time.
  int run_and_kill(const std::string& config, const fs::path& out, int delay_ms) const {
    const pid_t child = start_run(config, out);
    std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms));
    kill(child, SIGKILL);
    return wait_for(child);
  }

  /// Number of line ends in a file.
  static std::size_t line_count(const fs::path& file) {
    const std::string text = read_text(file);
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }

  /// Writes a file into the project root.
  fs::path write_file(const std::string& name, const std::string& text) const {
    std::ofstream(root_ / name) << text;
    return root_ / name;
  }

  /// The smoke config with more repetitions, so that a signal finds it in the middle.
  std::string smoke_config(const std::string& blocks) const {
    nlohmann::json json =
        nlohmann::json::parse(read_text(fs::path(PENUMBRA_SOURCE_DIR) / "configs/smoke.json"));
    json["blocks"] = std::stoi(blocks);
    return write_file("smoke.json", json.dump(2)).string();
  }

  fs::path root_;  ///< of the project, removed after the test

 private:
  pid_t start_run(const std::string& config, const fs::path& out) const {
    std::fflush(nullptr);  // or the child prints what is buffered once more
    const pid_t child = fork();
    if (child != 0) return child;
    if (std::freopen("/dev/null", "w", stdout) == nullptr ||
        std::freopen("/dev/null", "w", stderr) == nullptr || chdir(root_.c_str()) != 0) {
      _exit(99);
    }
    execl(PENUMBRA_EXECUTABLE, PENUMBRA_EXECUTABLE, "run", config.c_str(), "--out", out.c_str(),
          nullptr);
    _exit(99);
  }

  /// @return the exit code, or 128 + the signal
  static int wait_for(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
};

}  // namespace penumbra
