#pragma once

#include <string>

#include "harness/config.h"

namespace penumbra {

/// The whole config as a JSON document that `load_config` reads back to the same experiment: every
/// default is written out, keys stand in the order of the structs. Scene files below the project's
/// folder are relative to it.
std::string resolved_json(const ExperimentConfig& config);

}  // namespace penumbra
