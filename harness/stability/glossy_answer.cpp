#include "harness/stability/glossy_answer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

namespace penumbra::stability {
namespace {

/// Gauss-Legendre of eight points on [-1, 1], the positive half.
/// Source: Abramowitz and Stegun, table 25.4.
constexpr std::array<double, 4> kNodes{0.183434642495650, 0.525532409916329, 0.796666477413627,
                                       0.960289856497536};
constexpr std::array<double, 4> kWeights{0.362683783378362, 0.313706645877887, 0.222381034453374,
                                         0.101228536290376};
constexpr int kPanels = 40;
constexpr int kAzimuths = 1024;

template <typename Function>
double gauss_legendre(double from, double to, const Function& f) {
  const double middle = 0.5 * (from + to);
  const double half = 0.5 * (to - from);
  double sum = 0;
  for (std::size_t i = 0; i < kNodes.size(); ++i) {
    sum += kWeights[i] * (f(middle - half * kNodes[i]) + f(middle + half * kNodes[i]));
  }
  return half * sum;
}

double stretched_cosine(double alpha, double cosine) {
  return std::sqrt(alpha * alpha + (1 - alpha * alpha) * cosine * cosine);
}

/// u by its distance from 1, which keeps its digits in the tail.
Vec3d half_vector(double alpha, double one_minus_u, double phi) {
  const double u = 1 - one_minus_u;
  const double denominator = one_minus_u + alpha * alpha * u;
  const double sine = alpha * std::sqrt(u / denominator);
  return {sine * std::cos(phi), sine * std::sin(phi), std::sqrt(one_minus_u / denominator)};
}

Vec3d reflected(const Vec3d& wo, const Vec3d& h) { return h * (2 * wo.dot(h)) - wo; }

/// F G2 (wo.h)/(cos_o cos_h), 0 where the direction is below the horizon.
double weight(const GlossyPoint& point, const Vec3d& h) {
  const double cosine = point.wo.dot(h);
  const Vec3d wi = reflected(point.wo, h);
  if (!(cosine > 0 && wi.z > 0)) return 0;
  const double masking = wi.z * stretched_cosine(point.alpha, point.wo.z) +
                         point.wo.z * stretched_cosine(point.alpha, wi.z);
  return conductor_reflectance(std::min(1.0, cosine), point.eta, point.k) * 2 * wi.z * cosine /
         (h.z * masking);
}

/// Distance from 1 of the u at which the half plane at azimuth phi leaves the region.
double exit_of(const GlossyPoint& point, double phi,
               const std::function<bool(const Vec3d&)>& inside) {
  const auto is_inside = [&](double log2) {
    return inside(reflected(point.wo, half_vector(point.alpha, std::exp2(log2), phi)));
  };
  double out = -60;  // log2(1 - u)
  double in = -1e-12;
  if (is_inside(out)) return 0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (in + out);
    (is_inside(middle) ? in : out) = middle;
  }
  return std::exp2(in);
}

/// Integral over u from 0 to 1 - `rest` at one azimuth.
double radial(const GlossyPoint& point, double phi, double rest) {
  double sum = 0;
  double upper = 1;  // of 1 - u
  for (int i = 0; i < kPanels && upper > rest; ++i) {
    const double lower = std::max(i + 1 == kPanels ? 0.0 : 0.5 * upper, rest);
    sum += gauss_legendre(lower, upper, [&](double one_minus_u) {
      return weight(point, half_vector(point.alpha, one_minus_u, phi));
    });
    upper = lower;
  }
  return sum;
}

}  // namespace

double conductor_reflectance(double cosine, double eta, double k) {
  const std::complex<double> index(eta, k);
  const std::complex<double> inner = std::sqrt(index * index - (1 - cosine * cosine));
  const double s = std::norm((cosine - inner) / (cosine + inner));
  const std::complex<double> across = index * index * cosine;
  const double p = std::norm((across - inner) / (across + inner));
  return 0.5 * (s + p);
}

double glossy_f_cos(const GlossyPoint& point, const Vec3d& wi) {
  if (!(wi.z > 0)) return 0;
  const Vec3d h = (wi + point.wo).normalized();
  const double a2 = point.alpha * point.alpha;
  const double t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
  const double masking = wi.z * stretched_cosine(point.alpha, point.wo.z) +
                         point.wo.z * stretched_cosine(point.alpha, wi.z);
  return a2 / (M_PI * t * t) *
         conductor_reflectance(std::min(1.0, point.wo.dot(h)), point.eta, point.k) * 0.5 * wi.z /
         masking;
}

double glossy_radiance(const GlossyPoint& point, const std::function<bool(const Vec3d&)>& inside) {
  double sum = 0;
  for (int i = 0; i < kAzimuths; ++i) {
    const double phi = 2 * M_PI * (i + 0.5) / kAzimuths;
    sum += radial(point, phi, exit_of(point, phi, inside));
  }
  return sum / kAzimuths;
}

double glossy_albedo(const GlossyPoint& point) {
  // A half plane of h meets the horizon of wi once: along it wi.z is a cosine of 2 theta_h.
  return glossy_radiance(point, [](const Vec3d& wi) { return wi.z > 0; });
}

}  // namespace penumbra::stability
