#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scenes/core/vec.h"

/// The kd-tree of MDHI: it divides unit squares (charts) into leaves of few samples and says in
/// which leaf the next sample is needed most.
namespace penumbra::mdhi {

/// How the tree divides and what counts as contrast.
struct LeafRules {
  bool relative{true};        ///< deviations over the leaf's mean; false: deviations as they are
  bool per_channel{false};    ///< deviations of red, green and blue added; false: of luminance
  std::uint32_t capacity{4};  ///< samples that a leaf holds before it is split, >= 1
};

/// A box of a chart with the samples in it. Half-open: a sample on an upper side belongs to the
/// neighbour.
struct Leaf {
  Vec2 lower{0.0f};        ///< corner, in [0, 1)^2
  Vec2 upper{1.0f};        ///< opposite corner, in (0, 1]^2
  std::uint32_t chart{0};  ///< square that it is a part of
  std::uint32_t count{0};  ///< samples in it
  std::uint32_t first{0};  ///< first of its samples; the others follow by LeafTree::next
  std::uint32_t node{0};   ///< its place in the tree, for the tree's own use
};

/// One kd-tree per chart over a common array of leaves. The leaves of a chart tile its square and
/// hold all its samples. Memory is taken once: nothing allocates after the constructor.
///
/// Leaf error, with V the area, n the samples and c luminance or each of the three channels:
///   relative  e = V (1/n sum_i sum_c |v_ic - mean_c| / mean_c + 1e-5), channels of mean 0 left out
///   absolute  e = V (1/n sum_i sum_c |v_ic - mean_c| + 1e-5 m)
/// The last term gives every leaf a positive error, so that with enough samples each is divided.
/// There m is the mean of all samples' sum_c when the first light was found, until then 1e5. Values
/// times a power of two change no choice.
/// Source: Hachisuka et al. 2008; constants as in the code of Meister and Hachisuka 2022 (pmdas).
class LeafTree {
 public:
  /// End of a leaf's list of samples.
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// @param max_charts   most charts that `reset` is given
  /// @param max_samples  most samples in all charts together
  LeafTree(std::size_t max_charts, std::size_t max_samples, const LeafRules& rules);

  /// Drops everything; each of `charts` squares is then one empty leaf.
  void reset(std::size_t charts) noexcept;

  /// Adds a sample where it belongs and splits the leaf when it is above capacity. Samples are
  /// numbered in the order of insertion.
  /// @param u      in [0, 1)^2
  /// @param value  finite, >= 0
  void insert(std::size_t chart, const Vec2& u, const Vec3d& value) noexcept;

  /// `insert` of a sample that lies in a known leaf, without the search.
  void insert_into(std::size_t leaf, const Vec2& u, const Vec3d& value) noexcept;

  /// The leaf of the largest error over all charts; the one made first among equals.
  std::size_t worst_leaf() const noexcept;

  /// Goes on splitting until no leaf has more than `capacity` samples.
  void split_down_to(std::uint32_t capacity) noexcept;

  /// Area of a leaf over its number of samples, for each sample: the sum of weight x value is the
  /// integral over all charts by leaf means.
  /// @param weights  [sample], same length as samples()
  void leaf_mean_weights(std::span<double> weights) const noexcept;

  /// Leaves of all charts in the order in which they were made.
  std::span<const Leaf> leaves() const noexcept { return leaves_; }
  /// Area of a leaf.
  double volume(std::size_t leaf) const noexcept { return volumes_[leaf]; }
  /// Error of a leaf by the formula above.
  double error(std::size_t leaf) const noexcept { return errors_[places_ + leaf]; }

  /// Number of samples.
  std::size_t samples() const noexcept { return samples_.size(); }
  /// Place of a sample in its square.
  const Vec2& position(std::size_t sample) const noexcept { return samples_[sample].u; }
  /// Value of a sample.
  const Vec3d& value(std::size_t sample) const noexcept { return samples_[sample].value; }
  /// The sample after this one in the same leaf, or kNone.
  std::uint32_t next(std::size_t sample) const noexcept { return samples_[sample].next; }

  /// Maps a point of the unit square into a leaf's box.
  /// @param u  in [0, 1)^2
  Vec2 point_in(std::size_t leaf, const Vec2& u) const noexcept;
  /// Squared distance from a point to the nearest sample of a leaf; infinite for an empty leaf.
  float nearest_distance2(std::size_t leaf, const Vec2& u) const noexcept;

 private:
  struct Sample {
    Vec2 u;
    std::uint32_t next;
    Vec3d value;
  };
  // An inner node divides at `split`; the upper child follows the lower one. Node k is the root of
  // chart k.
  struct Node {
    float split{0.0f};
    int axis{kLeaf};
    std::uint32_t child{0};  // lower child, or the leaf's index
  };
  static constexpr int kLeaf = -1;

  void add_up(const Vec3d& value) noexcept;
  void set_error(std::size_t leaf) noexcept;
  void settle(std::size_t leaf, std::uint32_t capacity) noexcept;
  bool split(std::size_t leaf) noexcept;
  std::size_t sort_and_cut(std::span<std::uint32_t> order, int axis) const noexcept;
  void divide(std::size_t leaf, int axis, float at, std::span<const std::uint32_t> order,
              std::size_t cut) noexcept;
  void link(Leaf& leaf, std::span<const std::uint32_t> order) noexcept;
  void update(std::size_t leaf) noexcept;
  double contrast(const Leaf& leaf) const noexcept;

  LeafRules rules_;
  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
  std::vector<double> volumes_;    // [leaf]
  std::vector<double> contrasts_;  // [leaf], the error without area and floor
  // Tournament of the errors, a binary tree in an array: place k holds the larger of those at 2k
  // and 2k + 1; leaf i is at places_ + i. For more than a
  // hundred leaves it costs less than a search through all.
  std::size_t places_{1};
  std::vector<double> errors_;
  std::vector<Sample> samples_;
  std::vector<std::uint32_t> order_;  // of the leaf being split
  double floor_{0.0};                 // error per area of a leaf without contrast
  bool lit_{false};                   // a sample has a value
};

}  // namespace penumbra::mdhi
