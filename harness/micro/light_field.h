#pragma once

#include <memory>

#include "scenes/core/scene.h"

/// Scenes made for one kernel, with a shading point under its lights.
namespace penumbra::micro {

/// A scene and a point of it.
struct LightField {
  std::unique_ptr<Scene> scene;
  ShadingPoint point;
};

/// The floor alone, around the origin, for lights to be added.
SceneDescription floor_scene();
/// Loads such a scene; its point is the origin, seen from above.
LightField finish_scene(SceneDescription description);

/// Rectangles in a regular grid above a diffuse floor, all of which face the point and are seen
/// from it whole.
LightField make_light_field(int lights);

/// One light alone above a diffuse floor.
/// @param shape  in the box [-1, 1]^2 x [1, 3]; the point is the origin
LightField make_single_light(const Shape& shape);

/// A sky of 64 x 32 texels, no two alike, over a diffuse floor.
LightField make_sky();

/// A sphere of n rings: 4 n (n - 1) triangles.
TriangleMeshShape sphere_mesh(int rings);

}  // namespace penumbra::micro
