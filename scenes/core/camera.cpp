#include "scenes/core/camera.h"

#include <cmath>

namespace penumbra {

Camera::Camera(const CameraDescription& description)
    : width_(description.resolution[0]),
      height_(description.resolution[1]),
      position_(description.position) {
  const Vec3d forward = (description.look_at - description.position).normalized();
  const Vec3d right = forward.cross(description.up).normalized();
  forward_ = Vec3(forward);
  right_ = Vec3(right);
  up_ = Vec3(right.cross(forward));
  const double half = std::tan(description.vertical_fov_deg * M_PI / 360.0);
  half_height_ = static_cast<float>(half);
  half_width_ = static_cast<float>(half * width_ / height_);
  scale_ = static_cast<float>(2.0 * half / height_);
}

}  // namespace penumbra
