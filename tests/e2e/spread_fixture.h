#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/e2e/command_line_fixture.h"
#include "tests/e2e/timeless_rows.h"

/// What the tests of runs that are spread over processes share.
namespace penumbra {

/// Six blocks, which are three pairs, of two cells on a tiny picture; no time budget, so that rows
/// repeat.
inline constexpr const char* kTinyConfig = R"({
  "version": 1, "name": "tiny", "baseline": "MIS", "spp": 2, "blocks": 6,
  "scenes": [{"name": "checkerboard", "resolution": [40, 24], "camera_samples": 2,
              "reference": {"estimator": "mis", "srl": 8, "spp": 16}}],
  "methods": [{"label": "MIS", "estimator": "mis", "srl": 4},
              {"label": "PMC-HI", "estimator": "pmc_hi", "srl": "2-6"}]})";

class SpreadRuns : public CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    write_file("tiny.json", kTinyConfig);
  }

  /// The bytes of all pictures in a folder, by name.
  static std::map<std::string, std::string> pictures(const fs::path& folder) {
    std::map<std::string, std::string> result;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      const std::string end = entry.path().extension();
      if (end == ".exr" || end == ".png") {
        result[entry.path().filename().string()] = read_text(entry.path());
      }
    }
    return result;
  }

  /// Expects the same rows but for times, in the same order, and the same bits of all pictures.
  void expect_same_results(const fs::path& folder, const fs::path& whole) const {
    EXPECT_EQ(timeless_rows(folder / "measurements.csv"),
              timeless_rows(whole / "measurements.csv"));
    EXPECT_EQ(first_attempts(folder), first_attempts(whole));
    for (const char* name : {"images", "runs"}) {
      const auto expected = pictures(whole / name);
      EXPECT_FALSE(expected.empty());
      // Not printed: they are long.
      EXPECT_TRUE(pictures(folder / name) == expected) << name << " of " << folder;
    }
  }

  /// Ids of the first attempts, in the order of the file.
  static std::vector<std::string> first_attempts(const fs::path& folder) {
    std::vector<std::string> ids;
    for (const RunRow& row : read_run_rows(folder / "measurements.csv").rows) {
      if (row.attempt == 0) ids.push_back(row.run_id);
    }
    return ids;
  }
};

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace penumbra
