#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace penumbra {

/// Changes a JSON document in one to four places and keeps it JSON: mutations of bytes hardly ever
/// get past a parser. Numbers become extreme ones, values change their type, members and elements
/// are removed, copied or added.
/// @param words  keys and texts to choose from; not empty
/// @return nothing where `text` is not JSON or is nested deeply
std::optional<std::string> mutate_json(std::string_view text, const std::vector<std::string>& words,
                                       std::uint32_t seed);

}  // namespace penumbra
