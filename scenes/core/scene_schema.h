#pragma once

#include <string_view>

namespace penumbra {

/// scenes/scene.schema.json, the JSON Schema (draft 7) of scene files; the build embeds the file.
extern const std::string_view kSceneSchemaJson;

}  // namespace penumbra
