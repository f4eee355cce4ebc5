// Which scenes map OpenImageIO into the program.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "scenes/core/module.h"
#include "scenes/core/scene.h"
#include "scenes/core/scene_file.h"
#include "scenes/core/scene_file_model.h"
#include "tests/support/image_files.h"

namespace penumbra {
namespace {

enum Exit { kNotMapped = 10, kMapped = 11, kContradiction = 12 };

/// Ends the process with what it has mapped after it loaded a scene and made its points. To be run
/// in a process of its own: a module stays open.
[[noreturn]] void load_and_exit(const std::filesystem::path& file) {
  SceneDescription description = load_scene_description(file);
  description.camera.resolution = {16, 9};
  const Scene scene(description);
  make_shading_points(scene, 1, 1, 16);
  std::ifstream maps("/proc/self/maps");
  bool mapped = false;
  bool importers = module_is_open("models");  // no scene here reads a model file
  for (std::string line; std::getline(maps, line);) {
    mapped = mapped || line.find("OpenImageIO") != std::string::npos;
    importers = importers || line.find("libassimp") != std::string::npos ||
                line.find("libtinygltf") != std::string::npos;
  }
  if (mapped != module_is_open("images") || importers) _exit(kContradiction);
  _exit(mapped ? kMapped : kNotMapped);
}

class ImageMaps : public testing::Test {
 protected:
  // Runs the statement in a fresh process.
  void SetUp() override {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    unsetenv(kModelsVariable);  // real models could bring images
  }
};

TEST_F(ImageMaps, ScenesWithoutImagesDoNotMapOpenImageIo) {
  int without = 0;
  int with = 0;
  for (const auto& folder :
       std::filesystem::directory_iterator(std::filesystem::path(PENUMBRA_SOURCE_DIR) / "scenes")) {
    const std::filesystem::path file = folder.path() / "scene.json";
    if (!std::filesystem::exists(file)) continue;
    const std::string text = test::read_bytes(file);
    const bool has_images =
        text.find(".png\"") != std::string::npos || text.find(".exr\"") != std::string::npos;
    EXPECT_EXIT(load_and_exit(file), testing::ExitedWithCode(has_images ? kMapped : kNotMapped), "")
        << file;
    ++(has_images ? with : without);
  }
  EXPECT_GE(without, 8) << "the generated scenes among them";
  EXPECT_GE(with, 1) << "positive control: the gallery";
}

}  // namespace
}  // namespace penumbra
