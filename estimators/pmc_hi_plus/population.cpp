#include "estimators/pmc_hi_plus/population.h"

#include <algorithm>

namespace penumbra::pmc_hi_plus {
namespace {

constexpr float kSameSide = 0.5f;  // cosine between normals of one kind of surface
constexpr int kLeastOwn = 2;       // estimates at a point that are heard by themselves

}  // namespace

Population::Population(std::size_t slots, int estimates)
    : slots_(slots),
      members_(static_cast<std::size_t>(kBlockPixels * estimates)),
      variance_(members_.size() * slots),
      places_(members_.size() * 2),
      variance_sum_(places_.size() * slots) {}

void Population::begin(int width, int height, int estimates, int camera_samples) noexcept {
  width_ = width;
  height_ = height;
  estimates_ = estimates;
  points_ = std::min(estimates, camera_samples);
  for (std::size_t i = 0; i < index(pixels(), 0); ++i) members_[i].used = false;
}

Population::Member& Population::use(std::size_t i, const ShadingPoint& point) noexcept {
  Member& member = members_[i];
  member = {};
  member.used = true;
  member.material = point.material;
  member.normal = point.shading_normal;
  const std::span<double> none = variance(i);
  std::fill(none.begin(), none.end(), 0.0);
  return member;
}

bool Population::same_kind(std::size_t a, std::size_t b) const noexcept {
  return members_[a].material == members_[b].material &&
         dot(members_[a].normal, members_[b].normal) >= kSameSide;
}

void Population::gather() noexcept {
  const std::size_t places = place_index(pixels(), 0, 0);
  std::fill_n(places_.begin(), places, Place{});
  std::fill_n(variance_sum_.begin(), places * slots_, 0.0);
  for (int pixel = 0; pixel < pixels(); ++pixel) {
    for (int e = 0; e < estimates_; ++e) {
      const std::size_t i = index(pixel, e);
      if (!members_[i].used) continue;
      const std::size_t p = place_of(pixel, e);
      Place& place = places_[p];
      if (place.count++ == 0) place.first = i;
      place.luminance += members_[i].luminance;
      place.lobe_luminance += members_[i].lobe_luminance;
      for (std::size_t k = 0; k < slots_; ++k) {
        variance_sum_[p * slots_ + k] += variance_[i * slots_ + k];
      }
    }
  }
}

Neighbourhood Population::around(std::size_t p, int radius,
                                 std::span<double> scratch) const noexcept {
  const std::size_t self = places_[p].first;
  const auto pixel_half = static_cast<int>(p) / points_;
  const int other = 1 - pixel_half % 2;
  const int px = pixel_half / 2 % width_, py = pixel_half / 2 / width_;
  Neighbourhood result;
  double total = 0.0, lobe_luminance = 0.0;
  std::fill(scratch.begin(), scratch.end(), 0.0);
  for (int y = std::max(0, py - radius); y <= std::min(height_ - 1, py + radius); ++y) {
    for (int x = std::max(0, px - radius); x <= std::min(width_ - 1, px + radius); ++x) {
      const double weight = 1.0 / (1 + (x - px) * (x - px) + (y - py) * (y - py));
      for (int point = 0; point < points_; ++point) {
        const std::size_t at = place_index(y * width_ + x, other, point);
        const Place& place = places_[at];
        if (place.count == 0 || !same_kind(place.first, self)) continue;
        result.estimates += place.count;
        total += weight * place.count;
        result.luminance += weight * place.luminance;
        lobe_luminance += weight * place.lobe_luminance;
        for (std::size_t k = 0; k < slots_; ++k) {
          scratch[k] += weight * variance_sum_[at * slots_ + k];
        }
      }
    }
  }
  if (result.estimates == 0) return result;
  if (result.luminance > 0.0) result.lobe_share = lobe_luminance / result.luminance;
  result.luminance /= total;
  for (double& v : scratch) v /= total;
  // The point's own estimates are heard where they found more.
  const std::size_t own = place_index(pixel_half / 2, other, static_cast<int>(p) % points_);
  if (places_[own].count >= kLeastOwn) {
    for (std::size_t k = 0; k < slots_; ++k) {
      scratch[k] = std::max(scratch[k], variance_sum_[own * slots_ + k] / places_[own].count);
    }
  }
  result.variance = scratch;
  return result;
}

}  // namespace penumbra::pmc_hi_plus
