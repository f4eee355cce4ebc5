#include "estimators/mixture/light_grid.h"

#include <algorithm>
#include <cmath>

namespace penumbra {

LightGrid::LightGrid(std::size_t lights)
    : bands_(bands_for(lights)),
      sectors_(2 * bands_),
      half_bands_(0.5f * static_cast<float>(bands_)),
      quarter_sectors_(0.25f * static_cast<float>(sectors_)),
      ranges_(lights),
      listed_(lights * kListedPerLight + 1),
      first_(cell(bands_, 0) + 2) {
  wide_.reserve(lights);
}

int LightGrid::bands_for(std::size_t lights) noexcept {
  std::size_t bands = kMinBands;
  while (2 * bands * bands < kCellsPerLight * lights) bands *= 2;
  return static_cast<int>(bands);
}

void LightGrid::build(std::span<const LightProposal> lights) noexcept {
  wide_.clear();
  std::fill(first_.begin(), first_.end(), 0u);
  const std::size_t most = cell(bands_, 0) / kLeastShare;
  std::size_t room = listed_.size() - 1;
  // Counts two places on, so that filling leaves the first index of each cell in its place.
  for (std::size_t l = 0; l < lights.size(); ++l) {
    Range& r = ranges_[l];
    r = range(lights[l].directions());
    const std::size_t cells = r.cells();
    if (cells > std::min(most, room)) {
      wide_.push_back(static_cast<std::uint32_t>(l));
      r.sectors = 0;
    } else {
      room -= cells;
      for_each_cell(r, [&](std::size_t c) { ++first_[c + 2]; });
    }
  }
  for (std::size_t c = 2; c < first_.size(); ++c) first_[c] += first_[c - 1];
  for (std::size_t l = 0; l < lights.size(); ++l) {
    for_each_cell(ranges_[l],
                  [&](std::size_t c) { listed_[first_[c + 1]++] = static_cast<std::uint32_t>(l); });
  }
}

LightGrid::Range LightGrid::range(const DirectionCone& cone) const noexcept {
  // Wider than the rounding of directions and of the arithmetic here [rad].
  constexpr float kSlack = 1e-4f;
  Range r{0, bands_ - 1, 0, sectors_};
  const float depth = cone.one_minus_cos;
  if (!(depth < 0.9f)) return r;
  const float sine = std::sqrt(depth * (2.0f - depth)) + kSlack;
  const float cosine = std::sqrt(std::max(0.0f, 1.0f - sine * sine));
  const Vec3& axis = cone.axis;
  const float across = std::sqrt(axis.x * axis.x + axis.y * axis.y);
  const float top = axis.z >= cosine ? 1.0f : axis.z * cosine + across * sine;
  const float bottom = -axis.z >= cosine ? -1.0f : axis.z * cosine - across * sine;
  r.band = band(bottom);
  r.last_band = band(top);
  // Around a pole the cone has every azimuth; otherwise the two tangents from the axis of z bound
  // it.
  if (!(sine < across)) return r;
  const float x = axis.x / across;
  const float y = axis.y / across;
  const float turn_sine = sine / across;
  const float turn_cosine = std::sqrt(1.0f - turn_sine * turn_sine);
  r.sector = sector(turn(x * turn_cosine + y * turn_sine, y * turn_cosine - x * turn_sine));
  const int last = sector(turn(x * turn_cosine - y * turn_sine, y * turn_cosine + x * turn_sine));
  r.sectors = ((last - r.sector) & (sectors_ - 1)) + 1;
  return r;
}

}  // namespace penumbra
