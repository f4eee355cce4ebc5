#include "scenes/core/bsdf.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"
#include "scenes/core/frame.h"
#include "scenes/core/microfacet.h"
#include "scenes/core/sincos.h"
#include "scenes/core/warp.h"

namespace penumbra {
namespace {

constexpr float kOneMinusEpsilon = 1.0f - 0x1p-24f;

float mean(const Rgb& c) { return (c.x + c.y + c.z) / 3.0f; }

// Share of the glossy lobe in sampling: its share of the energy at normal incidence, kept away from
// 0 and 1 so that both lobes cover their part of the integrand.
float glossy_share(const Rgb& glossy, const Rgb& diffuse) {
  const float total = mean(glossy) + mean(diffuse);
  return total > 0.0f ? std::clamp(mean(glossy) / total, 0.05f, 0.95f) : 0.5f;
}

constexpr float kMinAlpha = 1e-4f;

// kd/(kd + ks) as the fixtures of the estimators state it, without a floor: a lobe of weight 0 is
// not drawn.
float phong_share(const Rgb& specular, const Rgb& diffuse) {
  const float total = mean(diffuse) + mean(specular);
  return total > 0.0f ? mean(specular) / total : 0.0f;
}

// Mean of entering_share over the directions of a hemisphere, weighted with the cosine.
constexpr float kMeanEnteringShare = 20.0f / 21.0f;

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
  } else if (const auto* coated = std::get_if<MetallicRoughnessMaterial>(&material.model)) {
    type_ = BsdfType::MetallicRoughness;
    metallic_roughness_ = *coated;
    set_metallic_roughness(*coated);
  } else if (const auto* mirror = std::get_if<MirrorMaterial>(&material.model)) {
    type_ = BsdfType::Mirror;
    specular_ = mirror->reflectance;
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

// Diffuse base: (1 - m) c (1 - F0)/pi e(cos_i) e(cos_o) with e the share of light that Schlick's
// term lets enter, beyond F0. Reciprocal; its albedo is 20/21 (1 - m) c (1 - F(cos_o)), and the
// 1/21 that is missing to what a smooth coat lets in covers the rough lobe, whose albedo may exceed
// F(cos_o). The idea is that of Ashikhmin and Shirley 2000, "An anisotropic Phong BRDF model",
// section 3, here without the normalisation by 21/20: with it, rough coats would gain energy.
void Bsdf::set_metallic_roughness(const MetallicRoughnessMaterial& material) noexcept {
  constexpr float kDielectric = 0.04f;  // F0 of an index of refraction of 1.5
  const float base = 1.0f - material.metallic;
  specular_ = Rgb(kDielectric * base) + material.base_color * material.metallic;
  diffuse_ = material.base_color * base * (Rgb(1.0f) - specular_);
  alpha_ = std::max(kMinAlpha, material.roughness * material.roughness);
}

bool Bsdf::is_black() const noexcept {
  // A metal of base colour 0 still reflects at grazing angles.
  if (type_ == BsdfType::MetallicRoughness) return false;
  return penumbra::is_black(diffuse_) && penumbra::is_black(specular_);
}

BoundBsdf::BoundBsdf(const Bsdf& bsdf, const Vec3& wo_local) noexcept
    : bsdf_(bsdf), wo_(wo_local), glossy_probability_(bsdf.glossy_probability_) {
  const float alpha2 = bsdf.alpha_ * bsdf.alpha_;
  lambda_o_ = std::sqrt(alpha2 + (1.0f - alpha2) * wo_.z * wo_.z);
  if (bsdf.has_glossy()) {
    stretched_ = Vec3(bsdf.alpha_ * wo_.x, bsdf.alpha_ * wo_.y, wo_.z).normalized();
  }
  if (bsdf.type_ == BsdfType::MetallicRoughness) {
    // At grazing angles a coat reflects nearly all light, at normal incidence nearly none.
    const Rgb fresnel = bsdf.specular_ + (Rgb(1.0f) - bsdf.specular_) * schlick_share(wo_.z);
    const Rgb diffuse = bsdf.diffuse_ * (kMeanEnteringShare * entering_share(wo_.z));
    glossy_probability_ = penumbra::is_black(diffuse) ? 1.0f : glossy_share(fresnel, diffuse);
  }
}

GlossyLobe BoundBsdf::glossy() const noexcept {
  return {wo_, stretched_, bsdf_.alpha_, bsdf_.alpha_ * bsdf_.alpha_, lambda_o_};
}

// The metallic-roughness surface at the point, by value as the glossy lobe.
struct BoundBsdf::Coat {
  GlossyLobe lobe;
  float p;           // share of the glossy lobe in sampling
  float entering_o;  // entering_share of wo, over pi

  struct Value {
    float share;     // schlick_share at the microfacet
    float lobe_cos;  // glossy f cos without Fresnel
    float base_cos;  // diffuse f cos without its colour
    float pdf_w;
  };

  Value evaluate(const Vec3& wi) const noexcept {
    const GlossyLobe::Value value = lobe.evaluate(wi);
    return {schlick_share(value.cosine), value.f_cos, entering_o * entering_share(wi.z) * wi.z,
            p * value.pdf_w + (1.0f - p) * (wi.z * kInvPi)};
  }

  // One channel of f cos.
  static float f_cos(const Value& value, float f0, float base) noexcept {
    return (f0 + (1.0f - f0) * value.share) * value.lobe_cos + base * value.base_cos;
  }
};

BoundBsdf::Coat BoundBsdf::coat() const noexcept {
  return {glossy(), glossy_probability_, entering_share(wo_.z) * kInvPi};
}

BsdfValue BoundBsdf::evaluate_coat(const Vec3& wi) const noexcept {
  const Coat::Value value = coat().evaluate(wi);
  const Rgb f0 = bsdf_.specular_;
  const Rgb base = bsdf_.diffuse_;
  return {{Coat::f_cos(value, f0.x, base.x), Coat::f_cos(value, f0.y, base.y),
           Coat::f_cos(value, f0.z, base.z)},
          value.pdf_w};
}

void BoundBsdf::evaluate_coat(const VectorBlock& wi, std::size_t count,
                              VectorBlock& __restrict f_cos,
                              Block<float>& __restrict pdf) const noexcept {
  const Coat surface = coat();
  const Rgb f0 = bsdf_.specular_;
  const Rgb base = bsdf_.diffuse_;
  for (std::size_t i = 0; i < whole_groups(count); ++i) {
    const Coat::Value value = surface.evaluate(wi[i]);
    f_cos.x[i] = Coat::f_cos(value, f0.x, base.x);
    f_cos.y[i] = Coat::f_cos(value, f0.y, base.y);
    f_cos.z[i] = Coat::f_cos(value, f0.z, base.z);
    pdf[i] = value.pdf_w;
  }
}

BsdfValue BoundBsdf::evaluate(const Vec3& wi) const noexcept {
  if (!(wi.z > 0.0f) || bsdf_.is_delta()) return {};
  const float cosine_pdf = wi.z * kInvPi;
  if (bsdf_.type_ == BsdfType::Lambert) return {bsdf_.diffuse_ * cosine_pdf, cosine_pdf};
  if (bsdf_.type_ == BsdfType::Phong) return evaluate_phong(wi);
  if (bsdf_.type_ == BsdfType::MetallicRoughness) return evaluate_coat(wi);
  const GlossyLobe::Value lobe = glossy().evaluate(wi);
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
  if (bsdf_.type_ == BsdfType::MetallicRoughness) return evaluate_coat(wi, count, f_cos, pdf);
  if (bsdf_.is_delta()) {
    for (std::size_t i = 0; i < lanes; ++i) {
      f_cos.x[i] = f_cos.y[i] = f_cos.z[i] = 0.0f;
      pdf[i] = 0.0f;
    }
    return;
  }
  const GlossyLobe lobe = glossy();
  const float p = bsdf_.glossy_probability_;
  Block<float> lobe_cos;
  Block<float> cosine;
  for (std::size_t i = 0; i < lanes; ++i) {
    const GlossyLobe::Value value = lobe.evaluate(wi[i]);
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
  if (bsdf_.is_delta()) return std::nullopt;
  const bool is_glossy = variates.choice < glossy_probability_;
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
      wi.set(at + i, sample(variates[at + i]).value_or(Vec3(0.0f)));
    }
    return;
  }
  const std::size_t lanes = whole_groups(count);
  if (bsdf_.is_delta()) {
    for (std::size_t i = at; i < at + lanes; ++i) wi.x[i] = wi.y[i] = wi.z[i] = 0.0f;
    return;
  }
  const float p = glossy_probability_;
  if (p < 1.0f) {
    for (std::size_t i = 0; i < lanes; ++i) {
      const Vec3 w = sample_cosine_hemisphere({variates.x[at + i], variates.y[at + i]});
      wi.x[at + i] = w.x;
      wi.y[at + i] = w.y;
      wi.z[at + i] = w.z;
    }
  }
  if (!(p > 0.0f)) return;
  const GlossyLobe lobe = glossy();
  const float threshold = p < 1.0f ? p : 2.0f;  // a lone lobe is given no choice
  for (std::size_t i = 0; i < lanes; ++i) {
    const Vec3 w = lobe.sample(variates.x[at + i], variates.y[at + i]);
    const bool is_glossy = variates.choice[at + i] < threshold;
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
    case BsdfType::MetallicRoughness:
      bsdf.metallic_roughness_.base_color *= values.reflectance;
      bsdf.metallic_roughness_.metallic *= values.metallic;
      bsdf.metallic_roughness_.roughness *= values.roughness;
      bsdf.set_metallic_roughness(bsdf.metallic_roughness_);
      break;
    case BsdfType::Mirror:
      bsdf.specular_ *= values.reflectance;
      break;
  }
  return bsdf;
}

}  // namespace penumbra
