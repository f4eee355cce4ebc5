#pragma once

#include <filesystem>
#include <string_view>

namespace penumbra {

/// Replaces the file `path` by `bytes` as a whole: temporary file in the same folder, fsync,
/// rename. Whoever reads `path`, even after a crash or a full disk, sees the old file or the whole
/// new one.
/// @param path   the folder must exist
/// Errors: RunError with path and reason; the temporary file is removed and an older file at `path`
/// stays.
void write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace penumbra
