#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scenes/core/light.h"
#include "scenes/core/surface_geometry.h"

namespace penumbra {

/// Tells, from bounding boxes and planes alone, where nothing can lie between a point and a light.
/// The answer depends on the scene and the point only. "Something may" is said where in doubt, and
/// always in scenes of more than `kMost` shapes, where asking all of them would cost more than it
/// can save.
class Occluders {
 public:
  static constexpr std::size_t kMost = 32;

  void add(const SurfaceGeometry& geometry);

  /// Whether a surface can lie between a point and any point of a light.
  /// @param light   in scene space; its index is `index`
  /// @param from    origin of the rays
  /// @param normal  geometric normal on the side of the viewer: what is below the horizon does not
  ///                matter
  bool may_be_between(const Light& light, std::int32_t index, const Vec3& from,
                      const Vec3& normal) const noexcept;

 private:
  struct Bounds {
    Vec3 min{0.0f}, max{0.0f};
    // All of a flat shape is on the plane dot(normal, x) = offset, to within `slack`.
    bool is_flat{false};
    Vec3 normal{0.0f};  // unit
    float offset{0.0f}, slack{0.0f};
    std::int32_t light{-1};
  };

  static bool separates(const Bounds& shape, const Light& light, const Vec3& from) noexcept;

  bool too_many_{false};
  std::vector<Bounds> shapes_;
};

}  // namespace penumbra
