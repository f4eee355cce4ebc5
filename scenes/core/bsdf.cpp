#include "scenes/core/bsdf.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/frame.h"
#include "scenes/core/sincos.h"
#include "scenes/core/warp.h"

namespace penumbra {
namespace {

constexpr float kOneMinusEpsilon = 1.0f - 0x1p-24f;

float mean(const Rgb& c) { return (c.x + c.y + c.z) / 3.0f; }

// Share of the glossy lobe in sampling: its share of the energy at normal incidence, kept away from 0 and 1 so that
// both lobes cover their part of the integrand.
float glossy_share(const Rgb& glossy, const Rgb& diffuse) {
  const float total = mean(glossy) + mean(diffuse);
  return total > 0.0f ? std::clamp(mean(glossy) / total, 0.05f, 0.95f) : 0.5f;
}

}  // namespace

Rgb conductor_fresnel(float cos_theta, const Rgb& eta, const Rgb& k) noexcept {
  const float cos2 = cos_theta * cos_theta;
  const float sin2 = std::max(0.0f, 1.0f - cos2);
  // Four lanes, the last a copy, so that the loop becomes vector instructions.
  const float etas[4] = {eta.x, eta.y, eta.z, eta.z};
  const float ks[4] = {k.x, k.y, k.z, k.z};
  float result[4];
  for (int c = 0; c < 4; ++c) {
    const float eta2 = etas[c] * etas[c];
    const float k2 = ks[c] * ks[c];
    const float t0 = eta2 - k2 - sin2;
    const float product = 4.0f * eta2 * k2;
    const float a2_plus_b2 = std::sqrt(t0 * t0 + product);
    // (a2_plus_b2 + t0)/2, in the form that does not cancel: (a2_plus_b2 + t0)(a2_plus_b2 - t0) = 4 eta^2 k^2.
    const float larger = a2_plus_b2 + std::abs(t0);
    const float a2 = t0 > 0.0f ? 0.5f * larger : 0.5f * product / std::max(larger, 1e-30f);
    const float t1 = a2_plus_b2 + cos2;
    const float t2 = 2.0f * std::sqrt(a2) * cos_theta;
    const float t3 = cos2 * a2_plus_b2 + sin2 * sin2;
    const float t4 = t2 * sin2;
    // Half of r_s (1 + r_p/r_s), with one division for both quotients.
    const float s_sum = t1 + t2;
    const float p_sum = t3 + t4;
    result[c] = (t1 - t2) * t3 / (s_sum * p_sum);
  }
  return {result[0], result[1], result[2]};
}

float ggx_distribution(const Vec3& h, float alpha) noexcept {
  const float alpha2 = alpha * alpha;
  const float t = h.x * h.x + h.y * h.y + alpha2 * h.z * h.z;
  return alpha2 / (kPi * t * t);
}

Bsdf::Bsdf(const MaterialDescription& material) {
  if (const auto* lambert = std::get_if<LambertMaterial>(&material.model)) {
    type_ = BsdfType::Lambert;
    diffuse_ = lambert->reflectance;
  } else if (const auto* conductor = std::get_if<ConductorMaterial>(&material.model)) {
    type_ = BsdfType::Conductor;
    specular_ = conductor->tint;
    eta_ = conductor->eta;
    k_ = conductor->k;
    alpha_ = conductor->alpha;
    glossy_probability_ = 1.0f;
  } else if (const auto* phong = std::get_if<PhongMaterial>(&material.model)) {
    type_ = BsdfType::Phong;
    diffuse_ = phong->diffuse;
    specular_ = phong->specular;
    exponent_ = phong->exponent;
    // kd/(kd + ks) as the fixtures of the estimators state it, without a floor: a lobe of weight 0 is not drawn.
    const float total = mean(diffuse_) + mean(specular_);
    glossy_probability_ = total > 0.0f ? mean(specular_) / total : 0.0f;
  } else {
    const auto& mixture = std::get<MixtureMaterial>(material.model);
    type_ = BsdfType::Mixture;
    diffuse_ = mixture.diffuse.reflectance * (1.0f - mixture.glossy_weight);
    specular_ = mixture.glossy.tint * mixture.glossy_weight;
    eta_ = mixture.glossy.eta;
    k_ = mixture.glossy.k;
    alpha_ = mixture.glossy.alpha;
    glossy_probability_ = glossy_share(specular_ * conductor_fresnel(1.0f, eta_, k_), diffuse_);
  }
}

bool Bsdf::is_black() const noexcept {
  return penumbra::is_black(diffuse_) && penumbra::is_black(specular_);
}

BoundBsdf::BoundBsdf(const Bsdf& bsdf, const Vec3& wo_local) noexcept : bsdf_(&bsdf), wo_(wo_local) {
  const float alpha2 = bsdf.alpha_ * bsdf.alpha_;
  lambda_o_ = std::sqrt(alpha2 + (1.0f - alpha2) * wo_.z * wo_.z);
  if (bsdf.has_glossy()) {
    stretched_ = Vec3(bsdf.alpha_ * wo_.x, bsdf.alpha_ * wo_.y, wo_.z).normalized();
  }
}

BsdfValue BoundBsdf::evaluate(const Vec3& wi) const noexcept {
  if (!(wi.z > 0.0f)) return {};
  switch (bsdf_->type_) {
    case BsdfType::Lambert: return {bsdf_->diffuse_ * (wi.z * kInvPi), wi.z * kInvPi};
    case BsdfType::Conductor: return evaluate_glossy(wi);
    case BsdfType::Phong: return evaluate_phong(wi);
    case BsdfType::Mixture: break;
  }
  BsdfValue value = evaluate_glossy(wi);
  const float p = bsdf_->glossy_probability_;
  value.f_cos += bsdf_->diffuse_ * (wi.z * kInvPi);
  value.pdf_w = p * value.pdf_w + (1.0f - p) * (wi.z * kInvPi);
  return value;
}

BsdfValue BoundBsdf::evaluate_glossy(const Vec3& wi) const noexcept {
  const Vec3 sum = wo_ + wi;
  const float length2 = dot(sum, sum);
  if (!(length2 > 0.0f)) return {};
  const Vec3 h = sum / std::sqrt(length2);
  const float alpha2 = bsdf_->alpha_ * bsdf_->alpha_;
  const float lambda_i = std::sqrt(alpha2 + (1.0f - alpha2) * wi.z * wi.z);
  const float d = ggx_distribution(h, bsdf_->alpha_);
  // Height-correlated Smith masking-shadowing over 4 cos_o cos_i, times cos_i; nothing is divided by a cosine.
  // Source: Heitz 2014, "Understanding the masking-shadowing function", eq. 99.
  const float visibility_cos = 0.5f * wi.z / (wi.z * lambda_o_ + wo_.z * lambda_i);
  const Rgb fresnel =
      conductor_fresnel(std::min(dot(wo_, h), 1.0f), bsdf_->eta_, bsdf_->k_);
  // Visible normals: D G1(wo)/(4 cos_o), with cos_o cancelled.
  return {bsdf_->specular_ * fresnel * (d * visibility_cos), d / (2.0f * (wo_.z + lambda_o_))};
}

BsdfValue BoundBsdf::evaluate_phong(const Vec3& wi) const noexcept {
  const float s = bsdf_->exponent_;
  const float p = bsdf_->glossy_probability_;
  const Vec3 mirror(-wo_.x, -wo_.y, wo_.z);
  const float cosine = dot(mirror, wi);
  float lobe = 0.0f;
  if (p > 0.0f && cosine > 0.0f) {
    // Next to the mirror direction 1 - cos comes from the chord: a large power magnifies the rounding of the cosine.
    const float log_cosine =
        cosine > 0.5f ? std::log1p(-0.5f * (mirror - wi).length2()) : std::log(cosine);
    lobe = std::exp(s * log_cosine) / (2.0f * kPi);
  }
  BsdfValue value;
  value.f_cos = (bsdf_->diffuse_ * kInvPi + bsdf_->specular_ * ((s + 2.0f) * lobe)) * wi.z;
  value.pdf_w = p * (s + 1.0f) * lobe + (1.0f - p) * (wi.z * kInvPi);
  return value;
}

std::optional<Vec3> BoundBsdf::sample(const Variates& variates) const noexcept {
  const bool glossy = variates.choice < bsdf_->glossy_probability_;
  Vec3 wi;
  if (!glossy) {
    wi = sample_cosine_hemisphere(variates.u);
  } else {
    wi = bsdf_->type_ == BsdfType::Phong ? sample_phong(variates.u) : sample_glossy(variates.u);
  }
  if (!(wi.z > 0.0f)) return std::nullopt;
  return wi;
}

// Source: Dupuy and Benyoub 2023, "Sampling visible GGX normals with spherical caps".
Vec3 BoundBsdf::sample_glossy(const Vec2& u) const noexcept {
  const float alpha = bsdf_->alpha_;
  const float depth = u.y * (1.0f + stretched_.z);  // 1 - z, for z uniform over (-stretched.z, 1]
  const float sin_theta = std::sqrt(std::max(0.0f, depth * (2.0f - depth)));
  const SinCos phi = sincos_turns(u.x);
  const Vec3 cap(sin_theta * phi.cosine, sin_theta * phi.sine, 1.0f - depth);
  const Vec3 h_std = cap + stretched_;
  const Vec3 h =
      Vec3(alpha * h_std.x, alpha * h_std.y, std::max(h_std.z, 0.0f)).normalized();
  return h * (2.0f * dot(wo_, h)) - wo_;
}

Vec3 BoundBsdf::sample_phong(const Vec2& u) const noexcept {
  // cos = u^(1/(s+1)); 1 - cos through expm1, which keeps its digits for large exponents.
  const float log_u = std::log(std::max(1.0f - u.x, 1.0f - kOneMinusEpsilon));
  const float depth = -std::expm1(log_u / (bsdf_->exponent_ + 1.0f));
  const float sin_theta = std::sqrt(depth * (2.0f - depth));
  const SinCos phi = sincos_turns(u.y);
  const Vec3 lobe(sin_theta * phi.cosine, sin_theta * phi.sine, 1.0f - depth);
  return Frame(Vec3(-wo_.x, -wo_.y, wo_.z)).to_world(lobe);
}

}  // namespace penumbra
