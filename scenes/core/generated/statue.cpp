#include <array>
#include <cmath>

#include "scenes/core/generated/distances.h"
#include "scenes/core/generated/generated.h"
#include "scenes/core/generated/isosurface.h"

namespace penumbra {
namespace {

using generated::capsule;
using generated::disc;
using generated::ellipsoid;
using generated::ramp;
using generated::rounded_box;
using generated::smooth_max;
using generated::smooth_min;

// Beyond this distance from a part's bounds, the distance to the bounds stands for the part's.
constexpr double kFar = 0.12;

// The robe's outline: half widths of an ellipse at a height.
struct Section {
  double y, half_width, half_depth, shift;  // shift: of its centre, towards the viewer
};
constexpr std::array<Section, 9> kSections{{{0.26, 0.275, 0.200, 0.000},
                                            {0.34, 0.262, 0.190, 0.000},
                                            {0.55, 0.215, 0.160, 0.005},
                                            {0.80, 0.205, 0.155, 0.010},
                                            {1.00, 0.212, 0.160, 0.015},
                                            {1.18, 0.190, 0.145, 0.010},
                                            {1.36, 0.205, 0.140, 0.000},
                                            {1.48, 0.190, 0.110, -0.010},
                                            {1.58, 0.090, 0.075, -0.010}}};

Section section_at(double y) {
  std::size_t i = 1;
  while (i + 1 < kSections.size() && y > kSections[i].y) ++i;
  const Section& a = kSections[i - 1];
  const Section& b = kSections[i];
  const double t = ramp(a.y, b.y, y);
  const auto mix = [t](double from, double to) { return from + (to - from) * t; };
  return {y, mix(a.half_width, b.half_width), mix(a.half_depth, b.half_depth),
          mix(a.shift, b.shift)};
}

// A row of folds across its phase: rounded ridges with sharp valleys, in [0, 1].
double fold(double phase) { return 1.0 - std::abs(std::sin(0.5 * phase)); }

// How deep the cloth lies below the robe's outline: upright folds in the skirt, which wander and
// grow towards the hem, and folds that hang from shoulder to shoulder across the front.
double folds(const Vec3d& p, double azimuth) {
  const double front = ramp(-0.2, 0.6, std::cos(azimuth));
  const double wander = 0.5 * std::sin(2.0 * azimuth + 4.0 * p.y) + 0.25 * std::sin(9.0 * p.y);
  const double upright =
      0.75 * fold(17.0 * azimuth + 2.5 * wander) + 0.25 * fold(29.0 * azimuth - 3.0 * wander + 1.0);
  const double in_skirt = ramp(1.05, 0.4, p.y) * (1.0 - 0.45 * front);
  const double hanging = fold(2.0 * M_PI * (p.y - 2.4 * p.x * p.x) / 0.085 + 0.6 * wander);
  const double in_front = front * ramp(0.45, 0.7, p.y) * ramp(1.5, 1.38, p.y);
  return 0.034 * in_skirt * upright + 0.02 * in_front * hanging + 0.008 * (1.0 - front) * upright;
}

double robe(const Vec3d& p) {
  const Section s = section_at(p.y);
  const double azimuth = std::atan2(p.x / s.half_width, (p.z - s.shift) / s.half_depth);
  const double u = p.x / s.half_width;
  const double v = (p.z - s.shift) / s.half_depth;
  const double k0 = std::hypot(u, v);
  const double k1 = std::hypot(u / s.half_width, v / s.half_depth);
  const double outline = k1 > 0.0 ? k0 * (k0 - 1.0) / k1 : -s.half_depth;
  const double sides = outline + folds(p, azimuth);
  return smooth_max(sides, std::max(0.27 - p.y, p.y - 1.56), 0.03);
}

// Sleeves: cloth that hangs from the forearm, as a fan of capsules; between them lie its folds.
double sleeve(const Vec3d& p, const Vec3d& elbow, const Vec3d& wrist, const Vec3d& hem_elbow,
              const Vec3d& hem_wrist) {
  constexpr int kStrands = 6;
  const Vec3d middle = (elbow + wrist + hem_elbow + hem_wrist) * 0.25;
  const double reach = std::max((elbow - middle).length(), (hem_elbow - middle).length());
  const double bound = (p - middle).length() - std::max(reach, (hem_wrist - middle).length());
  if (bound > kFar) return bound;
  double cloth = 1e9;
  for (int i = 0; i < kStrands; ++i) {
    const double t = static_cast<double>(i) / (kStrands - 1);
    const Vec3d top = elbow + (wrist - elbow) * t;
    const Vec3d hem = hem_elbow + (hem_wrist - hem_elbow) * t + Vec3d(0.012 * (i % 2), 0, 0);
    cloth = smooth_min(cloth, capsule(p, top, hem, 0.042, 0.026), 0.03);
  }
  return cloth;
}

// Palm, four fingers and a thumb.
// @param up, across  unit: from the wrist to the fingertips, and towards the thumb
double hand(const Vec3d& p, const Vec3d& wrist, const Vec3d& up, const Vec3d& across) {
  const Vec3d palm = wrist + up * 0.06;
  const double bound = (p - palm).length() - 0.16;
  if (bound > kFar) return bound;
  double d = capsule(p, wrist, palm, 0.03, 0.036);
  for (int finger = 0; finger < 4; ++finger) {
    const double side = 0.018 * (1.5 - finger);
    const double length = finger == 1 || finger == 2 ? 0.085 : 0.07;
    const Vec3d knuckle = palm + up * 0.02 + across * side;
    d = smooth_min(d, capsule(p, knuckle, knuckle + up * length, 0.0125, 0.0095), 0.008);
  }
  return smooth_min(d, capsule(p, palm, palm + up * 0.045 + across * 0.055, 0.015, 0.011), 0.015);
}

// One hand raised with the palm forward, the other lowered and open.
double arms(const Vec3d& p) {
  const Vec3d right_elbow(-0.285, 1.1, 0.03);
  const Vec3d right_wrist(-0.275, 1.27, 0.19);
  const Vec3d left_elbow(0.285, 1.08, 0.02);
  const Vec3d left_wrist(0.27, 1.0, 0.22);
  double d = capsule(p, {-0.2, 1.44, -0.01}, right_elbow, 0.085, 0.07);
  d = smooth_min(d, capsule(p, {0.2, 1.44, -0.01}, left_elbow, 0.085, 0.07), 0.03);
  d = smooth_min(d, capsule(p, right_elbow, right_wrist, 0.065, 0.042), 0.03);
  d = smooth_min(d, capsule(p, left_elbow, left_wrist, 0.065, 0.042), 0.03);
  const Vec3d right_hem(-0.37, 0.62, 0.02);
  const Vec3d left_hem(0.36, 0.55, 0.02);
  d = smooth_min(d, sleeve(p, right_elbow, right_wrist, right_hem, {-0.33, 0.74, 0.16}), 0.03);
  d = smooth_min(d, sleeve(p, left_elbow, left_wrist, left_hem, {0.32, 0.6, 0.2}), 0.03);
  const Vec3d raised = Vec3d(-0.02, 1.0, 0.12).normalized();
  d = smooth_min(d, hand(p, right_wrist, raised, Vec3d(1.0, 0.0, 0.0)), 0.015);
  const Vec3d lowered = Vec3d(0.0, -0.45, 0.9).normalized();
  return smooth_min(d, hand(p, left_wrist, lowered, Vec3d(-1.0, 0.0, 0.0)), 0.015);
}

// Rows of curls above a line that runs from the brow over the ears to the nape.
double curls(const Vec3d& p, const Vec3d& center) {
  const Vec3d q = (p - center).normalized();
  const double hair = ramp(0.18, 0.3, q.y - 0.5 * q.z + 0.25);
  if (hair == 0.0) return 0.0;
  const double latitude = std::asin(std::clamp(q.y, -1.0, 1.0));
  const double azimuth = std::atan2(q.x, q.z);
  return hair * 0.011 * std::abs(std::sin(9.0 * latitude)) * std::abs(std::sin(8.0 * azimuth));
}

double face(const Vec3d& p) {
  const double x = std::abs(p.x);
  const Vec3d q(x, p.y, p.z);
  double d = ellipsoid(p, {0.0, 1.745, 0.01}, {0.092, 0.122, 0.104});
  d = smooth_min(d, ellipsoid(p, {0.0, 1.685, 0.055}, {0.06, 0.055, 0.05}), 0.04);  // jaw
  const double brow = capsule(q, {0.012, 1.768, 0.106}, {0.062, 1.776, 0.083}, 0.011, 0.008);
  d = smooth_min(d, brow, 0.02);
  d = smooth_min(d, capsule(p, {0, 1.77, 0.108}, {0, 1.728, 0.125}, 0.009, 0.016), 0.016);  // nose
  d = smooth_min(d, ellipsoid(q, {0.036, 1.752, 0.094}, {0.02, 0.009, 0.012}), 0.008);      // eyes
  d = smooth_min(d, ellipsoid(q, {0.013, 1.697, 0.105}, {0.02, 0.0075, 0.011}), 0.008);     // lips
  return smooth_min(d, ellipsoid(q, {0.096, 1.725, 0.0}, {0.018, 0.065, 0.03}), 0.012);     // ears
}

double head(const Vec3d& p) {
  const Vec3d center(0.0, 1.76, 0.0);
  const double bound = (p - center).length() - 0.32;
  if (bound > kFar) return bound;
  const double hair = ellipsoid(p, {0.0, 1.775, -0.012}, {0.102, 0.112, 0.108});
  const double knot = ellipsoid(p, {0.0, 1.885, -0.02}, {0.055, 0.055, 0.055});
  const double crown = smooth_min(hair, knot, 0.03) - curls(p, center);
  const double skull = smooth_max(crown, 1.735 - p.y + 0.55 * (p.z + 0.02), 0.02);
  const double neck = capsule(p, {0.0, 1.5, -0.01}, {0.0, 1.68, 0.0}, 0.072, 0.06);
  return smooth_min(smooth_min(face(p), skull, 0.012), neck, 0.03);
}

double plinth(const Vec3d& p) {
  const double slab = rounded_box(p, {0.0, 0.05, 0.0}, {0.37, 0.05, 0.32}, 0.012);
  const double azimuth = std::atan2(p.x, p.z);
  const double petals = 0.03 * std::abs(std::cos(9.0 * azimuth)) * ramp(0.25, 0.13, p.y);
  const double lotus = disc(p, 0.08, 0.21, 0.285 + petals, 0.05);
  const double top = disc(p, 0.2, 0.275, 0.3, 0.02);
  return smooth_min(smooth_min(slab, lotus, 0.015), top, 0.015);
}

double feet(const Vec3d& p) {
  const Vec3d q(std::abs(p.x), p.y, p.z);
  return ellipsoid(q, {0.085, 0.285, 0.19}, {0.052, 0.036, 0.085});
}

double field(const Vec3d& p) {
  const double shoulders =
      capsule({std::abs(p.x), p.y, p.z}, {0.0, 1.46, -0.01}, {0.19, 1.435, -0.01}, 0.09, 0.085);
  double d = smooth_min(robe(p), shoulders, 0.06);
  d = smooth_min(d, arms(p), 0.035);
  d = smooth_min(d, head(p), 0.03);
  d = smooth_min(d, feet(p), 0.015);
  return smooth_min(d, plinth(p), 0.012);
}

}  // namespace

TriangleMeshShape generate_statue(double detail) {
  return polygonise(field, {{-0.5, -0.04, -0.4}, {0.5, 2.02, 0.45}, 0.0125 / detail});
}

}  // namespace penumbra
