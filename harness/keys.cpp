#include "harness/keys.h"

#define XXH_INLINE_ALL
#include <fmt/format.h>
#include <xxhash.h>

namespace penumbra {

std::uint64_t hash_texts(std::initializer_list<std::string_view> texts) {
  std::string joined;
  for (const std::string_view text : texts) {
    joined += fmt::format("{}:", text.size());
    joined += text;
  }
  return XXH3_64bits(joined.data(), joined.size());
}

std::string hash_id(std::initializer_list<std::string_view> texts) {
  return fmt::format("{:016x}", hash_texts(texts));
}

std::string hash_of_bytes(std::span<const std::byte> bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace penumbra
