#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "scenes/core/light.h"

/// Choice among many lights by a hierarchy of their bounds.
namespace penumbra::light_tree {

/// What is known of the lights below a node: a box around them, a cone around the normals of their
/// emitting sides, and how much they emit.
struct Bounds {
  Vec3 center{0.0f}, half_extent{0.0f};
  float radius{0.0f};           ///< of the box: the length of half_extent
  Vec3 axis{0.0f, 0.0f, 1.0f};  ///< unit, of the normals' cone
  float cosine{0.0f};     ///< of its half angle, which is a right angle at most; where normals
  float sine{1.0f};       ///< spread further, (0, 1): anything may face anywhere
  float intensity{0.0f};  ///< luminance x area [W/sr], as `intensity_of`
};

/// Luminous intensity of a shape in its brightest direction, or averaged over the sphere where it
/// shines all around [W/sr].
double intensity_of(const Light& light) noexcept;

/// About how much light arrives at a point from the lights in bounds, without occlusion: intensity
/// x the cosines at the receiver and at the emitter / distance^2, of the middle of the box, or of
/// half of what rises above a horizon where the middle lies below. From within the box's sphere the
/// distance is its radius. 0 only where all of the box lies below the receiver's horizon or every
/// light turns its back. Lengths enter as ratios, with each other and with the square root of the
/// intensity: the unit of length has no influence.
/// @param normal  unit, of the receiver
inline float importance(const Bounds& b, const Vec3& point, const Vec3& normal) noexcept;

struct Node {
  Bounds bounds;
  std::uint32_t first_child{0};  ///< of two, side by side; 0: a leaf
  std::uint32_t light{0};        ///< of a leaf: scene index
};

/// A node of a cut, with its importance at the point that the cut is for.
struct CutNode {
  std::uint32_t node;
  float importance;  ///< > 0
};

/// What systematic sampling has left to share out: `count` samples, of which parts are taken in
/// turn. count = floor(expected + offset), where `expected` is the sum over the parts still to
/// come.
struct Rest {
  int count;
  double offset;  ///< in [0, 1]

  /// Takes the samples of the next part, of which E[count] are expected.
  int take(double expected) noexcept {
    const double upto = expected + offset;
    const int taken = std::min(static_cast<int>(upto), count);
    count -= taken;
    offset = std::clamp(upto - taken, 0.0, 1.0);
    return taken;
  }
};

/// Binary tree over lights with a surface, one per leaf.
class Tree {
 public:
  Tree() = default;
  /// @param lights   all lights of a scene
  /// @param members  indices of those that enter; rectangles, spheres and meshes that emit
  /// @param no_bounds  takes every point as within all bounds: the lights' intensities decide alone
  Tree(std::span<const Light> lights, std::span<const std::uint32_t> members,
       bool no_bounds = false);

  bool empty() const noexcept { return nodes_.empty(); }
  std::span<const Node> nodes() const noexcept { return nodes_; }

  /// Nodes that hold all lights of importance, each light once, in the order of the tree: the
  /// lights are split further where a node is nearer to the point than `split` times its radius.
  /// @param nodes  result; room for all members makes it free of allocations
  void cut(const Vec3& point, const Vec3& normal, float split,
           std::vector<CutNode>& nodes) noexcept;

  /// Shares samples out over the lights below a node by systematic sampling: the children's counts
  /// have expectations in proportion to their importance, and so have the lights' counts, from
  /// which they differ by less than 1. Samples that reach a node whose children have no importance
  /// stay there: nothing would arrive.
  /// @param expected  E[rest.count]
  /// @param visit     called as visit(light, count, expected) where count > 0, each light once
  template <typename Visit>
  void walk(const Vec3& point, const Vec3& normal, std::uint32_t node, double expected,
            const Rest& rest, Visit visit) noexcept;

 private:
  struct Builder;
  struct Pending {
    std::uint32_t node;
    double expected;
    Rest rest;
  };

  float importance_of(std::uint32_t node, const Vec3& point, const Vec3& normal) const noexcept {
    return importance(nodes_[node].bounds, point, normal);
  }

  std::vector<Node> nodes_;  // the root, then pairs of children
  // Scratch: one entry per level and the one at hand.
  std::vector<Pending> pending_;
  std::vector<CutNode> undecided_;
};

inline float importance(const Bounds& b, const Vec3& point, const Vec3& normal) noexcept {
  const auto length1 = [](const Vec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); };
  const auto reach = [&b](const Vec3& w) {
    return std::abs(w.x) * b.half_extent.x + std::abs(w.y) * b.half_extent.y +
           std::abs(w.z) * b.half_extent.z;
  };
  const Vec3 to_center = b.center - point;
  // What rounding of places and normals can lift a light by.
  const float slack = 1e-6f * (length1(b.center) + length1(point) + b.radius);
  const auto above = [slack](float middle, float rise) {
    return std::max(middle, 0.5f * (middle + rise + slack));
  };
  const float distance2 =
      std::max({to_center.length2(), b.radius * b.radius, std::numeric_limits<float>::min()});
  const float inv_distance = 1.0f / std::sqrt(distance2);
  const float receiver = above(dot(to_center, normal), reach(normal)) * inv_distance;
  const float facing = above(-dot(to_center, b.axis), reach(b.axis)) * inv_distance;
  const float emitter = std::min(1.0f, b.cosine * facing + b.sine);
  const float product = std::max(0.0f, receiver) * std::max(0.0f, emitter);
  return b.intensity * product * (inv_distance * inv_distance);
}

template <typename Visit>
void Tree::walk(const Vec3& point, const Vec3& normal, std::uint32_t node, double expected,
                const Rest& rest, Visit visit) noexcept {
  pending_.clear();
  if (rest.count > 0) pending_.push_back({node, expected, rest});
  while (!pending_.empty()) {
    Pending at = pending_.back();
    pending_.pop_back();
    const Node& parent = nodes_[at.node];
    if (parent.first_child == 0) {
      visit(parent.light, at.rest.count, at.expected);
      continue;
    }
    const auto left = static_cast<double>(importance_of(parent.first_child, point, normal));
    const auto right = static_cast<double>(importance_of(parent.first_child + 1, point, normal));
    if (!(left + right > 0.0)) continue;
    const double of_left = at.expected * (left / (left + right));
    const double of_right = at.expected * (right / (left + right));
    Rest for_left = at.rest;
    if (right > 0.0) for_left.count = at.rest.take(of_left);
    // In the order of the lights: the right one waits below the left one.
    if (right > 0.0 && at.rest.count > 0) {
      pending_.push_back({parent.first_child + 1, of_right, at.rest});
    }
    if (for_left.count > 0) pending_.push_back({parent.first_child, of_left, for_left});
  }
}

}  // namespace penumbra::light_tree
