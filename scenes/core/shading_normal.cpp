#include <cmath>

#include "scenes/core/shading_point.h"

namespace penumbra {
namespace {

// Cosine to the viewer below which a shading normal is bent: small enough that only silhouettes
// are touched, far above the rounding with which estimators find it again.
constexpr float kMinViewCosine = 1e-3f;

bool is_unit(const Vec3& n) noexcept { return std::abs(n.length2() - 1.0f) < 1e-3f; }

}  // namespace

Vec3 make_shading_normal(const Vec3& interpolated, const Vec3& geometric_normal,
                         const Vec3& wo) noexcept {
  Vec3 n = interpolated.normalized();
  if (!is_unit(n)) return geometric_normal;  // collapsed, or not finite
  if (dot(n, geometric_normal) < 0.0f) n = -n;
  const float view_cosine = dot(n, wo);
  if (view_cosine < kMinViewCosine) {
    // In the plane of n and wo. The part of n across wo keeps to the side of the geometric normal:
    // of n it takes away nothing that points there, because n turns away from wo.
    const Vec3 across = (n - wo * view_cosine).normalized();
    n = (across * std::sqrt(1.0f - kMinViewCosine * kMinViewCosine) + wo * kMinViewCosine)
            .normalized();
  }
  return is_unit(n) && dot(n, geometric_normal) > 0.0f && dot(n, wo) > 0.0f ? n : geometric_normal;
}

}  // namespace penumbra
