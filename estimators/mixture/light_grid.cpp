#include "estimators/mixture/light_grid.h"

#include <algorithm>
#include <cmath>

namespace penumbra {

LightGrid::LightGrid(std::size_t lights) : ranges_(lights), listed_(lights * kMaxCells + 1) {
  wide_.reserve(lights);
}

void LightGrid::build(std::span<const LightProposal> lights) noexcept {
  wide_.clear();
  first_.fill(0);
  // Counts two places on, so that filling leaves the first index of each cell in its place.
  for (std::size_t l = 0; l < lights.size(); ++l) {
    Range& r = ranges_[l];
    r = range(lights[l].directions());
    if ((r.last_band - r.band + 1) * r.sectors > kMaxCells) {
      wide_.push_back(static_cast<std::uint32_t>(l));
      r.sectors = 0;
    } else {
      for_each_cell(r, [&](std::size_t c) { ++first_[c + 2]; });
    }
  }
  for (std::size_t c = 2; c < first_.size(); ++c) first_[c] += first_[c - 1];
  for (std::size_t l = 0; l < lights.size(); ++l) {
    for_each_cell(ranges_[l],
                  [&](std::size_t c) { listed_[first_[c + 1]++] = static_cast<std::uint32_t>(l); });
  }
}

LightGrid::Range LightGrid::range(const DirectionCone& cone) noexcept {
  // Wider than the rounding of directions and of the arithmetic here [rad].
  constexpr float kSlack = 1e-4f;
  Range r;
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
  r.sectors = (last - r.sector + kSectors) % kSectors + 1;
  return r;
}

}  // namespace penumbra
