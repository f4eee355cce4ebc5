#include "estimators/mdhi/leaf_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "estimators/mixture/mixture.h"
#include "scenes/core/error.h"

namespace penumbra::mdhi {
namespace {

// Error per area of a leaf without contrast, as in pmdas.
constexpr double kFloor = 1e-5;

}  // namespace

LeafTree::LeafTree(std::size_t max_charts, std::size_t max_samples, const LeafRules& rules)
    : rules_(rules) {
  PN_CHECK(rules.capacity >= 1, "a leaf holds a sample");
  // A split leaves no part empty, so only the charts themselves can be empty leaves.
  const std::size_t leaves = max_charts + max_samples;
  nodes_.reserve(2 * leaves);
  leaves_.reserve(leaves);
  volumes_.reserve(leaves);
  contrasts_.reserve(leaves);
  places_ = std::bit_ceil(leaves);
  errors_.resize(2 * places_, 0.0);
  samples_.reserve(max_samples);
  order_.resize(max_samples);
}

void LeafTree::reset(std::size_t charts) noexcept {
  if (!leaves_.empty()) {
    std::size_t last = places_ + leaves_.size() - 1;
    for (std::size_t first = places_; first > 0; first /= 2, last /= 2) {
      std::fill(errors_.begin() + static_cast<std::ptrdiff_t>(first),
                errors_.begin() + static_cast<std::ptrdiff_t>(last) + 1, 0.0);
    }
  }
  nodes_.clear();
  leaves_.clear();
  volumes_.clear();
  contrasts_.clear();
  samples_.clear();
  floor_ = rules_.relative ? kFloor : 1.0;
  lit_ = false;
  for (std::size_t k = 0; k < charts; ++k) {
    const auto index = static_cast<std::uint32_t>(k);
    Leaf leaf;
    leaf.chart = index;
    leaf.first = kNone;
    leaf.node = index;
    nodes_.push_back({0.0f, kLeaf, index});
    leaves_.push_back(leaf);
    volumes_.push_back(1.0);
    contrasts_.push_back(0.0);
    set_error(k);
  }
}

void LeafTree::insert(std::size_t chart, const Vec2& u, const Vec3d& value) noexcept {
  const Node* node = &nodes_[chart];
  while (node->axis != kLeaf) node = &nodes_[node->child + (u[node->axis] < node->split ? 0u : 1u)];
  insert_into(node->child, u, value);
}

void LeafTree::insert_into(std::size_t leaf, const Vec2& u, const Vec3d& value) noexcept {
  Leaf& box = leaves_[leaf];
  PN_ASSERT(samples_.size() < samples_.capacity());
  PN_ASSERT(u.x >= box.lower.x && u.x < box.upper.x && u.y >= box.lower.y && u.y < box.upper.y);
  samples_.push_back({u, box.first, value});
  box.first = static_cast<std::uint32_t>(samples_.size() - 1);
  ++box.count;
  add_up(value);
  settle(leaf, rules_.capacity);
}

// The scale of absolute errors, once there is one. Before, only the areas decide.
void LeafTree::add_up(const Vec3d& value) noexcept {
  if (lit_ || rules_.relative) return;
  const double sum = rules_.per_channel ? value.x + value.y + value.z : luminance(value);
  if (!(sum > 0.0)) return;
  lit_ = true;
  floor_ = kFloor * sum / static_cast<double>(samples_.size());
  for (std::size_t i = 0; i < leaves_.size(); ++i) set_error(i);
}

void LeafTree::set_error(std::size_t leaf) noexcept {
  std::size_t place = places_ + leaf;
  errors_[place] = volumes_[leaf] * (contrasts_[leaf] + floor_);
  while (place > 1) {
    place /= 2;
    const double larger = std::max(errors_[2 * place], errors_[2 * place + 1]);
    if (errors_[place] == larger) return;
    errors_[place] = larger;
  }
}

std::size_t LeafTree::worst_leaf() const noexcept {
  std::size_t place = 1;
  while (place < places_) {
    place *= 2;
    place += errors_[place] == errors_[place / 2] ? 0u : 1u;
  }
  return place - places_;
}

void LeafTree::split_down_to(std::uint32_t capacity) noexcept {
  const std::size_t before = leaves_.size();
  for (std::size_t i = 0; i < before; ++i) settle(i, capacity);
}

void LeafTree::leaf_mean_weights(std::span<double> weights) const noexcept {
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    const double weight = volumes_[i] / leaves_[i].count;
    for (std::uint32_t s = leaves_[i].first; s != kNone; s = samples_[s].next) weights[s] = weight;
  }
}

Vec2 LeafTree::point_in(std::size_t leaf, const Vec2& u) const noexcept {
  const Leaf& box = leaves_[leaf];
  Vec2 point = box.lower + u * (box.upper - box.lower);
  // Rounding can reach the upper side, which is the neighbour's.
  for (int axis = 0; axis < 2; ++axis) {
    if (point[axis] >= box.upper[axis]) point[axis] = std::nextafter(box.upper[axis], 0.0f);
  }
  return point;
}

float LeafTree::nearest_distance2(std::size_t leaf, const Vec2& u) const noexcept {
  float nearest = std::numeric_limits<float>::infinity();
  for (std::uint32_t s = leaves_[leaf].first; s != kNone; s = samples_[s].next) {
    nearest = std::min(nearest, (samples_[s].u - u).length2());
  }
  return nearest;
}

// Splits until the capacity holds. A leaf whose samples all coincide stays above it: no cut
// separates them.
void LeafTree::settle(std::size_t leaf, std::uint32_t capacity) noexcept {
  if (leaves_[leaf].count > capacity && split(leaf)) {
    const std::size_t upper = leaves_.size() - 1;
    settle(leaf, capacity);
    settle(upper, capacity);
    return;
  }
  update(leaf);
}

// Splits across the longest axis, of equal ones the first; or across the other one where the
// samples have the same coordinate.
bool LeafTree::split(std::size_t leaf) noexcept {
  const Leaf box = leaves_[leaf];
  const std::span<std::uint32_t> order = std::span(order_).first(box.count);
  std::size_t listed = 0;
  for (std::uint32_t s = box.first; s != kNone; s = samples_[s].next) order[listed++] = s;
  const Vec2 extent = box.upper - box.lower;
  const int longest = extent.x >= extent.y ? 0 : 1;
  for (const int axis : {longest, 1 - longest}) {
    const std::size_t cut = sort_and_cut(order, axis);
    if (cut == 0) continue;
    const float below = samples_[order[cut - 1]].u[axis];
    const float above = samples_[order[cut]].u[axis];
    const float middle = 0.5f * (below + above);
    // Between neighbouring floats the middle rounds to one of them; the lower part is half-open.
    divide(leaf, axis, middle > below ? middle : above, order, cut);
    return true;
  }
  return false;
}

// Sorts samples along an axis. Returns how many of them go to the lower part: half, rounded down,
// or the nearest number that does not separate equal coordinates; 0 where there is none.
std::size_t LeafTree::sort_and_cut(std::span<std::uint32_t> order, int axis) const noexcept {
  const auto at = [&](std::size_t i) { return samples_[order[i]].u[axis]; };
  for (std::size_t i = 1; i < order.size(); ++i) {
    for (std::size_t j = i; j > 0 && at(j) < at(j - 1); --j) std::swap(order[j], order[j - 1]);
  }
  const std::size_t half = order.size() / 2;
  for (std::size_t step = 0; step < order.size(); ++step) {
    const std::size_t later = half + step;
    if (later < order.size() && at(later - 1) < at(later)) return later;
    if (step >= half) continue;
    const std::size_t earlier = half - step;
    if (at(earlier - 1) < at(earlier)) return earlier;
  }
  return 0;
}

// The lower part takes the leaf's index, the upper part becomes the last leaf.
void LeafTree::divide(std::size_t leaf, int axis, float at, std::span<const std::uint32_t> order,
                      std::size_t cut) noexcept {
  const auto child = static_cast<std::uint32_t>(nodes_.size());
  const auto upper_index = static_cast<std::uint32_t>(leaves_.size());
  nodes_[leaves_[leaf].node] = {at, axis, child};
  nodes_.push_back({0.0f, kLeaf, static_cast<std::uint32_t>(leaf)});
  nodes_.push_back({0.0f, kLeaf, upper_index});
  Leaf upper = leaves_[leaf];
  upper.lower[axis] = at;
  upper.node = child + 1;
  link(upper, order.subspan(cut));
  Leaf& lower = leaves_[leaf];
  lower.upper[axis] = at;
  lower.node = child;
  link(lower, order.first(cut));
  leaves_.push_back(upper);
  volumes_.push_back(0.0);
  contrasts_.push_back(0.0);
}

void LeafTree::link(Leaf& leaf, std::span<const std::uint32_t> order) noexcept {
  leaf.count = static_cast<std::uint32_t>(order.size());
  leaf.first = order.front();
  for (std::size_t i = 0; i < order.size(); ++i) {
    samples_[order[i]].next = i + 1 < order.size() ? order[i + 1] : kNone;
  }
}

void LeafTree::update(std::size_t leaf) noexcept {
  const Leaf& box = leaves_[leaf];
  volumes_[leaf] = (static_cast<double>(box.upper.x) - static_cast<double>(box.lower.x)) *
                   (static_cast<double>(box.upper.y) - static_cast<double>(box.lower.y));
  contrasts_[leaf] = contrast(box);
  set_error(leaf);
}

double LeafTree::contrast(const Leaf& leaf) const noexcept {
  if (leaf.count < 2) return 0.0;
  const auto n = static_cast<double>(leaf.count);
  Vec3d sum(0.0);
  for (std::uint32_t s = leaf.first; s != kNone; s = samples_[s].next) sum += samples_[s].value;
  const Vec3d mean = sum / n;
  const auto share = [&](double deviations, double mean_value) {
    if (!rules_.relative) return deviations / n;
    return mean_value > 0.0 ? deviations / (n * mean_value) : 0.0;
  };
  if (rules_.per_channel) {
    Vec3d deviations(0.0);
    for (std::uint32_t s = leaf.first; s != kNone; s = samples_[s].next) {
      const Vec3d d = samples_[s].value - mean;
      deviations += Vec3d(std::abs(d.x), std::abs(d.y), std::abs(d.z));
    }
    return share(deviations.x, mean.x) + share(deviations.y, mean.y) + share(deviations.z, mean.z);
  }
  const double mean_luminance = luminance(mean);
  double deviations = 0.0;
  for (std::uint32_t s = leaf.first; s != kNone; s = samples_[s].next) {
    deviations += std::abs(luminance(samples_[s].value) - mean_luminance);
  }
  return share(deviations, mean_luminance);
}

}  // namespace penumbra::mdhi
