#include "estimators/restir_di/light_points.h"

#include <cmath>
#include <limits>

#include "estimators/mixture/estimates.h"
#include "scenes/core/warp.h"

namespace penumbra::restir_di {
namespace {

DiscreteDistribution choice_of(const Scene& scene) {
  if (scene.sampled_lights().empty()) return {};
  std::vector<double> weights;
  double total = 0.0;
  for (const std::uint32_t id : scene.sampled_lights()) {
    weights.push_back(emitted_power(scene, scene.lights()[id]));
    total += weights.back();
  }
  const auto n = static_cast<double>(weights.size());
  for (double& w : weights) w = total > 0.0 ? 0.5 * w / total + 0.5 / n : 1.0 / n;
  return DiscreteDistribution(weights);
}

void place_on_mesh(const Light& light, const Variates& place, LightPoint& at) noexcept {
  const DiscreteDistribution::Choice choice = light.triangle_areas.sample(place.choice);
  const Vec3* corner = &light.vertices[std::size_t{choice.index} * 3];
  const Vec2 b = sample_uniform_triangle(place.u);
  const Vec3d u = Vec3d(corner[1]) - Vec3d(corner[0]);
  const Vec3d v = Vec3d(corner[2]) - Vec3d(corner[0]);
  at.position = Vec3d(corner[0]) + u * static_cast<double>(b.x) + v * static_cast<double>(b.y);
  at.normal = Vec3(u.cross(v).normalized());
}

// How far a point is inside a sphere: radius^2 - distance^2, negative outside.
double depth2(const Light& sphere, const Vec3& from) noexcept {
  const double radius = static_cast<double>(sphere.radius);
  return radius * radius - (Vec3d(sphere.center) - Vec3d(from)).length2();
}

// Whether a point of a sphere's surface can be seen past the sphere itself.
bool on_near_side(const Light& sphere, const Vec3& from, double cosine) noexcept {
  return depth2(sphere, from) >= 0.0 ? cosine > 0.0 : cosine < 0.0;
}

// Distance of a point to the plane that touches the light at `at`, positive behind it. In double:
// it cancels where the light is seen nearly edge-on.
double height_over(const Light& light, const LightPoint& at, const Vec3d& from,
                   const Vec3d& to_light_point) noexcept {
  if (light.type == LightType::Rectangle) {
    return light.plane_normal.dot(Vec3d(light.origin) - from);
  }
  if (light.type == LightType::Sphere) {
    return (at.position - Vec3d(light.center)).normalized().dot(to_light_point);
  }
  return Vec3d(at.normal).dot(to_light_point);
}

// @return density per area
double place_on_sphere(const Light& sphere, const Vec3& from, const Vec2& u,
                       LightPoint& at) noexcept {
  const Vec3 w = sample_uniform_sphere(u);
  const Vec3d center(sphere.center);
  const double inside2 = depth2(sphere, from);
  if (!(inside2 > 0.0)) {
    at.normal = w;
    at.position = center + Vec3d(w) * static_cast<double>(sphere.radius);
    return 1.0 / sphere.area;
  }
  // The root of t^2 + 2 b t - inside2 = 0 ahead, without cancellation where the surface is near.
  const double b = (Vec3d(from) - center).dot(Vec3d(w));
  const double root = std::sqrt(b * b + inside2);
  const double t = b > 0.0 ? inside2 / (b + root) : root - b;
  at.position = Vec3d(from) + Vec3d(w) * t;
  const Vec3d normal = (at.position - center).normalized();
  at.normal = Vec3(normal);
  return static_cast<double>(uniform_sphere_pdf_w()) * normal.dot(Vec3d(w)) / (t * t);
}

}  // namespace

LightPoints::LightPoints(const Scene& scene) : scene_(&scene), choice_(choice_of(scene)) {}

LightPoint LightPoints::sample(const Vec3& from, float light,
                               const Variates& place) const noexcept {
  const DiscreteDistribution::Choice choice = choice_.sample(light);
  LightPoint at;
  at.light = scene_->sampled_lights()[choice.index];
  const Light& source = scene_->lights()[at.light];
  switch (source.type) {
    case LightType::Environment: {
      const Environment::Sample s = source.environment.sample(place.u);
      at.position = Vec3d(s.w);
      at.pdf = choice.pmf * static_cast<double>(s.pdf_w);
      return at;
    }
    case LightType::Rectangle:
      at.position = Vec3d(source.origin) + Vec3d(source.edge_u) * static_cast<double>(place.u.x) +
                    Vec3d(source.edge_v) * static_cast<double>(place.u.y);
      at.normal = source.normal;
      break;
    case LightType::Sphere:
      at.pdf = choice.pmf * place_on_sphere(source, from, place.u, at);
      return at;
    case LightType::Mesh:
      place_on_mesh(source, place, at);
      break;
    case LightType::Point:
    case LightType::Spot:
    case LightType::Directional:
      return at;  // no sampled light
  }
  at.pdf = choice.pmf / source.area;
  return at;
}

Receiver::Receiver(const Scene& scene) : bsdf_(scene.bsdf(0), Vec3(0.0f, 0.0f, 1.0f)) {}

void Receiver::set_up(const Scene& scene, const ShadingPoint& point,
                      const SurfaceValues* surface) noexcept {
  point_ = point;
  frame_ = Frame(point.shading_normal);
  bsdf_ = BoundBsdf(scene.bsdf_at(point.material, surface), frame_.to_local(point.wo));
}

Connection Receiver::connect(const Light& light, const LightPoint& at) const noexcept {
  Connection c;
  if (light.type == LightType::Environment) {
    c.wi = Vec3(at.position);
    c.distance = std::numeric_limits<float>::infinity();
    c.geometry = 1.0;
  } else {
    const Vec3d d = at.position - Vec3d(point_.position);
    const double distance2 = d.length2();
    if (!(distance2 > 0.0)) return c;
    const double distance = std::sqrt(distance2);
    const double height = height_over(light, at, Vec3d(point_.position), d);
    const double cosine = height / distance;
    if (cosine == 0.0 || (cosine > 0.0 && !light.two_sided)) return c;
    if (light.type == LightType::Sphere && !on_near_side(light, point_.position, cosine)) return c;
    c.wi = Vec3(d / distance);
    c.distance = static_cast<float>(distance);
    c.geometry = std::abs(cosine) / distance2;
  }
  const Vec3 local = frame_.to_local(c.wi);
  if (!(local.z > 0.0f) || !(dot(c.wi, point_.geometric_normal) > 0.0f)) return c;
  c.f = bsdf_.evaluate(local).f_cos * light.radiance_along(c.wi);
  c.target = luminance(widen(c.f)) * c.geometry;
  return c;
}

bool Receiver::sees(const Scene& scene, const LightPoint& at, const Connection& connection,
                    const RayHit& hit) const noexcept {
  const Light& light = scene.lights()[at.light];
  if (static_cast<std::uint32_t>(scene.emitter(hit, connection.wi)) == at.light) {
    return light.type != LightType::Mesh ||
           std::abs(hit.distance - connection.distance) <= kSameSurface * connection.distance;
  }
  if (light.type == LightType::Environment || hit.distance < 0.5f * connection.distance) {
    return false;
  }
  LightProposal proposal;
  return proposal.set_up(light, LightSampling::Area, point_.position, point_.geometric_normal) &&
         proposal.grazes(connection.wi, hit.distance);
}

}  // namespace penumbra::restir_di
