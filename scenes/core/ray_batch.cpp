#include "scenes/core/ray_batch.h"

#include <bit>
#include <cmath>

namespace penumbra {

RayBatch::RayBatch(std::size_t capacity) {
  for (std::vector<float>* lane : {&ox, &oy, &oz, &dx, &dy, &dz}) lane->resize(capacity + kPadding);
  hits.resize(capacity + kPadding);
}

Vec3 offset_ray_origin(const Vec3& position, const Vec3& normal) noexcept {
  constexpr float kOriginScale = 1.0f / 32.0f;
  constexpr float kFloatScale = 1.0f / 65536.0f;
  constexpr float kIntScale = 256.0f;
  Vec3 moved;
  for (int axis = 0; axis < 3; ++axis) {
    const float p = position[axis];
    if (std::abs(p) < kOriginScale) {
      moved[axis] = p + kFloatScale * normal[axis];
    } else {
      const auto steps = static_cast<std::int32_t>(kIntScale * normal[axis]);
      moved[axis] =
          std::bit_cast<float>(std::bit_cast<std::int32_t>(p) + (p < 0.0f ? -steps : steps));
    }
  }
  return moved;
}

}  // namespace penumbra
