#pragma once

#include <functional>

#include "scenes/core/vec.h"

/// Radiance that a rough conductor reflects, by quadrature in double precision: the answers of the
/// stability suite for GGX lobes down to widths where the core's single precision is at its limits.
/// No code in common with scenes/core/bsdf.
namespace penumbra::stability {

/// A point of a rough conductor, in the frame of its normal (z).
struct GlossyPoint {
  double alpha{1};  ///< GGX width
  double eta{0.2};  ///< real part of the index of refraction
  double k{3.9};    ///< absorption coefficient
  Vec3d wo{0, 0, 1};
};

/// Unpolarised reflectance of a conductor against vacuum, from the complex amplitudes.
/// Source: Born and Wolf, "Principles of Optics", section 14.2.
double conductor_reflectance(double cosine, double eta, double k);

/// BRDF times cosine: D F G/(4 cos_o) with the height-correlated masking and shadowing of Smith.
/// Source: Walter et al. 2007, eq. 33; Heitz 2014, eq. 99.
double glossy_f_cos(const GlossyPoint& point, const Vec3d& wi);

/// Integral of `glossy_f_cos` over the directions inside a region. Half vectors are parametrised by
/// the distribution of their normals, in which the lobe has no peak:
///   integral = 1/(2 pi) int int F G2 (wo.h)/(cos_o cos_h) du dphi,  tan^2(theta_h) = alpha^2
///   u/(1-u)
/// Gauss-Legendre panels whose length halves towards u = 1, where the tail of the lobe lies.
/// @param inside  contains the mirrored direction, and every half plane of h about the normal
///                leaves it once: a convex light about the mirrored direction
double glossy_radiance(const GlossyPoint& point, const std::function<bool(const Vec3d&)>& inside);

/// The same over the whole hemisphere: the directional albedo.
double glossy_albedo(const GlossyPoint& point);

}  // namespace penumbra::stability
