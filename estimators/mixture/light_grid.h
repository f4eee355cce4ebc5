#pragma once

#include <algorithm>
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
/// of equal height along z, cut into equal shares of a turn. The number of cells grows with that of
/// lights, so that a direction meets few of however many.
class LightGrid {
 public:
  /// @param lights  most lights that `build` is given; settles the number of cells
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
  /// Fewest slices. Cells are about twice as wide as high at the equator.
  static constexpr int kMinBands = 32;
  /// Fewest cells per light. Fewer make directions meet more lights of neighbouring cells, which
  /// cost more than building the cells saves.
  static constexpr std::size_t kCellsPerLight = 8;
  /// Room in the lists per light.
  static constexpr std::size_t kListedPerLight = 64;
  /// A light that touches a larger share of the cells than 1/kLeastShare is visited for every
  /// direction.
  static constexpr std::size_t kLeastShare = 32;

  /// Cells [band, last_band] x `sectors` from `sector` on, round the turn.
  struct Range {
    int band, last_band;
    int sector, sectors;

    std::size_t cells() const noexcept {
      return static_cast<std::size_t>(last_band - band + 1) * static_cast<std::size_t>(sectors);
    }
  };

  static int bands_for(std::size_t lights) noexcept;
  Range range(const DirectionCone& cone) const noexcept;
  int band(float z) const noexcept {
    if (!(z > -1.0f)) return 0;  // also what is no number
    return std::min(static_cast<int>((z + 1.0f) * half_bands_), bands_ - 1);
  }
  /// A quantity that grows with the azimuth, in [0, 4].
  static float turn(float x, float y) noexcept {
    const float length = std::abs(x) + std::abs(y);
    if (!(length > 0.0f)) return 0.0f;
    const float share = y / length;
    return x < 0.0f ? 2.0f - share : share >= 0.0f ? share : 4.0f + share;
  }
  int sector(float turn) const noexcept {
    return std::min(static_cast<int>(turn * quarter_sectors_), sectors_ - 1);
  }
  std::size_t cell(int band, int sector) const noexcept {
    return static_cast<std::size_t>(band) * static_cast<std::size_t>(sectors_) +
           static_cast<std::size_t>(sector);
  }
  template <typename Visit>
  void for_each_cell(const Range& r, Visit visit) const noexcept {
    for (int b = r.band; b <= r.last_band; ++b) {
      for (int s = 0; s < r.sectors; ++s) visit(cell(b, (r.sector + s) & (sectors_ - 1)));
    }
  }

  int bands_;
  int sectors_;  // a power of two
  float half_bands_, quarter_sectors_;
  std::vector<Range> ranges_;          // [light]
  std::vector<std::uint32_t> wide_;    // lights visited for every direction
  std::vector<std::uint32_t> listed_;  // lights of cell 0, cell 1, ...
  std::vector<std::uint32_t> first_;   // [cell] in listed_
};

}  // namespace penumbra
