#include "harness/scene_store.h"

#include "harness/progress.h"
#include "scenes/core/scene_file.h"

namespace penumbra {

std::unique_ptr<Scene> load_scene(const std::filesystem::path& file,
                                  const std::optional<std::array<int, 2>>& resolution) {
  SceneDescription description = load_scene_description(file);
  for (const std::string& warning : description.warnings) warn(file.string() + ": " + warning);
  if (resolution) description.camera.resolution = *resolution;
  return std::make_unique<Scene>(description);
}

LoadedScene load_scene(const SceneConfig& config, int tile) {
  LoadedScene loaded;
  loaded.config = &config;
  loaded.scene = load_scene(config.file, config.resolution);
  loaded.points = make_shading_points(*loaded.scene, config.camera_samples, kCameraSeed, tile);
  return loaded;
}

}  // namespace penumbra
