#include "scenes/core/occluders.h"

#include <algorithm>
#include <cmath>

namespace penumbra {
namespace {

// Largest and smallest signed distance of a box's corners from the plane through `from`.
struct Heights {
  float low, high;
};

Heights heights(const Vec3& min, const Vec3& max, const Vec3& normal, const Vec3& from) noexcept {
  Heights result{0.0f, 0.0f};
  for (int axis = 0; axis < 3; ++axis) {
    const float a = normal[axis] * (min[axis] - from[axis]);
    const float b = normal[axis] * (max[axis] - from[axis]);
    result.low += std::min(a, b);
    result.high += std::max(a, b);
  }
  return result;
}

}  // namespace

void Occluders::add(const SurfaceGeometry& geometry) {
  too_many_ = too_many_ || shapes_.size() == kMost;
  if (too_many_) {
    shapes_ = {};
    return;
  }
  Bounds bounds;
  bounds.light = geometry.light;
  if (geometry.vertices.empty()) {  // a sphere
    bounds.min = geometry.center - Vec3(geometry.radius);
    bounds.max = geometry.center + Vec3(geometry.radius);
    shapes_.push_back(bounds);
    return;
  }
  // A subdivision surface is inside the hull of its cage.
  bounds.min = bounds.max = geometry.vertices[0];
  for (const Vec3& vertex : geometry.vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      bounds.min[axis] = std::min(bounds.min[axis], vertex[axis]);
      bounds.max[axis] = std::max(bounds.max[axis], vertex[axis]);
    }
  }
  const auto corner = [&](std::size_t i) { return geometry.vertices[geometry.indices[i]]; };
  const Vec3 first[3] = {corner(0), corner(1), corner(2)};
  const Vec3 normal = triangle_normal(first).normalized();
  const float offset = dot(normal, first[0]);
  // Rounding of coordinates and products; what bends more than that is not flat.
  const float slack = 4e-7f * (std::abs(offset) + bounds.max.length() + bounds.min.length());
  bounds.is_flat = std::all_of(
      geometry.vertices.begin(), geometry.vertices.end(),
      [&](const Vec3& vertex) { return std::abs(dot(normal, vertex) - offset) <= slack; });
  bounds.normal = normal;
  bounds.offset = offset;
  bounds.slack = slack;
  shapes_.push_back(bounds);
}

// Whether the shape's box, or the plane that holds it, is apart from the hull of the point and the
// light's box.
bool Occluders::separates(const Bounds& shape, const Light& light, const Vec3& from) noexcept {
  for (int axis = 0; axis < 3; ++axis) {
    if (shape.max[axis] < std::min(from[axis], light.bounds_min[axis]) ||
        shape.min[axis] > std::max(from[axis], light.bounds_max[axis])) {
      return true;
    }
  }
  if (!shape.is_flat) return false;
  const Heights of_light = heights(light.bounds_min, light.bounds_max, shape.normal, Vec3(0.0f));
  const float of_point = dot(shape.normal, from);
  return std::min(of_light.low, of_point) > shape.offset + shape.slack ||
         std::max(of_light.high, of_point) < shape.offset - shape.slack;
}

bool Occluders::may_be_between(const Light& light, std::int32_t index, const Vec3& from,
                               const Vec3& normal) const noexcept {
  if (too_many_) return true;
  // A mesh can be in front of itself.
  if (light.type == LightType::Mesh) return true;
  const bool infinite = light.type == LightType::Environment;
  return std::any_of(shapes_.begin(), shapes_.end(), [&](const Bounds& shape) {
    if (shape.light == index) return false;
    if (!(heights(shape.min, shape.max, normal, from).high > 0.0f)) return false;  // below
    return infinite || !separates(shape, light, from);
  });
}

}  // namespace penumbra
