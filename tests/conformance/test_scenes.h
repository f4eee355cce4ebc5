#pragma once

#include <memory>
#include <string>
#include <vector>

#include "scenes/core/scene.h"
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

/// `diffuse`: a floor and two occluders under two rectangles. `glossy`: a Phong floor and a rough
/// conductor under a rectangle, a sphere and a mesh. `sky`: an environment, a point light and a
/// rectangle over diffuse and mixed materials. Made once per process.
const std::vector<std::unique_ptr<TestScene>>& test_scenes();

}  // namespace penumbra::conformance
