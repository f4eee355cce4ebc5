#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "tests/models/model_fixture.h"

namespace penumbra {

enum class PlyBytes { Ascii, Little, Big };

/// A pyramid over the unit square with apex (0.5, 0.5, 2): x y z nx ny nz s t per vertex, one
/// quadrilateral and four triangles.
inline std::string ply_pyramid(PlyBytes format) {
  const std::vector<std::array<float, 8>> vertices{{0, 0, 0, 0, 0, -1, 0, 0},
                                                   {1, 0, 0, 0, 0, -1, 1, 0},
                                                   {1, 1, 0, 0, 0, -1, 1, 1},
                                                   {0, 1, 0, 0, 0, -1, 0, 1},
                                                   {0.5f, 0.5f, 2, 0, 0, 1, 0.5f, 0.5f}};
  const std::vector<std::vector<std::int32_t>> faces{
      {3, 2, 1, 0}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  std::string file = std::string("ply\nformat ") +
                     (format == PlyBytes::Ascii    ? "ascii"
                      : format == PlyBytes::Little ? "binary_little_endian"
                                                   : "binary_big_endian") +
                     " 1.0\nelement vertex 5\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "s", "t"}) {
    file += std::string("property float ") + name + "\n";
  }
  file += "element face 5\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](auto value) {
    if (format == PlyBytes::Ascii) {
      std::string text = std::to_string(value);
      if (text.find('.') != std::string::npos) text.erase(text.find_last_not_of('0') + 1);
      file += text + " ";
      return;
    }
    std::array<char, sizeof(value)> bytes{};
    std::memcpy(bytes.data(), &value, sizeof(value));
    if (format == PlyBytes::Big) std::reverse(bytes.begin(), bytes.end());
    file.append(bytes.data(), bytes.size());
  };
  const auto end_line = [&] {
    if (format == PlyBytes::Ascii) file.back() = '\n';
  };
  for (const auto& vertex : vertices) {
    for (const float value : vertex) put(value);
    end_line();
  }
  for (const auto& face : faces) {
    put(static_cast<std::uint8_t>(face.size()));
    for (const std::int32_t corner : face) put(corner);
    end_line();
  }
  return file;
}

}  // namespace penumbra
