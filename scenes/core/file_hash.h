#pragma once

#include <filesystem>
#include <string>

namespace penumbra {

/// XXH3 hash of a file's bytes, 128 bits in 32 hexadecimal digits.
/// @throws InputError when the file can not be read
std::string file_hash(const std::filesystem::path& file);

}  // namespace penumbra
