#pragma once

#include <algorithm>
#include <cmath>

#include "scenes/core/sincos.h"
#include "scenes/core/vec.h"
#include "scenes/core/warp.h"

/// Formulas of microfacet reflection, inline because the scalar forms and the loops over blocks
/// share them; a part of bsdf.cpp.
namespace penumbra {

/// One channel of conductor_fresnel.
inline float fresnel_channel(float cos_theta, float eta, float k) noexcept {
  const float cos2 = cos_theta * cos_theta;
  const float sin2 = std::max(0.0f, 1.0f - cos2);
  const float eta2 = eta * eta;
  const float k2 = k * k;
  const float t0 = eta2 - k2 - sin2;
  const float product = 4.0f * eta2 * k2;
  const float a2_plus_b2 = std::sqrt(t0 * t0 + product);
  // (a2_plus_b2 + t0)/2, in the form that does not cancel: (a2_plus_b2 + t0)(a2_plus_b2 - t0) = 4
  // eta^2 k^2.
  const float larger = a2_plus_b2 + std::abs(t0);
  const float small_a2 = 0.5f * product / std::max(larger, 1e-30f);
  const float a2 = t0 > 0.0f ? 0.5f * larger : small_a2;
  const float t1 = a2_plus_b2 + cos2;
  const float t2 = 2.0f * std::sqrt(a2) * cos_theta;
  const float t3 = cos2 * a2_plus_b2 + sin2 * sin2;
  const float t4 = t2 * sin2;
  // Half of r_s (1 + r_p/r_s), with one division for both quotients.
  return (t1 - t2) * t3 / ((t1 + t2) * (t3 + t4));
}

/// Schlick's share of a Fresnel term: F = F0 + (1 - F0) share.
/// @param cos_theta  angle to the (micro)normal, in [0, 1]
/// @return (1 - cos_theta)^5
/// Source: Schlick 1994, "An inexpensive BRDF model for physically-based rendering", eq. 15.
inline float schlick_share(float cos_theta) noexcept {
  const float x = 1.0f - cos_theta;
  const float x2 = x * x;
  return x2 * x2 * x;
}

/// 1 - schlick_share(cosine), as a polynomial, which keeps its digits at grazing angles.
inline float entering_share(float cosine) noexcept {
  return cosine * (5.0f + cosine * (-10.0f + cosine * (10.0f + cosine * (-5.0f + cosine))));
}

/// ggx_distribution for alpha^2.
inline float ggx(const Vec3& h, float alpha2) noexcept {
  const float t = h.x * h.x + h.y * h.y + alpha2 * h.z * h.z;
  return alpha2 / (kPi * t * t);
}

/// The GGX lobe at a point, by value: loops over lanes keep it in registers. Local frame as in
/// bsdf.h.
struct GlossyLobe {
  Vec3 wo;         ///< wo.z > 0
  Vec3 stretched;  ///< wo in the space where the microfacets are a hemisphere
  float alpha, alpha2;
  float lambda_o;  ///< sqrt(alpha^2 + (1 - alpha^2) cos^2(theta_o))

  struct Value {
    float f_cos;   ///< without Fresnel and tint
    float pdf_w;   ///< of `sample`
    float cosine;  ///< between wo and the microfacet's normal
  };

  /// @param wi  wi.z > 0
  Value evaluate(const Vec3& wi) const noexcept {
    const Vec3 sum = wo + wi;
    // Directions opposite to rounding have no half vector, and no microfacet reflects one into the
    // other.
    const float length2 = dot(sum, sum);
    const bool has_half = length2 > 0.0f;
    const float inv_length = 1.0f / std::sqrt(has_half ? length2 : 1.0f);
    const Vec3 h(sum.x * inv_length, sum.y * inv_length, has_half ? sum.z * inv_length : 1.0f);
    const float lambda_i = std::sqrt(alpha2 + (1.0f - alpha2) * wi.z * wi.z);
    const float d = has_half ? ggx(h, alpha2) : 0.0f;
    // Height-correlated Smith masking-shadowing over 4 cos_o cos_i, times cos_i; nothing is divided
    // by a cosine. Source: Heitz 2014, "Understanding the masking-shadowing function", eq. 99.
    const float visibility_cos = 0.5f * wi.z / (wi.z * lambda_o + wo.z * lambda_i);
    // Visible normals: D G1(wo)/(4 cos_o), with cos_o cancelled.
    return {d * visibility_cos, d / (2.0f * (wo.z + lambda_o)), std::min(1.0f, dot(wo, h))};
  }

  /// @param u, v  uniform in [0, 1)
  /// @return unit; below the horizon for draws that count as 0
  /// Source: Dupuy and Benyoub 2023, "Sampling visible GGX normals with spherical caps".
  Vec3 sample(float u, float v) const noexcept {
    const float depth = v * (1.0f + stretched.z);  // 1 - z, for z uniform over (-stretched.z, 1]
    const float sin_theta = std::sqrt(std::max(0.0f, depth * (2.0f - depth)));
    const SinCos phi = sincos_turns(u);
    const Vec3 cap(sin_theta * phi.cosine, sin_theta * phi.sine, 1.0f - depth);
    const Vec3 h_std = cap + stretched;
    const Vec3 h(alpha * h_std.x, alpha * h_std.y, std::max(h_std.z, 0.0f));
    // 2 (wo.n) n - wo for the normal n along h; a null h gives -wo, which is below the horizon.
    const float length2 = dot(h, h);
    return h * (2.0f * dot(wo, h) / (length2 > 0.0f ? length2 : 1.0f)) - wo;
  }
};

}  // namespace penumbra
