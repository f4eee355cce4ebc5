#pragma once

#include <string_view>

namespace penumbra {

/// configs/micro.schema.json, the JSON Schema (draft 7) of the microbenchmarks' config; the build
/// embeds the file.
extern const std::string_view kMicroSchemaJson;

}  // namespace penumbra
