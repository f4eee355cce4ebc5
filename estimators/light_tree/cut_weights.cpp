#include "estimators/light_tree/cut_weights.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/block.h"
#include "scenes/core/frame.h"

namespace penumbra::light_tree {
namespace {

// Share of the weights that knows nothing of the BSDF.
constexpr double kPlainShare = 0.02;
// Directions are lifted to this cosine, so that nodes across the horizon have a value.
constexpr float kLowest = 0.02f;

Vec3 lifted(const Vec3& w) noexcept {
  const Vec3 above(w.x, w.y, std::max(w.z, kLowest));
  return above * (1.0f / above.length());
}

// The directions at which nodes stand for their lights, local and above the horizon.
void directions_to(std::span<const CutNode> nodes, const Tree& tree, const ShadingPoint& point,
                   const Frame& frame, const Vec3& mirrored, VectorBlock& middle,
                   VectorBlock& nearest) noexcept {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Bounds& b = tree.nodes()[nodes[i].node].bounds;
    const Vec3 to_center = b.center - point.position;
    const float distance = to_center.length();
    const bool outside = distance > b.radius;
    const Vec3 w = outside ? frame.to_local(to_center * (1.0f / distance)) : mirrored;
    // Turned towards the mirrored view by the angle that the sphere is seen under.
    const float sine = outside ? b.radius / distance : 1.0f;
    const float cosine = std::sqrt(std::max(0.0f, 1.0f - sine * sine));
    const float between = dot(w, mirrored);
    const Vec3 across = mirrored - w * between;
    const float length = across.length();
    const Vec3 turned =
        between < cosine && length > 0.0f ? w * cosine + across * (sine / length) : mirrored;
    middle.set(i, lifted(w));
    nearest.set(i, lifted(turned));
  }
}

}  // namespace

double CutWeights::set(const ShadingPoint& point, const Bsdf& bsdf, const Tree& tree,
                       std::span<const CutNode> nodes) noexcept {
  const bool is_diffuse = bsdf.type() == BsdfType::Lambert;
  double plain = 0.0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    weights_[i] = static_cast<double>(nodes[i].importance);
    plain += weights_[i];
  }
  if (is_diffuse || nodes.size() < 2) return plain;
  const Frame frame(point.shading_normal);
  const BoundBsdf bound(bsdf, frame.to_local(point.wo));
  double sum = 0.0;
  VectorBlock w, f_cos;
  VectorBlock nearest, f_cos_nearest;
  Block<float> pdf;
  for (std::size_t first = 0; first < nodes.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, nodes.size() - first);
    directions_to(nodes.subspan(first, count), tree, point, frame, bound.mirrored(), w, nearest);
    bound.evaluate(w, count, f_cos, pdf);
    bound.evaluate(nearest, count, f_cos_nearest, pdf);
    for (std::size_t i = 0; i < count; ++i) {
      const float reflected =
          luminance(Rgb(f_cos[i])) / w.z[i] + luminance(Rgb(f_cos_nearest[i])) / nearest.z[i];
      weights_[first + i] *= static_cast<double>(reflected);
      sum += weights_[first + i];
    }
  }
  const double mean = sum > 0.0 ? sum / plain : 1.0;
  double total = 0.0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double by_distance = static_cast<double>(nodes[i].importance) * mean;
    weights_[i] = (1.0 - kPlainShare) * weights_[i] + kPlainShare * by_distance;
    total += weights_[i];
  }
  return total;
}

}  // namespace penumbra::light_tree
