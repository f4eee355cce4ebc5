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

std::string read_bytes(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    throw InputError(file.string() + ": error: is a folder, expected a file");
  }
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
