#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "scenes/core/located_json.h"
#include "scenes/core/scene_description.h"

/// The lights without extent of a scene file; a part of scene_file.cpp. Every `value` obeys the
/// schema.
namespace penumbra {

/// Where a light stands in its file, for messages.
struct LightPlace {
  const LocatedJson& document;
  std::string pointer;  ///< JSON pointer of the light
};

PointLightDescription read_point_light(const nlohmann::json& value);

/// @param faults  a direction of zero; an inner angle that is not below the outer one
SpotLightDescription read_spot_light(const nlohmann::json& value, const LightPlace& place,
                                     DiagnosticList& faults);

/// @param faults  a direction of zero
DirectionalLightDescription read_directional_light(const nlohmann::json& value,
                                                   const LightPlace& place, DiagnosticList& faults);

}  // namespace penumbra
