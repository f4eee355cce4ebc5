#include "harness/stability/closed_form.h"

#include <cmath>
#include <vector>

namespace penumbra::stability {
namespace {

/// The part of a polygon above the plane through the origin. Source: Sutherland and Hodgman 1974,
/// "Reentrant polygon clipping".
std::vector<Vec3d> above_horizon(std::span<const Vec3d> corners, const Vec3d& normal) {
  std::vector<Vec3d> kept;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3d& a = corners[i];
    const Vec3d& b = corners[(i + 1) % corners.size()];
    const double height_a = a.dot(normal);
    const double height_b = b.dot(normal);
    if (height_a >= 0) kept.push_back(a);
    if ((height_a > 0 && height_b < 0) || (height_a < 0 && height_b > 0)) {
      kept.push_back(a + (b - a) * (height_a / (height_a - height_b)));
    }
  }
  return kept;
}

}  // namespace

double polygon_irradiance(std::span<const Vec3d> corners, const Vec3d& from, const Vec3d& normal) {
  std::vector<Vec3d> seen;
  for (const Vec3d& corner : corners) seen.push_back(corner - from);
  seen = above_horizon(seen, normal);
  double sum = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Vec3d& a = seen[i];
    const Vec3d& b = seen[(i + 1) % seen.size()];
    const Vec3d across = a.cross(b);
    const double length = across.length();
    if (length > 0) sum += std::atan2(length, a.dot(b)) * across.dot(normal) / length;
  }
  return 0.5 * std::abs(sum);
}

double sphere_irradiance(const Vec3d& center, double radius, const Vec3d& from,
                         const Vec3d& normal) {
  const Vec3d to_center = center - from;
  const double distance = to_center.length();
  const double sine = radius / distance;
  return M_PI * sine * sine * to_center.dot(normal) / distance;
}

double sky_patch_irradiance(double theta0, double theta1, double width) {
  // sin^2 a - sin^2 b = sin(a + b) sin(a - b), which keeps its digits for small patches.
  return 0.5 * width * std::sin(theta1 + theta0) * std::sin(theta1 - theta0);
}

double bent_normal_irradiance(double angle) { return 0.5 * M_PI * (1 + std::cos(angle)); }

double phong_cap_radiance(double diffuse, double specular, double exponent, double sin_angle) {
  const double sin2 = sin_angle * sin_angle;
  // 1 - cos^(s+2) = -expm1((s+2)/2 log(1 - sin^2))
  return diffuse * sin2 + specular * -std::expm1(0.5 * (exponent + 2) * std::log1p(-sin2));
}

}  // namespace penumbra::stability
