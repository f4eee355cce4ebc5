#pragma once

#include <filesystem>
#include <string>
#include <string_view>

/// Files that a scene refers to, as bytes.
namespace penumbra {

/// @throws InputError "file: error: ..." where something is at the path that is neither a file nor
/// a
///         pipe
void check_is_file(const std::filesystem::path& file);

/// Reads a whole file.
/// @throws InputError "file: error: ..." when it does not exist, or is a folder or a device
std::string read_bytes(const std::filesystem::path& file);

/// XXH3_128 of bytes; hexadecimal, 32 digits.
std::string hash_bytes(std::string_view bytes);

/// `hash_bytes` of a file's content, as TextureDescription::content_hash holds it.
/// @throws InputError as `read_bytes`
std::string hash_file(const std::filesystem::path& file);

}  // namespace penumbra
