#include "harness/image_file.h"

#include <fmt/format.h>

namespace penumbra {

std::string slug(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (plain || c == '.' || c == '_') {
      result += c;
    } else if (!result.empty() && result.back() != '-') {
      result += '-';
    }
  }
  while (!result.empty() && result.back() == '-') result.pop_back();
  return result;
}

std::filesystem::path image_file(const std::filesystem::path& folder, const std::string& scene,
                                 const Cell& cell, const std::string& suffix) {
  return folder / "images" /
         fmt::format("{}-{}-{}-{}{}", slug(scene), slug(cell.label), to_string(cell.sampler),
                     cell.id.substr(0, 6), suffix);
}

}  // namespace penumbra
