#pragma once

#include "scenes/core/scene_description.h"
#include "scenes/core/vec.h"

namespace penumbra {

/// Pinhole camera in scene space.
class Camera {
 public:
  Camera() = default;
  /// @param description  in scene space (normalised), position != look_at, up not parallel to the
  /// view
  explicit Camera(const CameraDescription& description);

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }
  const Vec3& position() const noexcept { return position_; }

  /// Unit direction of the ray through a point of the image; x to the right, y downwards, in
  /// pixels, so that the centre of the first pixel is (0.5, 0.5).
  Vec3 direction(float x, float y) const noexcept {
    return (forward_ + right_ * (x * scale_ - half_width_) - up_ * (y * scale_ - half_height_))
        .normalized();
  }

 private:
  int width_{0}, height_{0};
  Vec3 position_, forward_, right_, up_;
  float scale_{0};  // tangent units per pixel
  float half_width_{0}, half_height_{0};
};

}  // namespace penumbra
