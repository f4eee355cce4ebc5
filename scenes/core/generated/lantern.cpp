#include <array>
#include <cmath>

#include "scenes/core/generated/distances.h"
#include "scenes/core/generated/generated.h"
#include "scenes/core/generated/isosurface.h"

namespace penumbra {
namespace {

using generated::capsule;
using generated::ramp;
using generated::smooth_max;
using generated::smooth_min;

const Vec3d kCenter(0.0, 0.8, 0.0);
constexpr double kFlattening = 1.18;  // a pumpkin is wider than high
constexpr double kWall = 0.1;
constexpr int kRibs = 11;
constexpr int kBridges = 3;

// Depth of the grooves between the ribs; they run out towards the poles.
double grooves(double azimuth, double axis_distance) {
  const double groove = 1.0 - std::abs(std::sin(0.5 * kRibs * azimuth));
  return 0.085 * groove * groove * ramp(0.0, 0.5, axis_distance);
}

// Depth of the hollows at the poles.
double dimples(double axis_distance) {
  return 0.2 * std::exp(-axis_distance * axis_distance / 0.06);
}

// Each opening is a prism along z, given by the distance in the plane of the face.
double triangle_opening(double x, double y, const std::array<Vec3d, 3>& corners) {
  double distance = -1e9;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d& a = corners[i];
    const Vec3d edge = (corners[(i + 1) % 3] - a).normalized();
    distance = std::max(distance, (x - a.x) * edge.y - (y - a.y) * edge.x);
  }
  return distance;
}

// Counter-clockwise corners.
const std::array<Vec3d, 3> kEye{{{0.14, 0.12, 0}, {0.5, 0.17, 0}, {0.26, 0.46, 0}}};
const std::array<Vec3d, 3> kNose{{{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0.0, 0.1, 0}}};

double mouth_opening(double x, double y) {
  const double lower = -0.56 + 0.5 * x * x;
  const double upper = -0.22 + 0.16 * x * x;
  double mouth = std::max({lower - y, y - upper, std::abs(x) - 0.62});
  for (const double tooth : {-0.22, 0.22}) {  // from above
    mouth = std::max(mouth, -std::max(std::abs(x - tooth) - 0.07, upper - 0.13 - y));
  }
  for (const double tooth : {-0.42, 0.0, 0.42}) {  // from below
    mouth = std::max(mouth, -std::max(std::abs(x - tooth) - 0.065, y - lower - 0.12));
  }
  return mouth;
}

double face_openings(const Vec3d& p) {
  const double x = p.x;
  const double y = p.y;
  const double openings = std::min(
      {triangle_opening(std::abs(x), y, kEye), triangle_opening(x, y, kNose), mouth_opening(x, y)});
  return std::max(openings, 0.1 - p.z);
}

// The cut around the lid: a slit along a cone, so that the lid would not fall in, with bridges.
double lid_cut(const Vec3d& p, double azimuth, double axis_distance) {
  const double radius = 0.42 + 0.45 * (p.y - 0.75);
  const double slit = std::abs(axis_distance - radius) * 0.91 - 0.02;
  const double turn = std::remainder(azimuth - 0.5, 2.0 * M_PI / kBridges);
  const double bridge = std::abs(turn) * axis_distance - 0.06;
  return std::max({slit, -bridge, 0.35 - p.y});
}

double stem(const Vec3d& p, double azimuth) {
  const double ridges = 0.012 * std::cos(6.0 * azimuth + 5.0 * p.y);
  const Vec3d bend(0.05, 0.86, 0.02);
  const double lower = capsule(p, {0.0, 0.58, 0.0}, bend, 0.13, 0.085);
  const double upper = capsule(p, bend, {0.15, 1.02, 0.03}, 0.085, 0.09);
  return smooth_min(lower, upper, 0.05) + ridges;
}

double field(const Vec3d& world) {
  const Vec3d p = world - kCenter;
  const double azimuth = std::atan2(p.x, p.z);
  const double axis_distance = std::hypot(p.x, p.z);
  const Vec3d q(p.x, p.y * kFlattening, p.z);
  const double length = std::max(q.length(), 1e-9);
  // In the space of q the body is about a sphere.
  const double round = (length - 1.0 + dimples(axis_distance / length)) / kFlattening;
  const double outer = round + grooves(azimuth, axis_distance / length) / kFlattening;
  if (outer > 0.5) return outer;
  const double inner = round + kWall + 0.06;  // without ribs: scraped smooth
  double shell = smooth_max(outer, -inner, 0.03);
  shell = smooth_max(shell, -face_openings(p), 0.02);
  shell = smooth_min(shell, smooth_max(stem(p, azimuth), -inner, 0.02), 0.05);
  return smooth_max(shell, -lid_cut(p, azimuth, axis_distance), 0.015);
}

}  // namespace

TriangleMeshShape generate_lantern(double detail) {
  return polygonise(field, {{-1.08, -0.15, -1.08}, {1.08, 2.0, 1.08}, 0.024 / detail});
}

}  // namespace penumbra
