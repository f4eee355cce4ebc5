#pragma once

#include <optional>

#include "scenes/core/block.h"
#include "scenes/core/sampler.h"
#include "scenes/core/scene_description.h"
#include "scenes/core/surface_values.h"
#include "scenes/core/vec.h"

/// Reflection of a surface. Local frame: z is the shading normal, turned to the side of the viewer;
/// `wo` (towards the viewer) and `wi` (towards the light) both point away from the surface and are
/// unit vectors.
namespace penumbra {

enum class BsdfType : std::uint8_t {
  Lambert,
  Conductor,
  Phong,
  Mixture,
  MetallicRoughness,
  Mirror,  ///< no function of directions: neither evaluated nor sampled
};

struct GlossyLobe;

/// Value and density of one direction, found together because they share most of their work.
struct BsdfValue {
  Rgb f_cos{0.0f};    ///< f(wo, wi) |cos theta_i| [1/sr]; 0 below the horizon
  float pdf_w{0.0f};  ///< density of `BoundBsdf::sample` [1/sr]; 0 below the horizon
};

/// A material's reflection with its constants worked out; immutable, shared by all points of the
/// material.
class Bsdf {
 public:
  explicit Bsdf(const MaterialDescription& material);

  BsdfType type() const noexcept { return type_; }
  bool is_black() const noexcept;
  /// Smallest GGX alpha of its lobes; 1 where there is no glossy lobe.
  float min_alpha() const noexcept { return has_glossy() ? alpha_ : 1.0f; }
  bool has_glossy() const noexcept {
    return type_ == BsdfType::Conductor || type_ == BsdfType::Mixture ||
           type_ == BsdfType::MetallicRoughness;
  }
  /// Whether all light is reflected along the mirrored direction, `BoundBsdf::mirrored`. `evaluate`
  /// then gives 0 and `sample` no direction.
  bool is_delta() const noexcept { return type_ == BsdfType::Mirror; }
  /// Share of the radiance along the mirrored direction that is reflected; 0 unless `is_delta`.
  Rgb delta_reflectance() const noexcept { return is_delta() ? specular_ : Rgb(0.0f); }

  /// The material where its textures have these values. Values of 1 change no bit.
  Bsdf with(const SurfaceValues& values) const noexcept;

 private:
  friend class BoundBsdf;

  void set_metallic_roughness(const MetallicRoughnessMaterial& material) noexcept;

  BsdfType type_;
  Rgb diffuse_{0.0f};   // reflectance of the diffuse lobe, weight included
  Rgb specular_{0.0f};  // tint of the glossy or Phong lobe, weight included; F0 of
                        // metallic-roughness; reflectance of a mirror
  Rgb eta_{1.0f}, k_{0.0f};
  float alpha_{1.0f};
  float exponent_{1.0f};
  float glossy_probability_{0.0f};                  // share of the glossy lobe in sampling
  MetallicRoughnessMaterial metallic_roughness_{};  // as described; textures are factors on it
};

/// A Bsdf with its outgoing direction fixed: what one estimate evaluates and samples many times.
class BoundBsdf {
 public:
  /// @param wo_local  wo_local.z > 0
  BoundBsdf(const Bsdf& bsdf, const Vec3& wo_local) noexcept;

  /// Value and density of a direction; both 0 where wi_local.z <= 0.
  BsdfValue evaluate(const Vec3& wi_local) const noexcept;

  /// Draws an incident direction from the density that `evaluate` gives.
  /// @return nullopt where the draw falls below the horizon: it counts as a sample of value 0
  std::optional<Vec3> sample(const Variates& variates) const noexcept;

  /// `evaluate` of the directions in lanes [0, count), all above the horizon.
  void evaluate(const VectorBlock& wi_local, std::size_t count, VectorBlock& f_cos,
                Block<float>& pdf) const noexcept;

  /// `sample` for the variates of lanes [at, at + count), into the same lanes; a draw below the
  /// horizon has no positive z.
  void sample(const VariateBlock& variates, std::size_t count, std::size_t at,
              VectorBlock& wi_local) const noexcept;

  const Bsdf& bsdf() const noexcept { return bsdf_; }

  /// `sample` takes the glossy lobe where `Variates::choice` is below this.
  float glossy_probability() const noexcept { return glossy_probability_; }

  /// Whether `sample` reads `Variates::choice`.
  bool uses_choice() const noexcept {
    return glossy_probability() > 0.0f && glossy_probability() < 1.0f;
  }

  /// From now on `sample` draws from the glossy or Phong lobe alone, where there is one. Its
  /// density then is not positive wherever f is: for mixtures whose other components cover the
  /// rest.
  void leave_out_diffuse_samples() noexcept {
    glossy_probability_ = glossy_probability_ > 0.0f ? 1.0f : 0.0f;
    bsdf_.glossy_probability_ = glossy_probability_;
  }

  /// The direction that a mirror reflects to wo, local.
  Vec3 mirrored() const noexcept { return {-wo_.x, -wo_.y, wo_.z}; }

 private:
  GlossyLobe glossy() const noexcept;
  struct Coat;
  Coat coat() const noexcept;
  BsdfValue evaluate_coat(const Vec3& wi) const noexcept;
  void evaluate_coat(const VectorBlock& wi, std::size_t count, VectorBlock& f_cos,
                     Block<float>& pdf) const noexcept;
  BsdfValue evaluate_phong(const Vec3& wi) const noexcept;
  Vec3 sample_phong(const Vec2& u) const noexcept;

  Bsdf bsdf_;
  Vec3 wo_;
  float glossy_probability_;
  Vec3 stretched_{0.0f, 0.0f, 1.0f};  // wo in the space where the microfacets are a hemisphere
  float lambda_o_{
      0};  // sqrt(alpha^2 + (1 - alpha^2) cos^2(theta_o)), shared by masking and density
};

/// Fresnel reflectance of a conductor against vacuum, unpolarised.
/// @param cos_theta  angle to the (micro)normal, in [0, 1]
/// Source: Born and Wolf, "Principles of Optics", section 14.4.
Rgb conductor_fresnel(float cos_theta, const Rgb& eta, const Rgb& k) noexcept;

/// GGX distribution of microfacet normals, per steradian of h. In terms of the components of h
/// rather than its cosine: 1 - cos^2 has no digits left for alpha below 1e-3. Source: Walter et al.
/// 2007, "Microfacet models for refraction through rough surfaces", eq. 33.
float ggx_distribution(const Vec3& h_local, float alpha) noexcept;

}  // namespace penumbra
