#include "estimators/mixture/mixture.h"

#include <algorithm>

#include "scenes/core/frame.h"
#include "scenes/core/warp.h"

namespace penumbra {
namespace {

constexpr int kNoComponent = -1;
constexpr float kOneMinusEpsilon = 1.0f - 0x1p-24f;

}  // namespace

float Cone::pdf_w(const Vec3& wi) const noexcept {
  if (!active()) return 0.0f;
  // By the chord |wi - axis| <= 2 sin(beta/2): exact where the cosine of a narrow cone rounds to 1.
  return (wi - axis).length2() <= 2.0f * one_minus_cos ? uniform_cone_pdf_w(one_minus_cos) : 0.0f;
}

Mixture::Mixture(const Scene& scene, LightSampling light_sampling, bool lights_as_one,
                 std::size_t max_samples)
    : scene_(&scene),
      light_sampling_(light_sampling),
      lights_as_one_(lights_as_one),
      max_components_(scene.lights().size() + 2),
      bsdf_(scene.bsdf(0), Vec3(0.0f, 0.0f, 1.0f)),
      wi_(max_samples),
      f_(max_samples),
      component_(max_samples),
      pdfs_(max_samples * max_components_),
      rays_(max_samples) {
  active_.reserve(scene.lights().size());
  active_ids_.reserve(scene.lights().size());
}

bool Mixture::set_up(const ShadingPoint& point) noexcept {
  active_.clear();
  active_ids_.clear();
  const std::span<const Light> lights = scene_->lights();
  LightProposal proposal;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (!proposal.set_up(lights[i], light_sampling_, point.position, point.geometric_normal)) continue;
    active_.push_back(proposal);
    active_ids_.push_back(static_cast<std::uint32_t>(i));
  }
  if (active_.empty()) return false;
  restrict_to_light(-1);
  point_ = point;
  frame_ = Frame(point.shading_normal);
  bsdf_ = BoundBsdf(scene_->bsdf(point.material), frame_.to_local(point.wo));
  cone_ = Cone{};
  clear_samples();
  return true;
}

void Mixture::restrict_to_light(int i) noexcept {
  restricted_ = i >= 0;
  first_light_ = restricted_ ? i : 0;
  last_light_ = restricted_ ? i + 1 : active_lights();
}

void Mixture::draw(SamplerKind sampler, StreamKey key, std::span<const int> counts) noexcept {
  const std::size_t first = size_;
  rays_.clear();
  const int lights = light_components();
  for (int k = 0; k < lights; ++k) {
    const int count = counts[static_cast<std::size_t>(k)];
    if (count == 0) continue;
    if (lights_as_one_) {
      draw_all_lights(sampler, key, count);
    } else {
      draw_light(sampler, key, k, count);
    }
  }
  if (const int count = counts[static_cast<std::size_t>(lights)]; count > 0) {
    draw_bsdf(sampler, key, count);
  }
  if (const int count = counts[static_cast<std::size_t>(lights) + 1]; count > 0) {
    draw_cone(sampler, key, count);
  }
  trace(first);
}

// Streams: a light's scene index; then all lights as one or the BSDF for all lights; the cone; the BSDF of each
// light's pair. Lights that are left out at a point do not shift the numbers of the others.
void Mixture::draw_light(SamplerKind sampler, StreamKey key, int component, int count) noexcept {
  key.component = active_ids_[static_cast<std::size_t>(first_light_ + component)];
  const PointSet points(sampler, key, static_cast<std::uint32_t>(count));
  const LightProposal& light = proposal(component);
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(count); ++j) {
    if (const std::optional<LightSample> s = light.sample(points(j))) {
      keep(s->wi, frame_.to_local(s->wi), component, s->pdf_w);
    }
  }
  counters_.samples += static_cast<std::uint64_t>(count);
}

void Mixture::draw_all_lights(SamplerKind sampler, StreamKey key, int count) noexcept {
  key.component = static_cast<std::uint32_t>(scene_->lights().size()) + 2;
  const PointSet points(sampler, key, static_cast<std::uint32_t>(count));
  const auto n = static_cast<float>(active_.size());
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(count); ++j) {
    Variates v = points(j);
    const float scaled = v.choice * n;
    const auto light = std::min(static_cast<std::size_t>(scaled), active_.size() - 1);
    v.choice = std::min(scaled - static_cast<float>(light), kOneMinusEpsilon);
    if (const std::optional<LightSample> s = active_[light].sample(v)) {
      float pdf = s->pdf_w;
      for (std::size_t other = 0; other < active_.size(); ++other) {
        if (other != light) pdf += active_[other].pdf_w(s->wi);
      }
      keep(s->wi, frame_.to_local(s->wi), 0, pdf / n);
    }
  }
  counters_.samples += static_cast<std::uint64_t>(count);
}

void Mixture::draw_bsdf(SamplerKind sampler, StreamKey key, int count) noexcept {
  const auto lights = static_cast<std::uint32_t>(scene_->lights().size());
  key.component =
      restricted_ ? lights + 3 + active_ids_[static_cast<std::size_t>(first_light_)] : lights;
  const PointSet points(sampler, key, static_cast<std::uint32_t>(count));
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(count); ++j) {
    if (const std::optional<Vec3> local = bsdf_.sample(points(j))) {
      keep(frame_.to_world(*local), *local, bsdf_component(), 0.0f);
    }
  }
  counters_.samples += static_cast<std::uint64_t>(count);
}

void Mixture::draw_cone(SamplerKind sampler, StreamKey key, int count) noexcept {
  key.component = static_cast<std::uint32_t>(scene_->lights().size()) + 1;
  const PointSet points(sampler, key, static_cast<std::uint32_t>(count));
  const Frame about_axis(cone_.axis);
  const float pdf = uniform_cone_pdf_w(cone_.one_minus_cos);
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(count); ++j) {
    const Vec3 wi =
        about_axis.to_world(sample_uniform_cone(points(j).u, cone_.one_minus_cos)).normalized();
    keep(wi, frame_.to_local(wi), cone_component(), pdf);
  }
  counters_.samples += static_cast<std::uint64_t>(count);
}

bool Mixture::fill_light_pdfs(const Vec3& wi, int own, float own_pdf, float* pdfs) const noexcept {
  if (lights_as_one_) {
    float sum = 0.0f;
    if (own == 0) {
      pdfs[0] = own_pdf;
      return true;
    }
    for (const LightProposal& light : active_) sum += light.pdf_w(wi);
    pdfs[0] = sum / static_cast<float>(active_.size());
    return sum > 0.0f;
  }
  bool meets_light = false;
  const int lights = light_components();
  for (int k = 0; k < lights; ++k) {
    pdfs[k] = k == own ? own_pdf : proposal(k).pdf_w(wi);
    meets_light = meets_light || pdfs[k] > 0.0f;
  }
  return meets_light;
}

void Mixture::keep(const Vec3& wi, const Vec3& wi_local, int component, float own_pdf) noexcept {
  if (!(wi_local.z > 0.0f) || !(dot(wi, point_.geometric_normal) > 0.0f)) return;
  float* pdfs = &pdfs_[size_ * max_components_];
  const int own_light = component < light_components() ? component : kNoComponent;
  // A direction that meets no light's surface brings no light, whatever else is in the scene.
  if (!fill_light_pdfs(wi, own_light, own_pdf, pdfs)) return;
  const BsdfValue bsdf = bsdf_.evaluate(wi_local);
  if (is_black(bsdf.f_cos)) return;
  pdfs[bsdf_component()] = bsdf.pdf_w;
  pdfs[cone_component()] = component == cone_component() ? own_pdf : cone_.pdf_w(wi);
  wi_[size_] = wi;
  f_[size_] = bsdf.f_cos;
  component_[size_] = component;
  rays_.add(point_.position, wi);
  ++size_;
}

void Mixture::trace(std::size_t first) noexcept {
  scene_->intersect(rays_);
  counters_.rays += rays_.size();
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const std::int32_t light = scene_->emitter(rays_.hits[i], wi_[first + i]);
    const bool counts =
        light != kNoLight &&
        (!restricted_ || static_cast<std::uint32_t>(light) ==
                             active_ids_[static_cast<std::size_t>(first_light_)]);
    f_[first + i] = counts ? f_[first + i] * scene_->lights()[static_cast<std::size_t>(light)].radiance
                           : Rgb(0.0f);
  }
}

RgbSum balance_sum(Mixture& mixture, std::size_t first,
                   std::span<const double> coefficients) noexcept {
  RgbSum sum(0.0);
  for (std::size_t i = first; i < mixture.size(); ++i) {
    if (is_black(mixture.f(i))) continue;
    const double k = mixture_pdf_w(mixture.pdfs(i), coefficients);
    if (!(k > 0.0)) {
      ++mixture.counters().uncovered;
      continue;
    }
    sum += widen(mixture.f(i)) * (1.0 / k);
  }
  return sum;
}

int shared_mis_counts(int srl, int active_lights, int light_components,
                      std::span<int> counts) noexcept {
  const int per_light = (srl + 1) / 2;
  const int lights_total = per_light * active_lights;
  for (int k = 0; k < light_components; ++k) {
    counts[static_cast<std::size_t>(k)] = lights_total / light_components;
  }
  const int bsdf = (srl / 2) * active_lights;
  counts[static_cast<std::size_t>(light_components)] = bsdf;
  counts[static_cast<std::size_t>(light_components) + 1] = 0;
  return lights_total + bsdf;
}

ParamSpec light_sampling_param() {
  return {.name = "light_sampling",
          .default_value = std::string("area"),
          .doc = "density of the light samples: uniform over the area or over the solid angle",
          .choices = {"area", "solid_angle"}};
}

LightSampling light_sampling_of(const ParamSet& params) {
  return params.text("light_sampling") == "solid_angle" ? LightSampling::SolidAngle
                                                        : LightSampling::Area;
}

}  // namespace penumbra
