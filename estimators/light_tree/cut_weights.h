#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "estimators/light_tree/tree.h"
#include "scenes/core/bsdf.h"
#include "scenes/core/shading_point.h"

namespace penumbra::light_tree {

/// Weights of a cut's nodes: importance x what the surface reflects from there. Without the second
/// factor, the light that makes a highlight is found by accident.
///
/// The reflection is the BSDF's value, its cosine divided out, at two directions of the sphere
/// around the node: the middle and the one nearest to the mirrored view. A share of the plain
/// importance is mixed in, because values at two directions can be too small for the others.
class CutWeights {
 public:
  /// @param capacity  most nodes
  explicit CutWeights(std::size_t capacity) : weights_(capacity) {}

  /// Works out the weights of the nodes, all > 0.
  /// @return their sum
  double set(const ShadingPoint& point, const Bsdf& bsdf, const Tree& tree,
             std::span<const CutNode> nodes) noexcept;

  /// @param i  index of a node in the span that was given
  double operator[](std::size_t i) const noexcept { return weights_[i]; }

 private:
  std::vector<double> weights_;
};

}  // namespace penumbra::light_tree
