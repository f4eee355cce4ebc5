#pragma once

#include <cstdint>

#include "scenes/core/scene_description.h"

/// Random scenes from a seed, for properties that hold in every scene.
namespace penumbra::conformance {

/// Size of the images: a dozen shading points.
inline constexpr int kFuzzWidth = 4;
inline constexpr int kFuzzHeight = 3;

/// Sharpest lobes of scenes that are called rough: GGX alpha and Phong exponent (whose lobe of
/// exponent s is about as wide as one of alpha = sqrt(2 / (s + 2))).
inline constexpr float kRoughAlpha = 0.05f;
inline constexpr float kRoughExponent = 200.0f;

struct FuzzScene {
  std::uint64_t seed{0};
  SceneDescription description;
  bool rough{true};  ///< no lobe sharper than kRoughAlpha and kRoughExponent
};

/// A floor with 0 to 5 occluders (rectangles, spheres, meshes, turned at random) under 1 to 4
/// lights (rectangles, spheres, meshes of few and many triangles, at most one environment, points,
/// spots, directional ones), random materials down to
/// nearly specular ones, everything scaled by 1e-3 to 1e3 and moved by up to 1e3 times the scaled
/// unit. Lights do not touch each other or the occluders: where surfaces meet a light, the variance
/// of sampling its area has no bound.
FuzzScene fuzz_scene(std::uint64_t seed);

}  // namespace penumbra::conformance
