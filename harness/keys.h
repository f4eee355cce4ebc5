#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

namespace penumbra {

/// 64-bit hash of several texts, separators included, so that ("ab", "c") and ("a", "bc") differ.
std::uint64_t hash_texts(std::initializer_list<std::string_view> texts);

/// The same as 16 hexadecimal digits: ids of cells, runs and references.
std::string hash_id(std::initializer_list<std::string_view> texts);

/// 128-bit hash of bytes as 32 hexadecimal digits. Source: XXH3.
std::string hash_of_bytes(std::span<const std::byte> bytes);

}  // namespace penumbra
