#include "harness/inspection_lights.h"

#include <cmath>

namespace penumbra {

Vec3d world_position(const Light& light, const SceneTraits& traits) {
  return Vec3d(light.center) / traits.scale + traits.center;
}

Vec3d world_intensity(const Light& light, const SceneTraits& traits) {
  return light.intensity / (traits.scale * traits.scale);
}

std::string_view type_name(LightType type) {
  switch (type) {
    case LightType::Rectangle:
      return "rectangle";
    case LightType::Sphere:
      return "sphere";
    case LightType::Mesh:
      return "mesh";
    case LightType::Environment:
      return "environment";
    case LightType::Spot:
      return "spot";
    case LightType::Directional:
      return "directional";
    case LightType::Point:
      break;
  }
  return "point";
}

double half_angle_deg(double depth) {
  return 2.0 * std::asin(std::sqrt(0.5 * depth)) * 180.0 / M_PI;
}

double world_area(const Light& light, const SceneTraits& traits) {
  return light.area / (traits.scale * traits.scale);
}

}  // namespace penumbra
