#pragma once

#include <memory>
#include <string_view>

#include "scenes/core/ray_batch.h"

namespace penumbra {

/// How bare rays are handed to Embree.
enum class BareQuery : std::uint8_t {
  Single,    ///< one by one
  Packet8,   ///< eight at a time
  Packet16,  ///< sixteen at a time
};

inline constexpr std::size_t kBareQueries = 3;

std::string_view to_string(BareQuery query);

/// Recorded rays, packed ahead for Embree's own calls: tracing them again costs what no estimator
/// that traces the same rays can undercut. Packets are full, whatever the estimator's batches were.
/// Rays that are not finite or have no direction are left out.
class BareRays {
 public:
  /// @param scene  must outlive the object
  BareRays(const RayScene& scene, const RayRecorder& rays, BareQuery query);
  ~BareRays();
  BareRays(const BareRays&) = delete;
  BareRays& operator=(const BareRays&) = delete;

  std::size_t size() const noexcept;

  /// Finds the closest hit of every ray.
  /// @return how many rays hit something
  std::size_t trace() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace penumbra
