#pragma once

#include <memory>
#include <string>
#include <vector>

#include "scenes/core/scene.h"
#include "scenes/core/scene_description.h"
#include "scenes/core/shading_point.h"

/// Three small scenes that together hold every kind of light and material.
namespace penumbra::conformance {

/// Side of the square images [pixels].
inline constexpr int kSide = 32;

/// A loaded scene with the shading points of its image, one per pixel.
struct TestScene {
  std::string name;  ///< a part of a test's name
  Scene scene;
  ShadingPoints points;
  /// Estimates per pixel and replicate at which an estimator that is not very noisy shows an error
  /// of 2 % (self_test.cpp, agreement_test.cpp).
  int spp{1};
};

struct NamedDescription {
  std::string name;
  SceneDescription description;
  int spp{1};  ///< as TestScene::spp
};

/// @param name  distinguishes the caches and seeds of scenes
std::unique_ptr<TestScene> load(std::string name, const SceneDescription& description, int spp,
                                const SceneOptions& options = {});

/// What `test_scenes` are made from.
std::vector<NamedDescription> test_descriptions();

/// `diffuse`: a floor and two occluders under two rectangles. `glossy`: a Phong floor and a rough
/// conductor under a rectangle, a sphere and a mesh. `sky`: an environment, a point light and a
/// rectangle over diffuse and mixed materials. Made once per process.
const std::vector<std::unique_ptr<TestScene>>& test_scenes();

}  // namespace penumbra::conformance
