#pragma once

#include "scenes/core/scene.h"

/// What the tests of rays and of scenes share.
namespace penumbra::test {

/// World to scene coordinates.
inline Vec3 to_scene(const Scene& scene, const Vec3d& world) {
  return Vec3((world - scene.traits().center) * scene.traits().scale);
}

/// Closest hit of one ray, in scene coordinates.
inline RayHit trace(const Scene& scene, const Vec3& origin, const Vec3& direction) {
  RayBatch batch(1);
  batch.add(origin, direction);
  scene.intersect(batch);
  return batch.hits[0];
}

}  // namespace penumbra::test
