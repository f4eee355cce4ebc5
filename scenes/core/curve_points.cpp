#include "scenes/core/curve_points.h"

#include <algorithm>
#include <array>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr std::uint32_t kSide = 32;  // 2^5, cells of the curve per side
constexpr std::uint32_t kCells = kSide * kSide;

// Lower corners of the cells in the order of the curve, in cells: x | y << 16.
// Source: Hilbert 1891; the turning of quadrants as in Warren, "Hacker's Delight", section 16.
constexpr std::array<std::uint32_t, kCells> hilbert_cells() {
  std::array<std::uint32_t, kCells> cells{};
  for (std::uint32_t d = 0; d < kCells; ++d) {
    std::uint32_t x = 0, y = 0;
    for (std::uint32_t side = 1, rest = d; side < kSide; side *= 2, rest /= 4) {
      const std::uint32_t right = 1u & (rest / 2);
      const std::uint32_t up = 1u & (rest ^ right);
      if (up == 0) {
        if (right == 1) {
          x = side - 1 - x;
          y = side - 1 - y;
        }
        const std::uint32_t swapped = x;
        x = y;
        y = swapped;
      }
      x += side * right;
      y += side * up;
    }
    cells[d] = x | y << 16;
  }
  return cells;
}

constexpr std::array<std::uint32_t, kCells> kHilbertCells = hilbert_cells();

// A place in a cell on the variates' grid of 2^-24, rounded down so that it stays below 1.
inline float in_cell(std::uint32_t cell, float place) noexcept {
  constexpr int kDigits = 24 - 5;  // that a cell's place keeps
  const auto low = static_cast<std::int32_t>(place * static_cast<float>(1 << kDigits));
  return static_cast<float>((static_cast<std::int32_t>(cell) << kDigits) + low) * 0x1p-24f;
}

}  // namespace

void place_along_curve(std::uint32_t first, std::uint32_t lanes, std::uint32_t count,
                       const Block<float>& position, VariateBlock& points,
                       std::size_t at) noexcept {
  PN_ASSERT(at + lanes <= kBlock && first + lanes <= count);
  // In double: a float's rounding could move the borders of the cells.
  const double cells_per_piece = static_cast<double>(kCells) / static_cast<double>(count);
  // No whole groups: the lanes behind the last hold points of the next run already.
  for (std::uint32_t i = 0; i < lanes; ++i) {
    const std::size_t lane = at + i;
    const double along = (static_cast<double>(static_cast<std::int32_t>(first + i)) +
                          static_cast<double>(position[lane])) *
                         cells_per_piece;
    const auto cell =
        std::min(static_cast<std::int32_t>(along), static_cast<std::int32_t>(kCells) - 1);
    const std::uint32_t corner = kHilbertCells[static_cast<std::size_t>(cell)];
    points.x[lane] = in_cell(corner & 0xffffu, points.x[lane]);
    points.y[lane] = in_cell(corner >> 16, points.y[lane]);
  }
}

}  // namespace penumbra
