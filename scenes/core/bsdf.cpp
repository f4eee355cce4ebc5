#include "scenes/core/bsdf.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"
#include "scenes/core/frame.h"
#include "scenes/core/sincos.h"
#include "scenes/core/warp.h"

namespace penumbra {
namespace {

constexpr float kOneMinusEpsilon = 1.0f - 0x1p-24f;
constexpr float kMinAlpha = 1e-4f;

float mean(const Rgb& c) { return (c.x + c.y + c.z) / 3.0f; }

// Share of the glossy lobe in sampling: its share of the energy at normal incidence, kept away from
// 0 and 1 so that both lobes cover their part of the integrand.
float glossy_share(const Rgb& glossy, const Rgb& diffuse) {
  const float total = mean(glossy) + mean(diffuse);
  return total > 0.0f ? std::clamp(mean(glossy) / total, 0.05f, 0.95f) : 0.5f;
}

// kd/(kd + ks) as the fixtures of the estimators state it, without a floor: a lobe of weight 0 is
// not drawn.
float phong_share(const Rgb& specular, const Rgb& diffuse) {
  const float total = mean(diffuse) + mean(specular);
  return total > 0.0f ? mean(specular) / total : 0.0f;
}

// One channel of conductor_fresnel.
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

inline float ggx(const Vec3& h, float alpha2) noexcept {
  const float t = h.x * h.x + h.y * h.y + alpha2 * h.z * h.z;
  return alpha2 / (kPi * t * t);
}

}  // namespace

Rgb conductor_fresnel(float cos_theta, const Rgb& eta, const Rgb& k) noexcept {
  return {fresnel_channel(cos_theta, eta.x, k.x), fresnel_channel(cos_theta, eta.y, k.y),
          fresnel_channel(cos_theta, eta.z, k.z)};
}

float ggx_distribution(const Vec3& h, float alpha) noexcept { return ggx(h, alpha * alpha); }

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
    glossy_probability_ = phong_share(specular_, diffuse_);
  } else {
    PN_CHECK(std::holds_alternative<MixtureMaterial>(material.model), "the material is supported");
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

BoundBsdf::BoundBsdf(const Bsdf& bsdf, const Vec3& wo_local) noexcept : bsdf_(bsdf), wo_(wo_local) {
  const float alpha2 = bsdf.alpha_ * bsdf.alpha_;
  lambda_o_ = std::sqrt(alpha2 + (1.0f - alpha2) * wo_.z * wo_.z);
  if (bsdf.has_glossy()) {
    stretched_ = Vec3(bsdf.alpha_ * wo_.x, bsdf.alpha_ * wo_.y, wo_.z).normalized();
  }
}

// The glossy lobe at the point, by value: loops over lanes keep it in registers.
struct BoundBsdf::Glossy {
  Vec3 wo, stretched;
  float alpha, alpha2, lambda_o;

  struct Value {
    float f_cos;  // without Fresnel and tint
    float pdf_w;
    float cosine;  // between wo and the microfacet's normal
  };

  Value evaluate(const Vec3& wi) const noexcept {
    const Vec3 sum = wo + wi;
    // Directions opposite to rounding have no half vector, and no microfacet reflects one into the
    // other.
    const float length2 = dot(sum, sum);
    const Vec3 h = sum * (1.0f / std::sqrt(length2));
    const float lambda_i = std::sqrt(alpha2 + (1.0f - alpha2) * wi.z * wi.z);
    const float d = length2 > 0.0f ? ggx(h, alpha2) : 0.0f;
    // Height-correlated Smith masking-shadowing over 4 cos_o cos_i, times cos_i; nothing is divided
    // by a cosine. Source: Heitz 2014, "Understanding the masking-shadowing function", eq. 99.
    const float visibility_cos = 0.5f * wi.z / (wi.z * lambda_o + wo.z * lambda_i);
    // Visible normals: D G1(wo)/(4 cos_o), with cos_o cancelled.
    // The order of min's arguments turns the cosine of a missing h into 1.
    return {d * visibility_cos, d / (2.0f * (wo.z + lambda_o)), std::min(1.0f, dot(wo, h))};
  }

  // Source: Dupuy and Benyoub 2023, "Sampling visible GGX normals with spherical caps".
  Vec3 sample(float u, float v) const noexcept {
    const float depth = v * (1.0f + stretched.z);  // 1 - z, for z uniform over (-stretched.z, 1]
    const float sin_theta = std::sqrt(std::max(0.0f, depth * (2.0f - depth)));
    const SinCos phi = sincos_turns(u);
    const Vec3 cap(sin_theta * phi.cosine, sin_theta * phi.sine, 1.0f - depth);
    const Vec3 h_std = cap + stretched;
    const Vec3 h(alpha * h_std.x, alpha * h_std.y, std::max(h_std.z, 0.0f));
    // 2 (wo.n) n - wo for the normal n along h; a null h gives no number, which is not above the
    // horizon.
    return h * (2.0f * dot(wo, h) / dot(h, h)) - wo;
  }
};

BoundBsdf::Glossy BoundBsdf::glossy() const noexcept {
  return {wo_, stretched_, bsdf_.alpha_, bsdf_.alpha_ * bsdf_.alpha_, lambda_o_};
}

BsdfValue BoundBsdf::evaluate(const Vec3& wi) const noexcept {
  if (!(wi.z > 0.0f)) return {};
  const float cosine_pdf = wi.z * kInvPi;
  if (bsdf_.type_ == BsdfType::Lambert) return {bsdf_.diffuse_ * cosine_pdf, cosine_pdf};
  if (bsdf_.type_ == BsdfType::Phong) return evaluate_phong(wi);
  const Glossy::Value lobe = glossy().evaluate(wi);
  const Rgb fresnel = conductor_fresnel(lobe.cosine, bsdf_.eta_, bsdf_.k_);
  const float p = bsdf_.glossy_probability_;
  return {bsdf_.specular_ * fresnel * lobe.f_cos + bsdf_.diffuse_ * cosine_pdf,
          p * lobe.pdf_w + (1.0f - p) * cosine_pdf};
}

void BoundBsdf::evaluate(const VectorBlock& wi, std::size_t count, VectorBlock& __restrict f_cos,
                         Block<float>& __restrict pdf) const noexcept {
  if (bsdf_.type_ == BsdfType::Phong) {
    for (std::size_t i = 0; i < count; ++i) {
      const BsdfValue value = evaluate_phong(wi[i]);
      f_cos.set(i, value.f_cos);
      pdf[i] = value.pdf_w;
    }
    return;
  }
  const std::size_t lanes = whole_groups(count);
  const Rgb diffuse = bsdf_.diffuse_;
  if (bsdf_.type_ == BsdfType::Lambert) {
    for (std::size_t i = 0; i < lanes; ++i) {
      const float cosine_pdf = wi.z[i] * kInvPi;
      f_cos.x[i] = diffuse.x * cosine_pdf;
      f_cos.y[i] = diffuse.y * cosine_pdf;
      f_cos.z[i] = diffuse.z * cosine_pdf;
      pdf[i] = cosine_pdf;
    }
    return;
  }
  const Glossy lobe = glossy();
  const float p = bsdf_.glossy_probability_;
  Block<float> lobe_cos;
  Block<float> cosine;
  for (std::size_t i = 0; i < lanes; ++i) {
    const Glossy::Value value = lobe.evaluate(wi[i]);
    lobe_cos[i] = value.f_cos;
    cosine[i] = value.cosine;
    pdf[i] = p * value.pdf_w + (1.0f - p) * (wi.z[i] * kInvPi);
  }
  // A loop per channel: its constants fit the registers.
  const auto channel = [&](float eta, float k, float specular, float diffuse_c,
                           Block<float>& __restrict out) {
    for (std::size_t i = 0; i < lanes; ++i) {
      out[i] = specular * fresnel_channel(cosine[i], eta, k) * lobe_cos[i] +
               diffuse_c * (wi.z[i] * kInvPi);
    }
  };
  channel(bsdf_.eta_.x, bsdf_.k_.x, bsdf_.specular_.x, diffuse.x, f_cos.x);
  channel(bsdf_.eta_.y, bsdf_.k_.y, bsdf_.specular_.y, diffuse.y, f_cos.y);
  channel(bsdf_.eta_.z, bsdf_.k_.z, bsdf_.specular_.z, diffuse.z, f_cos.z);
}

BsdfValue BoundBsdf::evaluate_phong(const Vec3& wi) const noexcept {
  const float s = bsdf_.exponent_;
  const float p = bsdf_.glossy_probability_;
  const Vec3 mirror(-wo_.x, -wo_.y, wo_.z);
  const float cosine = dot(mirror, wi);
  float lobe = 0.0f;
  if (p > 0.0f && cosine > 0.0f) {
    // Next to the mirror direction 1 - cos comes from the chord: a large power magnifies the
    // rounding of the cosine.
    const float log_cosine =
        cosine > 0.5f ? std::log1p(-0.5f * (mirror - wi).length2()) : std::log(cosine);
    lobe = std::exp(s * log_cosine) / (2.0f * kPi);
  }
  BsdfValue value;
  value.f_cos = (bsdf_.diffuse_ * kInvPi + bsdf_.specular_ * ((s + 2.0f) * lobe)) * wi.z;
  value.pdf_w = p * (s + 1.0f) * lobe + (1.0f - p) * (wi.z * kInvPi);
  return value;
}

std::optional<Vec3> BoundBsdf::sample(const Variates& variates) const noexcept {
  const bool is_glossy = variates.choice < bsdf_.glossy_probability_;
  Vec3 wi;
  if (!is_glossy) {
    wi = sample_cosine_hemisphere(variates.u);
  } else {
    wi = bsdf_.type_ == BsdfType::Phong ? sample_phong(variates.u)
                                        : glossy().sample(variates.u.x, variates.u.y);
  }
  if (!(wi.z > 0.0f)) return std::nullopt;
  return wi;
}

void BoundBsdf::sample(const VariateBlock& variates, std::size_t count, std::size_t at,
                       VectorBlock& __restrict wi) const noexcept {
  if (bsdf_.type_ == BsdfType::Phong) {
    for (std::size_t i = 0; i < count; ++i) {
      wi.set(at + i, sample(variates[i]).value_or(Vec3(0.0f)));
    }
    return;
  }
  const std::size_t lanes = whole_groups(count);
  const float p = bsdf_.glossy_probability_;
  if (p < 1.0f) {
    for (std::size_t i = 0; i < lanes; ++i) {
      const Vec3 w = sample_cosine_hemisphere({variates.x[i], variates.y[i]});
      wi.x[at + i] = w.x;
      wi.y[at + i] = w.y;
      wi.z[at + i] = w.z;
    }
  }
  if (!(p > 0.0f)) return;
  const Glossy lobe = glossy();
  const float threshold = p < 1.0f ? p : 2.0f;  // a lone lobe is given no choice
  for (std::size_t i = 0; i < lanes; ++i) {
    const Vec3 w = lobe.sample(variates.x[i], variates.y[i]);
    const bool is_glossy = variates.choice[i] < threshold;
    wi.x[at + i] = is_glossy ? w.x : wi.x[at + i];
    wi.y[at + i] = is_glossy ? w.y : wi.y[at + i];
    wi.z[at + i] = is_glossy ? w.z : wi.z[at + i];
  }
}

Vec3 BoundBsdf::sample_phong(const Vec2& u) const noexcept {
  // cos = u^(1/(s+1)); 1 - cos through expm1, which keeps its digits for large exponents.
  const float log_u = std::log(std::max(1.0f - u.x, 1.0f - kOneMinusEpsilon));
  const float depth = -std::expm1(log_u / (bsdf_.exponent_ + 1.0f));
  const float sin_theta = std::sqrt(depth * (2.0f - depth));
  const SinCos phi = sincos_turns(u.y);
  const Vec3 lobe(sin_theta * phi.cosine, sin_theta * phi.sine, 1.0f - depth);
  return Frame(Vec3(-wo_.x, -wo_.y, wo_.z)).to_world(lobe);
}

Bsdf Bsdf::with(const SurfaceValues& values) const noexcept {
  Bsdf bsdf = *this;
  const float scaled_alpha = std::max(kMinAlpha, alpha_ * values.roughness * values.roughness);
  switch (type_) {
    case BsdfType::Lambert:
      bsdf.diffuse_ *= values.reflectance;
      break;
    case BsdfType::Conductor:
      bsdf.specular_ *= values.reflectance;
      bsdf.alpha_ = scaled_alpha;
      break;
    case BsdfType::Phong:
      bsdf.diffuse_ *= values.reflectance;
      bsdf.glossy_probability_ = phong_share(specular_, bsdf.diffuse_);
      break;
    case BsdfType::Mixture:
      bsdf.diffuse_ *= values.reflectance;
      bsdf.alpha_ = scaled_alpha;
      bsdf.glossy_probability_ =
          glossy_share(specular_ * conductor_fresnel(1.0f, eta_, k_), bsdf.diffuse_);
      break;
  }
  return bsdf;
}

}  // namespace penumbra
