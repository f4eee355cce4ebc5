#pragma once

#include <string_view>

namespace penumbra {

/// configs/experiment.schema.json, the JSON Schema (draft 7) of experiments; the build embeds the
/// file.
extern const std::string_view kExperimentSchemaJson;

}  // namespace penumbra
