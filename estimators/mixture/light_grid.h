#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scenes/core/light.h"

/// Which of many lights a direction can meet, by a grid over directions: evaluating the density of
/// every light for every direction costs the square of their number.
namespace penumbra {

/// The lights that can contribute at a point, sorted into cells of the sphere of directions: slices
/// of equal height along z, cut into equal shares of a turn.
class LightGrid {
 public:
  /// @param lights  most lights that `build` is given
  explicit LightGrid(std::size_t lights);

  /// Lists each light in the cells that its cone of directions touches; allocates nothing.
  void build(std::span<const LightProposal> lights) noexcept;

  /// Calls visit(l) in ascending order for every light whose density along the unit vector w can be
  /// positive, and for some more.
  template <typename Visit>
  void for_each(const Vec3& w, Visit visit) const noexcept {
    const std::size_t c = cell(band(w.z), sector(turn(w.x, w.y)));
    const std::uint32_t* at = &listed_[first_[c]];
    const std::uint32_t* end = &listed_[first_[c + 1]];
    const std::uint32_t* everywhere = wide_.data();
    const std::uint32_t* everywhere_end = everywhere + wide_.size();
    while (at != end && everywhere != everywhere_end) {
      visit(*at < *everywhere ? *at++ : *everywhere++);
    }
    while (at != end) visit(*at++);
    while (everywhere != everywhere_end) visit(*everywhere++);
  }

 private:
  static constexpr int kBands = 32;
  static constexpr int kSectors = 64;
  static constexpr std::size_t kCells = std::size_t{kBands} * kSectors;
  /// A light that touches more cells is visited for every direction.
  static constexpr int kMaxCells = 64;

  /// Cells [band, last_band] x `sectors` from `sector` on, round the turn.
  struct Range {
    int band{0}, last_band{kBands - 1};
    int sector{0}, sectors{kSectors};
  };

  static Range range(const DirectionCone& cone) noexcept;
  static int band(float z) noexcept {
    if (!(z > -1.0f)) return 0;  // also what is no number
    const float b = (z + 1.0f) * (0.5f * kBands);
    return b < kBands ? static_cast<int>(b) : kBands - 1;
  }
  /// A quantity that grows with the azimuth, in [0, 4].
  static float turn(float x, float y) noexcept {
    const float length = std::abs(x) + std::abs(y);
    if (!(length > 0.0f)) return 0.0f;
    const float share = y / length;
    return x < 0.0f ? 2.0f - share : share >= 0.0f ? share : 4.0f + share;
  }
  static int sector(float turn) noexcept {
    const int s = static_cast<int>(turn * (0.25f * kSectors));
    return s < kSectors ? s : kSectors - 1;
  }
  static std::size_t cell(int band, int sector) noexcept {
    return static_cast<std::size_t>(band * kSectors + sector);
  }
  template <typename Visit>
  static void for_each_cell(const Range& r, Visit visit) noexcept {
    for (int b = r.band; b <= r.last_band; ++b) {
      for (int s = 0; s < r.sectors; ++s) visit(cell(b, (r.sector + s) % kSectors));
    }
  }

  std::vector<Range> ranges_;                      // [light]
  std::vector<std::uint32_t> wide_;                // lights visited for every direction
  std::vector<std::uint32_t> listed_;              // lights of cell 0, cell 1, ...
  std::array<std::uint32_t, kCells + 2> first_{};  // [cell] in listed_
};

}  // namespace penumbra
