#pragma once

#include <span>

#include "scenes/core/vec.h"

/// Direct light that has a closed form: the answers of the stability suite. Double precision, and
/// no code in common with the scene core or the estimators.
namespace penumbra::stability {

/// Irradiance from a planar convex polygon of radiance 1, seen from either side; what is below the
/// horizon is cut off.
/// @param corners  at least three, in order, either sense
/// @param normal   unit, of the receiver
/// Source: Lambert 1760, "Photometria": half the sum over edges of the angle that the edge spans
/// times the cosine between the normals of the receiver and of the plane through point and edge.
double polygon_irradiance(std::span<const Vec3d> corners, const Vec3d& from, const Vec3d& normal);

/// Irradiance from a sphere of radiance 1 that is wholly above the horizon: pi sin^2(a) cos(b), a
/// the sphere's angular radius and b the angle between its centre and the normal.
/// @param from  outside of the sphere
double sphere_irradiance(const Vec3d& center, double radius, const Vec3d& from,
                         const Vec3d& normal);

/// Irradiance from a patch of the sky of radiance 1, on a surface that faces the pole: the integral
/// of cos(theta) sin(theta) over polar angles [theta0, theta1] and `width` of azimuth [rad].
/// @param theta0, theta1  in [0, pi/2]
double sky_patch_irradiance(double theta0, double theta1, double width);

/// Irradiance from a white sky of radiance 1 on a surface whose shading normal is turned away from
/// the geometric one: only the part of the sky above both horizons counts. pi (1 + cos(angle))/2.
double bent_normal_irradiance(double angle);

/// Radiance that a Phong lobe over a diffuse base reflects along its normal, from a cap of the sky
/// of radiance 1 about it: kd sin^2(a) + ks (1 - cos(a)^(s+2)), a the cap's half angle.
/// @param sin_angle  sine of a, in [0, 1]
double phong_cap_radiance(double diffuse, double specular, double exponent, double sin_angle);

}  // namespace penumbra::stability
