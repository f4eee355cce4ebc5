#pragma once

#include <string>

#include "scenes/core/scene_description.h"

namespace penumbra {

/// How world units became scene units: scene = (world - center) * scale.
struct Normalisation {
  Vec3d center{0.0};
  double scale{1.0};     ///< a power of two, so that scaling by powers of two changes no digit
  double diagonal{0.0};  ///< of the scaled bounding box, in [sqrt(8), sqrt(32)) or so
};

/// Recentres and rescales a scene in double precision to a diagonal between 2.8 and 5.7. Radiance
/// is invariant.
Normalisation normalise(SceneDescription& scene);

/// Hash of all that decides the true image: geometry, materials, emission and camera, but no names;
/// 128 bits in hexadecimal.
std::string content_hash(const SceneDescription& scene);

}  // namespace penumbra
