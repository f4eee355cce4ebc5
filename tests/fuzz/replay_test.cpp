// Reads every kept input of the fuzz targets: the corpus, which leads through much of each reader,
// and the regressions, each of which was a finding once.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iterator>

#include "tests/fuzz/json_mutator.h"
#include "tests/fuzz/target.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

/// Longer is taken for a hang; the slowest kept input takes a small part of it.
constexpr std::chrono::seconds kMaxTime{10};

std::vector<fs::path> inputs_of(const char* kind, std::string_view target) {
  const fs::path folder = fs::path(PENUMBRA_SOURCE_DIR) / "tests/fuzz" / kind / target;
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class FuzzReplay : public testing::TestWithParam<std::string> {
 protected:
  void read(const fs::path& file) {
    // A crash leaves no other trace of the input.
    std::fprintf(stderr, "%s\n", file.c_str());
    const auto start = std::chrono::steady_clock::now();
    try {
      find_fuzz_target(GetParam())->read(sandbox_, bytes_of(file));
    } catch (const std::exception& escaped) {
      ADD_FAILURE() << file << ": an exception of a type that is not announced: " << escaped.what();
    }
    EXPECT_LT(std::chrono::steady_clock::now() - start, kMaxTime) << file;
  }

  Sandbox sandbox_;
};

TEST_P(FuzzReplay, EveryInputOfTheCorpusIsReadOrRefused) {
  const std::vector<fs::path> files = inputs_of("corpus", GetParam());
  EXPECT_FALSE(files.empty());
  for (const fs::path& file : files) read(file);
}

TEST_P(FuzzReplay, EveryFormerFindingIsReadOrRefused) {
  for (const fs::path& file : inputs_of("regressions", GetParam())) read(file);
}

std::vector<std::string> target_names() {
  std::vector<std::string> names;
  for (const FuzzTarget& target : fuzz_targets()) names.emplace_back(target.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Targets, FuzzReplay, testing::ValuesIn(target_names()),
                         [](const auto& target) { return target.param; });

TEST(JsonMutator, MakesOtherDocumentsOfWhichManyAreDifferent) {
  const std::string text = R"({"a": [1, 2, {"b": "text"}], "c": true, "d": null})";
  std::vector<std::string> results;
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    const auto result = mutate_json(text, {"a", "word"}, seed);
    ASSERT_TRUE(result.has_value());
    results.push_back(*result);
  }
  std::sort(results.begin(), results.end());
  EXPECT_GT(std::unique(results.begin(), results.end()) - results.begin(), 100);
  EXPECT_FALSE(mutate_json("{", {"a"}, 1).has_value());
}

}  // namespace
}  // namespace penumbra
