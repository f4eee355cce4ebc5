#include "estimators/mixture/exact_light.h"

namespace penumbra {

ExactLight::ExactLight(const Scene& scene)
    : scene_(&scene),
      rays_(std::max<std::size_t>(scene.delta_lights().size(), scene.traits().has_mirrors ? 1 : 0)),
      batch_(rays_.size()) {}

void ExactLight::trace(EstimateCounters& counters) noexcept {
  scene_->intersect(batch_);
  counters.rays += batch_.size();
  counters.untraced += batch_.untraced();
}

RgbSum ExactLight::of_delta_lights(const ShadingPoint& point, const Frame& frame,
                                   const BoundBsdf& bsdf, EstimateCounters& counters) noexcept {
  for (const std::uint32_t id : scene_->delta_lights()) {
    const auto sample = sample_delta(scene_->lights()[id], point.position, point.geometric_normal);
    if (!sample) continue;
    ++counters.samples;
    const Vec3 local = frame.to_local(sample->wi);
    const Rgb f_cos = local.z > 0.0f ? bsdf.evaluate(local).f_cos : Rgb(0.0f);
    if (is_black(f_cos)) continue;
    rays_[batch_.size()] = {sample->distance, f_cos * sample->irradiance};
    batch_.add(point.position, sample->wi);
  }
  trace(counters);
  RgbSum sum(0.0);
  for (std::size_t i = 0; i < batch_.size(); ++i) {
    const RayHit& hit = batch_.hits[i];
    if (hit.hit() && hit.distance < rays_[i].distance) continue;
    ++counters.lit;
    sum += widen(rays_[i].reflected);
  }
  return sum;
}

// Lights without extent are not seen in it: no ray meets them.
RgbSum ExactLight::in_mirror(const ShadingPoint& point, const Frame& frame, const BoundBsdf& bsdf,
                             EstimateCounters& counters) noexcept {
  const Vec3 wi = frame.to_world(bsdf.mirrored()).normalized();
  ++counters.samples;
  // Next to a silhouette the interpolated normal can mirror into the surface.
  if (!(dot(wi, point.geometric_normal) > 0.0f)) return RgbSum(0.0);
  batch_.add(point.position, wi);
  trace(counters);
  const std::int32_t light = scene_->emitter(batch_.hits[0], wi);
  if (light == kNoLight) return RgbSum(0.0);
  ++counters.lit;
  return widen(bsdf.bsdf().delta_reflectance()) *
         widen(scene_->lights()[static_cast<std::size_t>(light)].radiance_along(wi));
}

Rgb ExactLight::radiance(const ShadingPoint& point, const Frame& frame, const BoundBsdf& bsdf,
                         EstimateCounters& counters, EstimateRecord* record) noexcept {
  batch_.clear();
  const RgbSum sum = bsdf.bsdf().is_delta() ? in_mirror(point, frame, bsdf, counters)
                                            : of_delta_lights(point, frame, bsdf, counters);
  if (record != nullptr) record->delta = narrow(sum);
  return narrow(sum);
}

}  // namespace penumbra
