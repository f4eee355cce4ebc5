#pragma once

#include <nlohmann/json_fwd.hpp>

#include "harness/gate/gate_config.h"

namespace penumbra {

/// The section "gate" of a config with all defaults.
nlohmann::ordered_json gate_config_json(const GateConfig& gate);

/// Reads it; values of another type are left at their defaults, because the schema reports them.
GateConfig gate_config_of(const nlohmann::json& section);

}  // namespace penumbra
