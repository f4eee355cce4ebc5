// Rays that miss the light they were aimed at by rounding.

#include <algorithm>
#include <cmath>

#include "scenes/core/light.h"

namespace penumbra {
namespace {

// What a direction is off by, and what a vertex is, relative to its coordinates: some roundings of
// a float.
constexpr double kRounding = 4e-7;
// Share of the distance to the light below which a ray's end settles the matter at once; a
// shortcut.
constexpr double kSurelyBlocked = 0.99;

double largest_coordinate(const Light& light) noexcept {
  double largest = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    largest = std::max({largest, std::abs(static_cast<double>(light.bounds_min[axis])),
                        std::abs(static_cast<double>(light.bounds_max[axis]))});
  }
  return largest;
}

// Whether a coordinate along an edge lies within a margin of one of its ends.
bool is_near_end(double x, double length, double margin) noexcept {
  return std::abs(x) <= margin || std::abs(x - length) <= margin;
}

bool is_within(double x, double length, double margin) noexcept {
  return x >= -margin && x <= length + margin;
}

}  // namespace

bool LightProposal::grazes(const Vec3& wi, float free_distance) const noexcept {
  if (is_rectangle()) {
    return grazes_rectangle(Vec3d(wi), static_cast<double>(free_distance));
  }
  return mode_ == Mode::SphereCone && grazes_sphere(Vec3d(wi), static_cast<double>(free_distance));
}

bool LightProposal::grazes_rectangle(const Vec3d& wi, double free_distance) const noexcept {
  const Light& light = *light_;
  if (!light.two_sided && height_ > 0.0f) return false;
  const double slope = light.plane_normal.dot(wi);
  const auto height = static_cast<double>(height_);
  if (!(height * slope > 0.0)) return false;
  const double distance = height / slope;
  if (free_distance < kSurelyBlocked * distance) return false;
  const double margin = kRounding * (distance / std::abs(slope) + largest_coordinate(light));
  const Vec3d p = wi * distance - Vec3d(to_origin_);
  const Vec3d edge_u(light.edge_u);
  const Vec3d edge_v(light.edge_v);
  const double length_u = edge_u.length();
  const double length_v = edge_v.length();
  const double u = p.dot(edge_u) / length_u;
  const double v = p.dot(edge_v) / length_v;
  return (is_near_end(u, length_u, margin) || is_near_end(v, length_v, margin)) &&
         is_within(u, length_u, margin) && is_within(v, length_v, margin) &&
         free_distance >= distance - margin;
}

bool LightProposal::grazes_sphere(const Vec3d& wi, double free_distance) const noexcept {
  const Vec3d to_center = Vec3d(light_->center) - Vec3d(from_);
  const auto radius = static_cast<double>(light_->radius);
  const double along = to_center.dot(wi);
  if (!(along > 0.0) || free_distance < kSurelyBlocked * (along - radius)) return false;
  const double beside = to_center.cross(wi).length();
  const double margin = kRounding * (along + largest_coordinate(*light_));
  if (!(std::abs(beside - radius) <= margin)) return false;
  const double half_chord = std::sqrt(std::max(0.0, radius * radius - beside * beside));
  return free_distance >= along - half_chord - margin;
}

}  // namespace penumbra
