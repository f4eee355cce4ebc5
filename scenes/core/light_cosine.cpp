// Rectangle lights by solid angle and cosine: the unit square of sampling by solid angle is drawn
// with a bilinear density, whose corners have the cosines of the rectangle's corners at the
// receiver. Source: Hart, Pharr, Mueller, Lopes, McGuire and Shirley 2020, "Practical product
// sampling by fitting and composing warps".

#include <algorithm>
#include <cmath>

#include "scenes/core/light.h"

namespace penumbra {
namespace {

// Least density of a corner against the largest. Between corners the cosine is not bilinear, and a
// shading normal can tilt it: without a floor, f/pdf would have no bound.
constexpr double kLeastCorner = 1.0 / 32.0;

double mix(double t, double a, double b) noexcept { return a + t * (b - a); }

// The place x in [0, 1] where a density that goes linearly from a to b has the share u below it.
double sample_linear(double u, double a, double b) noexcept {
  return std::min(1.0, u * (a + b) / (a + std::sqrt(mix(u, a * a, b * b))));
}

}  // namespace

void LightProposal::set_up_cosines(const Vec3& normal) noexcept {
  const Vec3d up(normal);
  double largest = 0.0;
  for (int i = 0; i < 4; ++i) {
    const Vec3d d =
        axis_x_ * (i % 2 == 0 ? x0_ : x1_) + axis_y_ * (i < 2 ? y0_ : y1_) + axis_z_ * z0_;
    corner_[i] = std::max(0.0, up.dot(d) / d.length());
    largest = std::max(largest, corner_[i]);
  }
  if (!(largest > 0.0)) return;  // wholly below the horizon: nothing to prefer
  double sum = 0.0;
  for (double& c : corner_) {
    c = std::max(c, kLeastCorner * largest);
    sum += c;
  }
  for (double& c : corner_) c *= 4.0 / sum;
  mode_ = Mode::RectangleCosine;
}

LightSample LightProposal::sample_rectangle_cosine(const Vec2& u) const noexcept {
  const double y =
      sample_linear(static_cast<double>(u.y), corner_[0] + corner_[1], corner_[2] + corner_[3]);
  const double low = mix(y, corner_[0], corner_[2]);
  const double high = mix(y, corner_[1], corner_[3]);
  const double x = sample_linear(static_cast<double>(u.x), low, high);
  LightSample sample = sample_rectangle_angle(x, y);
  sample.pdf_w = static_cast<float>(mix(x, low, high) / solid_angle_);
  return sample;
}

// Density over the square where sampling by solid angle gives wi, a direction that meets the
// rectangle.
double LightProposal::cosine_warp(const Vec3& wi) const noexcept {
  const Vec3d w(wi);
  const double t = z0_ / w.dot(axis_z_);
  const double x = std::clamp(t * w.dot(axis_x_), x0_, x1_);
  const double y = std::clamp(t * w.dot(axis_y_), y0_, y1_);
  // The share of the solid angle before x, by the sum of arcsines for the rectangle that ends
  // there; then the share of the strip at x, where the solid angle grows with the sine.
  const double d2 = x * x + z0_ * z0_;
  const double n1 = x / std::sqrt(d2);
  const double u = (std::asin(b0_ * n1) + std::asin(n1 * b1_) + (M_PI - k_)) / solid_angle_;
  const auto sine = [d2](double at) { return at / std::sqrt(d2 + at * at); };
  const double first = sine(y0_);
  const double v = (sine(y) - first) / (sine(y1_) - first);
  const double across = std::clamp(u, 0.0, 1.0);
  const double along = std::clamp(v, 0.0, 1.0);
  return mix(along, mix(across, corner_[0], corner_[1]), mix(across, corner_[2], corner_[3]));
}

}  // namespace penumbra
