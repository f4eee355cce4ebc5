#include "scenes/core/scene_file_lights.h"

#include <nlohmann/json.hpp>

#include "scenes/core/scene_file_shapes.h"

namespace penumbra {

using nlohmann::json;

namespace {

Vec3d read_direction(const json& value, const LightPlace& place, DiagnosticList& faults) {
  const Vec3d direction = read_vector(value["direction"]);
  if (direction.length() == 0.0) {
    const std::string pointer = child_pointer(place.pointer, "direction");
    faults.add(place.document.value_at(pointer), pointer, "must not be the zero vector");
  }
  return direction;
}

}  // namespace

PointLightDescription read_point_light(const json& value) {
  return {value["name"].get<std::string>(), read_vector(value["position"]),
          Vec3d(read_rgb(value["intensity"]))};
}

SpotLightDescription read_spot_light(const json& value, const LightPlace& place,
                                     DiagnosticList& faults) {
  SpotLightDescription light;
  light.name = value["name"].get<std::string>();
  light.position = read_vector(value["position"]);
  light.direction = read_direction(value, place, faults);
  light.intensity = Vec3d(read_rgb(value["intensity"]));
  light.inner_angle_deg = value.value("inner_angle_deg", light.inner_angle_deg);
  light.outer_angle_deg = value.value("outer_angle_deg", light.outer_angle_deg);
  if (light.inner_angle_deg >= light.outer_angle_deg) {
    const std::string pointer = child_pointer(place.pointer, "inner_angle_deg");
    faults.add(place.document.value_at(pointer), pointer,
               "must be less than outer_angle_deg, " + json(light.outer_angle_deg).dump() +
                   "; found " + json(light.inner_angle_deg).dump());
  }
  return light;
}

DirectionalLightDescription read_directional_light(const json& value, const LightPlace& place,
                                                   DiagnosticList& faults) {
  return {value["name"].get<std::string>(), read_direction(value, place, faults),
          read_rgb(value["irradiance"])};
}

}  // namespace penumbra
