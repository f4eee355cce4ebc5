#pragma once

#include "scenes/core/vec.h"

namespace penumbra {

/// Values of a material's textures at one shading point: factors on the material's own (see
/// MaterialDescription). Looked up once, when the shading points are made; no estimate sees a
/// texture.
struct SurfaceValues {
  Rgb reflectance{1.0f};
  float roughness{1.0f};
  float metallic{1.0f};
};

}  // namespace penumbra
