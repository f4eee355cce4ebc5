#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "scenes/core/diagnostics.h"
#include "scenes/core/located_json.h"
#include "scenes/core/scene_description.h"

/// Materials of scene files.
namespace penumbra {

/// Reads a material that obeys the schema into one that has its name already.
/// @param pointer  of the value
void read_material(const nlohmann::json& value, const LocatedJson& document,
                   const std::string& pointer, MaterialDescription& material,
                   DiagnosticList& faults);

}  // namespace penumbra
