#include "harness/scene_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "harness/progress.h"
#include "harness/reference.h"
#include "scenes/core/error.h"
#include "scenes/core/scene_file.h"

namespace penumbra {
namespace {

constexpr int kMaxResolution = 16384;  // as the schemas have it

}  // namespace

SceneDescription load_description(const std::filesystem::path& file,
                                  const std::optional<std::array<int, 2>>& resolution) {
  SceneDescription description = load_scene_description(file);
  for (const std::string& warning : description.warnings) warn(file.string() + ": " + warning);
  if (!has_light(description)) warn(file.string() + ": there is no light: every estimate is 0");
  if (resolution) {
    for (const int side : *resolution) {
      if (side >= 1 && side <= kMaxResolution) continue;
      throw InputError(fmt::format("resolution: expected 1 to {} pixels a side, found {} x {}",
                                   kMaxResolution, (*resolution)[0], (*resolution)[1]));
    }
    description.camera.resolution = *resolution;
  }
  return description;
}

std::unique_ptr<Scene> load_scene(const std::filesystem::path& file,
                                  const std::optional<std::array<int, 2>>& resolution,
                                  const SceneOptions& options) {
  return std::make_unique<Scene>(load_description(file, resolution), options);
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
  reference_type(loaded);  // throws where the scene does not allow what the config asks for
  return loaded;
}

}  // namespace penumbra
