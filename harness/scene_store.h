#pragma once

#include <memory>
#include <string>
#include <vector>

#include "harness/config.h"
#include "scenes/core/scene.h"

namespace penumbra {

/// Seed of the camera samples: a constant, because the shading points are part of a scene's truth.
inline constexpr std::uint64_t kCameraSeed = 0x70656e756d627261;

/// A scene of an experiment with its shading points.
struct LoadedScene {
  const SceneConfig* config{nullptr};
  std::unique_ptr<Scene> scene;
  std::vector<std::string> material_names;  ///< [ShadingPoint::material]; the material of
                                            ///< irradiance is not among them
  ShadingPoints points;
};

/// Reads a scene or model file, with another resolution where one is given; reports its warnings.
SceneDescription load_description(const std::filesystem::path& file,
                                  const std::optional<std::array<int, 2>>& resolution);

/// Reads and loads it.
std::unique_ptr<Scene> load_scene(const std::filesystem::path& file,
                                  const std::optional<std::array<int, 2>>& resolution,
                                  const SceneOptions& options = {});

/// Loads one scene of an experiment and makes its shading points.
/// @param tile  side of a tile [pixels]
/// @throws InputError when the scene does not allow the reference that the config asks for
LoadedScene load_scene(const SceneConfig& config, int tile, Quantity quantity);

}  // namespace penumbra
