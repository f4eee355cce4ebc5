#include "harness/scene_store.h"

#include <sys/resource.h>

#include <utility>

#include "harness/clocks.h"
#include "harness/progress.h"
#include "scenes/core/scene_file.h"

namespace penumbra {

SceneDescription load_description(const std::filesystem::path& file,
                                  const std::optional<std::array<int, 2>>& resolution) {
  SceneDescription description = load_scene_description(file);
  for (const std::string& warning : description.warnings) warn(file.string() + ": " + warning);
  if (resolution) description.camera.resolution = *resolution;
  return description;
}

std::size_t peak_resident_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

std::unique_ptr<Scene> load_scene(const std::filesystem::path& file,
                                  const std::optional<std::array<int, 2>>& resolution,
                                  const SceneOptions& options, LoadTimes* times) {
  const Stopwatch watch;
  SceneDescription description = load_description(file, resolution);
  const double read_s = watch.wall_s();
  auto scene = std::make_unique<Scene>(std::move(description), options);
  if (times != nullptr) {
    *times = {read_s, watch.wall_s() - read_s, scene->traits().ray_scene_build_s,
              peak_resident_bytes()};
  }
  return scene;
}

LoadedScene load_scene(const SceneConfig& config, int tile, Quantity quantity) {
  SceneDescription description = load_description(config.file, config.resolution);
  LoadedScene loaded;
  loaded.config = &config;
  for (const MaterialDescription& material : description.materials) {
    loaded.material_names.push_back(material.name);
  }
  loaded.scene = std::make_unique<Scene>(std::move(description));
  loaded.points =
      make_shading_points(*loaded.scene, config.camera_samples, kCameraSeed, tile, quantity);
  return loaded;
}

}  // namespace penumbra
