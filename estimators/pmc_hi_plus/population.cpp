#include "estimators/pmc_hi_plus/population.h"

#include <algorithm>

namespace penumbra::pmc_hi_plus {
namespace {

constexpr float kSameSide = 0.5f;  // cosine between normals of one kind of surface

}  // namespace

Population::Population(std::size_t slots, int estimates)
    : slots_(slots),
      members_(static_cast<std::size_t>(kBlockPixels * estimates)),
      variance_(members_.size() * slots),
      sums_(static_cast<std::size_t>(kBlockPixels) * 2),
      variance_sum_(sums_.size() * slots) {}

void Population::begin(int width, int height, int estimates) noexcept {
  width_ = width;
  height_ = height;
  estimates_ = estimates;
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
  std::fill(sums_.begin(), sums_.end(), Sum{});
  std::fill(variance_sum_.begin(), variance_sum_.end(), 0.0);
  for (int pixel = 0; pixel < pixels(); ++pixel) {
    for (int e = 0; e < estimates_; ++e) {
      const std::size_t i = index(pixel, e);
      if (!members_[i].used) continue;
      const std::size_t at = pixel_half(pixel, half(pixel, e));
      Sum& sum = sums_[at];
      if (sum.count == 0) sum.first = i;
      if (!same_kind(i, sum.first)) continue;
      ++sum.count;
      sum.luminance += members_[i].luminance;
      sum.lobe_luminance += members_[i].lobe_luminance;
      for (std::size_t k = 0; k < slots_; ++k) {
        variance_sum_[at * slots_ + k] += variance_[i * slots_ + k];
      }
    }
  }
}

Neighbourhood Population::around(int pixel, int estimate, int radius,
                                 std::span<double> scratch) const noexcept {
  const std::size_t self = index(pixel, estimate);
  const int other = 1 - half(pixel, estimate);
  const int px = pixel % width_, py = pixel / width_;
  Neighbourhood result;
  double lobe_luminance = 0.0;
  std::fill(scratch.begin(), scratch.end(), 0.0);
  for (int y = std::max(0, py - radius); y <= std::min(height_ - 1, py + radius); ++y) {
    for (int x = std::max(0, px - radius); x <= std::min(width_ - 1, px + radius); ++x) {
      const std::size_t at = pixel_half(y * width_ + x, other);
      const Sum& sum = sums_[at];
      if (sum.count == 0 || !same_kind(sum.first, self)) continue;
      result.estimates += sum.count;
      result.luminance += sum.luminance;
      lobe_luminance += sum.lobe_luminance;
      for (std::size_t k = 0; k < slots_; ++k) scratch[k] += variance_sum_[at * slots_ + k];
    }
  }
  if (result.estimates == 0) return result;
  if (result.luminance > 0.0) result.lobe_share = lobe_luminance / result.luminance;
  result.luminance /= result.estimates;
  for (double& v : scratch) v /= result.estimates;
  result.variance = scratch;
  return result;
}

}  // namespace penumbra::pmc_hi_plus
