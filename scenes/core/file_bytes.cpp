#include "scenes/core/file_bytes.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <system_error>

#include "scenes/core/error.h"

namespace penumbra {

void check_is_file(const std::filesystem::path& file) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(file, ignored);
  if (std::filesystem::is_directory(status)) {
    throw InputError(file.string() + ": error: is a folder, expected a file");
  }
  // Devices may have no end. What does not exist is for the caller to report, with the reason.
  const bool may_be_read = std::filesystem::is_regular_file(status) ||
                           std::filesystem::is_fifo(status) || !std::filesystem::exists(status);
  if (!may_be_read) throw InputError(file.string() + ": error: is a device, expected a file");
}

std::string read_bytes(const std::filesystem::path& file) {
  check_is_file(file);
  errno = 0;
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  std::string bytes;
  if (const std::streamoff size = stream ? std::streamoff(stream.tellg()) : -1; size > 0) {
    bytes.resize(static_cast<std::size_t>(size));
    stream.seekg(0);
    stream.read(bytes.data(), size);
  }
  if (!stream) {
    const std::string reason = errno != 0 ? std::strerror(errno) : "unknown reason";
    throw InputError(file.string() + ": error: cannot be read: " + reason);
  }
  return bytes;
}

std::string hash_bytes(std::string_view bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  char text[33];
  std::snprintf(text, sizeof(text), "%016llx%016llx", static_cast<unsigned long long>(hash.high64),
                static_cast<unsigned long long>(hash.low64));
  return text;
}

std::string hash_file(const std::filesystem::path& file) { return hash_bytes(read_bytes(file)); }

}  // namespace penumbra
