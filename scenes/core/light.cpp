#include "scenes/core/light.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scenes/core/frame.h"
#include "scenes/core/warp.h"

namespace penumbra {
namespace {

// Below this solid angle [sr] the spherical rectangle is flat to rounding and uniform area sampling
// is as good; the choice depends on the point only, so sampling and density agree.
constexpr double kMinSphericalRectangle = 1e-5;

// A density over the solid angle after a warp of the square it is drawn from.
float warped(float pdf_w, double density) noexcept {
  return static_cast<float>(static_cast<double>(pdf_w) * density);
}

// Share of a spot light's intensity that leaves it against wi: the square of the linear share of
// cosines between the outer and the inner angle. 1 - cos comes from the chord, which keeps its
// digits next to the axis. Source: glTF extension KHR_lights_punctual, "Inner and Outer Cone
// Angles".
double spot_falloff(const Light& light, const Vec3d& wi) noexcept {
  const double depth = 0.5 * (wi + light.axis).length2();
  const double share = (light.outer_depth - depth) / (light.outer_depth - light.inner_depth);
  const double clamped = std::clamp(share, 0.0, 1.0);
  return clamped * clamped;
}

}  // namespace

std::string_view to_string(LightSampling sampling) {
  switch (sampling) {
    case LightSampling::Area:
      return "area";
    case LightSampling::SolidAngle:
      return "solid_angle";
    case LightSampling::Cosine:
      break;
  }
  return "cosine";
}

bool LightProposal::set_up(const Light& light, LightSampling sampling, const Vec3& from,
                           const Vec3& normal, bool keep_all) noexcept {
  light_ = &light;
  from_ = from;
  const bool is_shape = light.type == LightType::Rectangle || light.type == LightType::Sphere ||
                        light.type == LightType::Mesh;
  if (is_shape && !keep_all && is_black(light.radiance)) return false;
  switch (light.type) {
    case LightType::Rectangle: {
      // The highest of the four corners, without the slack of the bounding box.
      const float base = dot(normal, light.origin - from);
      const float rise_u = std::max(dot(normal, light.edge_u), 0.0f);
      const float rise_v = std::max(dot(normal, light.edge_v), 0.0f);
      return (keep_all || base + rise_u + rise_v > 0.0f) &&
             set_up_rectangle(sampling, normal, keep_all);
    }
    case LightType::Sphere:
      return (keep_all || dot(normal, light.center - from) + light.radius > 0.0f) &&
             set_up_sphere(keep_all);
    case LightType::Mesh:
      return set_up_mesh(normal, keep_all);
    case LightType::Environment:
      mode_ = Mode::Environment;
      compensated_ = nullptr;
      return keep_all || light.environment.can_light(normal);
    case LightType::Point:
    case LightType::Spot:
    case LightType::Directional:
      break;  // no density: sample_delta
  }
  return false;
}

std::optional<DeltaSample> sample_delta(const Light& light, const Vec3& from,
                                        const Vec3& normal) noexcept {
  if (light.type == LightType::Directional) {
    const Vec3 wi(-light.axis);
    if (!(dot(wi, normal) > 0.0f)) return std::nullopt;
    return DeltaSample{wi, std::numeric_limits<float>::infinity(), light.irradiance};
  }
  // In double, whose range holds the square of every length in float.
  const Vec3d to_light = Vec3d(light.center) - Vec3d(from);
  if (!(to_light.dot(Vec3d(normal)) > 0.0)) return std::nullopt;
  const double distance2 = to_light.dot(to_light);
  const double distance = std::sqrt(distance2);
  const Vec3d wi = to_light / distance;
  const double falloff = light.type == LightType::Spot ? spot_falloff(light, wi) : 1.0;
  if (!(falloff > 0.0)) return std::nullopt;
  return DeltaSample{Vec3(wi), static_cast<float>(distance),
                     Rgb(Vec3(light.intensity / distance2 * falloff))};
}

bool LightProposal::set_up_rectangle(LightSampling sampling, const Vec3& normal,
                                     bool keep_all) noexcept {
  const Light& light = *light_;
  to_origin_ = light.origin - from_;
  // In double: seen nearly edge-on, the terms cancel, and densities are as wrong as the height.
  height_ = static_cast<float>(light.plane_normal.dot(Vec3d(light.origin) - Vec3d(from_)));
  // On the dark side or in the plane of the light nothing arrives.
  if (height_ == 0.0f || (!keep_all && !light.two_sided && height_ > 0.0f)) return false;
  const float length2_u = light.edge_u.length2();
  const float length2_v = light.edge_v.length2();
  inv_length2_u_ = 1.0f / length2_u;
  inv_length2_v_ = 1.0f / length2_v;
  inv_area_height_ = 1.0f / (std::sqrt(length2_u * length2_v) * std::abs(height_));
  mode_ = Mode::RectangleArea;
  if (sampling == LightSampling::Area) return std::isfinite(inv_area_height_);

  // Spherical rectangle. Source: Urena, Fajardo and King 2013, "An area-preserving parametrization
  // for spherical rectangles". The solid angle is a sum of arcsines instead of arccosines minus 2
  // pi, which cancels.
  axis_x_ = Vec3d(light.edge_u).normalized();
  axis_y_ = Vec3d(light.edge_v).normalized();
  axis_z_ = axis_x_.cross(axis_y_);
  const Vec3d d = Vec3d(light.origin) - Vec3d(from_);
  z0_ = d.dot(axis_z_);
  if (z0_ > 0.0) {  // the formulas want the rectangle on the negative side of z
    axis_z_ = -axis_z_;
    z0_ = -z0_;
  }
  x0_ = d.dot(axis_x_);
  y0_ = d.dot(axis_y_);
  x1_ = x0_ + std::sqrt(static_cast<double>(length2_u));
  y1_ = y0_ + std::sqrt(static_cast<double>(length2_v));
  const double z2 = z0_ * z0_;
  // z components of the unit normals of the four planes through the point and an edge.
  const double n0 = -y0_ / std::sqrt(z2 + y0_ * y0_);
  const double n1 = x1_ / std::sqrt(z2 + x1_ * x1_);
  const double n2 = y1_ / std::sqrt(z2 + y1_ * y1_);
  const double n3 = -x0_ / std::sqrt(z2 + x0_ * x0_);
  const double s01 = std::asin(n0 * n1);
  const double s12 = std::asin(n1 * n2);
  const double s23 = std::asin(n2 * n3);
  const double s30 = std::asin(n3 * n0);
  solid_angle_ = s01 + s12 + s23 + s30;
  if (!(solid_angle_ > kMinSphericalRectangle)) return std::isfinite(inv_area_height_);
  b0_ = n0;
  b1_ = n2;
  k_ = M_PI - s23 - s30;  // 2 pi minus the two inner angles at the edge x = x0
  pdf_constant_ = static_cast<float>(1.0 / solid_angle_);
  mode_ = Mode::RectangleAngle;
  if (sampling == LightSampling::Cosine) set_up_cosines(normal);
  return true;
}

bool LightProposal::set_up_sphere(bool keep_all) noexcept {
  const Light& light = *light_;
  // In double: next to the surface, distance and radius cancel.
  const Vec3d to_center = Vec3d(light.center) - Vec3d(from_);
  const double distance2 = to_center.length2();
  const double radius = static_cast<double>(light.radius);
  const double tangent2 = distance2 - radius * radius;
  if (!(tangent2 > 0.0)) {
    mode_ = Mode::SphereInside;  // only a two-sided sphere lights its inside
    pdf_constant_ = uniform_sphere_pdf_w();
    return keep_all || light.two_sided;
  }
  mode_ = Mode::SphereCone;
  const double distance = std::sqrt(distance2);
  one_minus_cos_ =
      static_cast<float>(radius * radius / (distance * (distance + std::sqrt(tangent2))));
  if (!(one_minus_cos_ > 0.0f)) return false;
  axis_ = Vec3(to_center / distance);
  pdf_constant_ = uniform_cone_pdf_w(one_minus_cos_);
  return std::isfinite(pdf_constant_);
}

DirectionCone cone_around(const Vec3d& to_middle, double radius) noexcept {
  const double distance = to_middle.length();
  const double sine = radius * (1.0 + 1e-6) / distance;
  if (!(sine < 1.0)) return {};
  const double depth = sine * sine / (1.0 + std::sqrt(1.0 - sine * sine));
  return {Vec3(to_middle / distance),
          static_cast<float>(depth * (1.0 + 1e-5) + 1e-6 * std::sqrt(depth) + 1e-12)};
}

DirectionCone LightProposal::directions() const noexcept {
  const Light& light = *light_;
  switch (mode_) {
    case Mode::RectangleArea:
    case Mode::RectangleAngle:
    case Mode::RectangleCosine: {
      const Vec3d half = (Vec3d(light.edge_u) + Vec3d(light.edge_v)) * 0.5;
      return cone_around(Vec3d(to_origin_) + half, half.length());
    }
    case Mode::SphereCone:
      return cone_around(Vec3d(light.center) - Vec3d(from_), static_cast<double>(light.radius));
    case Mode::Mesh:
      return {axis_, one_minus_cos_};
    case Mode::SphereInside:
    case Mode::Environment:
      break;
  }
  return {};
}

// The rectangle as seen from the point, by value: loops over lanes keep it in registers.
struct LightProposal::Rectangle {
  Vec3 to_origin, edge_u, edge_v, normal;
  float height, inv_length2_u, inv_length2_v, inv_area_height, pdf_constant;
  bool by_area;

  LightSample sample_area(float u, float v) const noexcept {
    const Vec3 d = to_origin + edge_u * u + edge_v * v;
    const float r2 = d.length2();
    const float r = std::sqrt(r2);
    return {d * (1.0f / r), r2 * r * inv_area_height};
  }

  float pdf_w(const Vec3& wi) const noexcept {
    const float slope = dot(normal, wi);
    const float t = height / (slope == 0.0f ? 1.0f : slope);
    const Vec3 p = wi * t - to_origin;
    const float u = dot(p, edge_u) * inv_length2_u;
    const float v = dot(p, edge_v) * inv_length2_v;
    const float pdf = by_area ? t * t * t * inv_area_height : pdf_constant;
    // A slope of 0 or away from the plane gives no density, whatever t is.
    const bool meets =
        (height * slope > 0.0f) & (u >= 0.0f) & (u <= 1.0f) & (v >= 0.0f) & (v <= 1.0f);
    return meets ? pdf : 0.0f;
  }
};

LightProposal::Rectangle LightProposal::rectangle() const noexcept {
  return {to_origin_,     light_->edge_u,
          light_->edge_v, light_->normal,
          height_,        inv_length2_u_,
          inv_length2_v_, inv_area_height_,
          pdf_constant_,  mode_ == Mode::RectangleArea};
}

void LightProposal::sample(const VariateBlock& variates, std::size_t count, std::size_t at,
                           VectorBlock& __restrict wi,
                           Block<float>& __restrict pdf) const noexcept {
  if (mode_ == Mode::RectangleArea) {
    const Rectangle shape = rectangle();
    for (std::size_t i = 0; i < whole_groups(count); ++i) {
      const LightSample s = shape.sample_area(variates.x[at + i], variates.y[at + i]);
      wi.x[at + i] = s.wi.x;
      wi.y[at + i] = s.wi.y;
      wi.z[at + i] = s.wi.z;
      pdf[at + i] = s.pdf_w;
    }
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const LightSample s = sample(variates[at + i]).value_or(LightSample{});
    wi.set(at + i, s.wi);
    pdf[at + i] = s.pdf_w;
  }
}

void LightProposal::pdf_w(const VectorBlock& wi, std::size_t count,
                          Block<float>& __restrict pdf) const noexcept {
  if (is_rectangle()) {
    const Rectangle shape = rectangle();
    for (std::size_t i = 0; i < whole_groups(count); ++i) pdf[i] = shape.pdf_w(wi[i]);
    if (mode_ != Mode::RectangleCosine) return;
    for (std::size_t i = 0; i < count; ++i) {
      if (pdf[i] > 0.0f) pdf[i] = warped(pdf[i], cosine_warp(wi[i]));
    }
    return;
  }
  for (std::size_t i = 0; i < count; ++i) pdf[i] = pdf_w(wi[i]);
}

std::optional<LightSample> LightProposal::sample(const Variates& variates) const noexcept {
  const Light& light = *light_;
  const Vec2& u = variates.u;
  switch (mode_) {
    case Mode::RectangleArea:
      return rectangle().sample_area(u.x, u.y);
    case Mode::RectangleAngle:
      return sample_rectangle_angle(static_cast<double>(u.x), static_cast<double>(u.y));
    case Mode::RectangleCosine:
      return sample_rectangle_cosine(u);
    case Mode::SphereCone:
      return LightSample{Frame(axis_).to_world(sample_uniform_cone(u, one_minus_cos_)),
                         pdf_constant_};
    case Mode::SphereInside:
      return LightSample{sample_uniform_sphere(u), pdf_constant_};
    case Mode::Environment: {
      const Environment::Sample s =
          compensated_ != nullptr ? compensated_->sample(u) : light.environment.sample(u);
      if (!(s.pdf_w > 0.0f)) return std::nullopt;
      return LightSample{s.w, s.pdf_w};
    }
    case Mode::Mesh:
      break;
  }
  const DiscreteDistribution::Choice choice = light.triangle_areas.sample(variates.choice);
  const Vec3* triangle = &light.vertices[std::size_t{choice.index} * 3];
  const Vec2 b = sample_uniform_triangle(u);
  const Vec3 point = triangle[0] * (1.0f - b.x - b.y) + triangle[1] * b.x + triangle[2] * b.y;
  const Vec3 d = point - from_;
  const float r2 = d.length2();
  if (!(r2 > 0.0f)) return std::nullopt;
  const Vec3 wi = d / std::sqrt(r2);
  const float pdf = mesh_pdf_w(wi);
  // A direction in the plane of its own triangle: a set of measure zero that rounding can reach.
  if (!(pdf > 0.0f) || !std::isfinite(pdf)) return std::nullopt;
  return LightSample{wi, pdf};
}

LightSample LightProposal::sample_rectangle_angle(double u, double v) const noexcept {
  const double au = u * solid_angle_ + k_;
  const double sin_au = std::sin(au);
  const double fu = (std::cos(au) * b0_ - b1_) / sin_au;
  const double cu = std::clamp(std::copysign(1.0, fu) / std::sqrt(fu * fu + b0_ * b0_), -1.0, 1.0);
  const double cos2 = std::max(1e-300, 1.0 - cu * cu);
  const double xu = std::clamp(-(cu * z0_) / std::sqrt(cos2), x0_, x1_);
  const double d2 = xu * xu + z0_ * z0_;
  const double h0 = y0_ / std::sqrt(d2 + y0_ * y0_);
  const double h1 = y1_ / std::sqrt(d2 + y1_ * y1_);
  const double hv = h0 + v * (h1 - h0);
  const double hv2 = hv * hv;
  // hv rounds to -1 or 1 at the edges of a rectangle that is vast against its distance.
  const double yv = hv2 < 1.0 - 1e-12
                        ? std::clamp(hv * std::sqrt(d2) / std::sqrt(1.0 - hv2), y0_, y1_)
                        : (hv < 0.0 ? y0_ : y1_);
  const Vec3d d = axis_x_ * xu + axis_y_ * yv + axis_z_ * z0_;
  return {Vec3(d / d.length()), pdf_constant_};
}

float LightProposal::pdf_w(const Vec3& wi) const noexcept {
  switch (mode_) {
    case Mode::RectangleArea:
    case Mode::RectangleAngle:
      return rectangle().pdf_w(wi);
    case Mode::RectangleCosine: {
      const float pdf = rectangle().pdf_w(wi);
      return pdf > 0.0f ? warped(pdf, cosine_warp(wi)) : 0.0f;
    }
    case Mode::SphereCone: {
      // Membership by the chord, which keeps its digits where the cosine of a small cone rounds
      // to 1.
      const bool inside = (wi - axis_).length2() <= 2.0f * one_minus_cos_;
      return inside ? pdf_constant_ : 0.0f;
    }
    case Mode::SphereInside:
      return pdf_constant_;
    case Mode::Environment:
      return compensated_ != nullptr ? compensated_->pdf_w(wi) : light_->environment.pdf_w(wi);
    case Mode::Mesh:
      break;
  }
  return mesh_pdf_w(wi);
}

}  // namespace penumbra
