#include "estimators/mixture/exact_light.h"

#include "estimators/mixture/mixture.h"

namespace penumbra {

ExactLight::ExactLight(const Scene& scene)
    : scene_(&scene), rays_(scene.delta_lights().size()), batch_(rays_.size()) {}

void ExactLight::add_delta_lights(const ShadingPoint& point, const Frame& frame,
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
}

Rgb ExactLight::radiance(const ShadingPoint& point, const Frame& frame, const BoundBsdf& bsdf,
                         EstimateCounters& counters, EstimateRecord* record) noexcept {
  batch_.clear();
  add_delta_lights(point, frame, bsdf, counters);
  scene_->intersect(batch_);
  counters.rays += batch_.size();
  RgbSum sum(0.0);
  for (std::size_t i = 0; i < batch_.size(); ++i) {
    const RayHit& hit = batch_.hits[i];
    if (hit.hit() && hit.distance < rays_[i].distance) continue;
    ++counters.lit;
    sum += widen(rays_[i].reflected);
  }
  if (record != nullptr) record->delta = narrow(sum);
  return narrow(sum);
}

}  // namespace penumbra
