#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace penumbra {

/// The keys and texts that a JSON schema knows, and `more`.
std::vector<std::string> words_of_schema(std::string_view schema,
                                         const std::vector<std::string>& more);

}  // namespace penumbra
