#include "estimators/mixture/mixture.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"
#include "scenes/core/frame.h"
#include "scenes/core/warp.h"

namespace penumbra {
namespace {

constexpr float kOneMinusEpsilon = 1.0f - 0x1p-24f;

// Lanes [at, at + count) of `world` in the frame, and back.
void to_local(const Frame& frame, const VectorBlock& world, std::size_t at, std::size_t count,
              VectorBlock& __restrict local) noexcept {
  const Frame f = frame;
  for (std::size_t i = at; i < at + whole_groups(count); ++i) {
    const Vec3 w = f.to_local(world[i]);
    local.x[i] = w.x;
    local.y[i] = w.y;
    local.z[i] = w.z;
  }
}

void to_world(const Frame& frame, const VectorBlock& local, std::size_t at, std::size_t count,
              VectorBlock& __restrict world) noexcept {
  const Frame f = frame;
  for (std::size_t i = at; i < at + whole_groups(count); ++i) {
    const Vec3 w = f.to_world(local[i]);
    world.x[i] = w.x;
    world.y[i] = w.y;
    world.z[i] = w.z;
  }
}

// A direction's own density is the one it was drawn with, which need not round like the one
// evaluated.
void take_own_pdf(const Block<int>& component, int own, const Block<float>& own_pdf,
                  std::size_t count, Block<float>& __restrict pdf) noexcept {
  for (std::size_t i = 0; i < whole_groups(count); ++i) {
    pdf[i] = component[i] == own ? own_pdf[i] : pdf[i];
  }
}

}  // namespace

Mixture::Mixture(const Scene& scene, LightSampling light_sampling, bool lights_as_one,
                 std::size_t max_samples, Densities densities)
    : scene_(&scene),
      light_sampling_(light_sampling),
      lights_as_one_(lights_as_one),
      densities_(densities),
      max_components_(scene.sampled_lights().size() + 2),
      bsdf_(scene.bsdf(0), Vec3(0.0f, 0.0f, 1.0f)),
      light_pdfs_(scene.sampled_lights().size() < kManyLights ? scene.sampled_lights().size() + 1
                                                              : 0),
      wi_(max_samples),
      f_(max_samples),
      component_(max_samples),
      light_(max_samples),
      own_pdf_(max_samples),
      stride_(max_samples + kLaneGroup),
      pdfs_(densities == Densities::All && scene.sampled_lights().size() < kManyLights
                ? stride_ * max_components_
                : 0),
      many_(scene.sampled_lights().size() < kManyLights
                ? nullptr
                : std::make_unique<ManyLights>(scene.sampled_lights().size(), max_samples,
                                               densities == Densities::All)),
      rays_(max_samples),
      exact_(scene),
      record_index_(max_samples) {
  PN_CHECK(!lights_as_one || densities == Densities::All, "one component has one density");
  active_.reserve(scene.sampled_lights().size());
  active_ids_.reserve(scene.sampled_lights().size());
  if (scene.environment_light() != kNoLight) {
    trace_all_ = &Mixture::trace<true, false>;
    trace_selected_ = &Mixture::trace<true, true>;
  }
}

void Mixture::list_active_lights(const ShadingPoint& point) noexcept {
  const std::span<const Light> lights = scene_->lights();
  LightProposal proposal;
  for (const std::uint32_t id : scene_->sampled_lights()) {
    if (!proposal.set_up(lights[id], light_sampling_, point.position, point.geometric_normal,
                         scene_->keep_all())) {
      continue;
    }
    active_.push_back(proposal);
    active_ids_.push_back(id);
  }
}

void Mixture::set_up(const ShadingPoint& point, const SurfaceValues* surface,
                     EstimateRecord* record) noexcept {
  active_.clear();
  active_ids_.clear();
  if (!scene_->is_mirror(point.material)) list_active_lights(point);
  if (many_ != nullptr) many_->built = false;
  point_ = point;
  record_ = nullptr;
  if (active_.empty() && !exact_.possible()) return;
  restrict_to_light(-1);
  frame_ = Frame(point.shading_normal);
  bsdf_ = BoundBsdf(scene_->bsdf_at(point.material, surface), frame_.to_local(point.wo));
  cone_ = Cone{};
  clear_samples();
  if (record != nullptr) begin_record(record);
}

Rgb Mixture::exact_radiance() noexcept {
  if (!exact_.possible()) return Rgb(0.0f);
  return exact_.radiance(point_, frame_, bsdf_, counters_, record_);
}

void Mixture::restrict_to_light(int i) noexcept {
  restricted_ = i >= 0;
  first_light_ = restricted_ ? i : 0;
  last_light_ = restricted_ ? i + 1 : active_lights();
}

void Mixture::draw(SamplerKind sampler, StreamKey key, std::span<const int> counts) noexcept {
  enter(EstimateStage::Sample);
  const std::size_t first = size_;
  rays_.clear();
  if (record_ != nullptr) record_draw(counts);
  for (int k = 0; k < components(); ++k) {
    const int count = counts[static_cast<std::size_t>(k)];
    if (count > 0) draw_points(sampler, stream(key, k), k, count);
  }
  keep_block();
  const bool selects = restricted_ || densities_ == Densities::Own;
  (this->*(selects ? trace_selected_ : trace_all_))(first);
  enter(EstimateStage::Weigh);
}

// Streams: a light's scene index; then all lights as one or the BSDF for all lights; the cone; the
// BSDF of each light's pair. Lights that are left out at a point do not shift the numbers of the
// others.
StreamKey Mixture::stream(StreamKey key, int component) const noexcept {
  const auto lights = static_cast<std::uint32_t>(scene_->lights().size());
  const std::uint32_t* active_id = active_ids_.data() + first_light_;
  if (component == cone_component()) {
    key.component = lights + 1;
  } else if (component == bsdf_component()) {
    key.component = restricted_ ? lights + 3 + *active_id : lights;
  } else {
    key.component = lights_as_one_ ? lights + 2 : active_id[component];
  }
  return key;
}

void Mixture::draw_points(SamplerKind sampler, const StreamKey& key, int component,
                          int count) noexcept {
  counters_.samples += static_cast<std::uint64_t>(count);
  const auto total = static_cast<std::uint32_t>(count);
  const PointSet points(sampler, key, total);
  const bool is_light = component < light_components();
  const bool with_choice =
      is_light ? lights_as_one_ || proposal(component).uses_choice() : bsdf_.uses_choice();
  for (std::uint32_t done = 0; done < total;) {
    if (drawn_.count == kBlock) keep_block();
    const auto at = static_cast<std::uint32_t>(drawn_.count);
    const std::uint32_t n = std::min(total - done, static_cast<std::uint32_t>(kBlock) - at);
    points.fill(done, n, with_choice, drawn_.variates, at);
    std::fill_n(drawn_.component.begin() + at, n, component);
    drawn_.lights_only = drawn_.lights_only && is_light;
    drawn_.run[drawn_.runs++] = {component, at, n};
    drawn_.count += n;
    done += n;
  }
}

// Turns the points at hand into directions in world and local coordinates, and their own densities
// except the BSDF's. Run by run, in ascending order: loops over whole groups leave what has no
// meaning in the lanes of the next.
void Mixture::draw_directions() noexcept {
  std::size_t lights = 0;  // lanes of lights, which are the first
  std::size_t r = 0;
  for (; r < drawn_.runs && drawn_.run[r].component < light_components(); ++r) {
    const Run& run = drawn_.run[r];
    if (lights_as_one_) {
      draw_any_light(run);
    } else {
      proposal(run.component)
          .sample(drawn_.variates, run.count, run.first, drawn_.wi, drawn_.own_pdf);
    }
    lights += run.count;
  }
  to_local(frame_, drawn_.wi, 0, lights, drawn_.wi_local);
  for (; r < drawn_.runs; ++r) {
    const Run& run = drawn_.run[r];
    if (run.component == cone_component()) {
      draw_cone(run);
    } else {
      bsdf_.sample(drawn_.variates, run.count, run.first, drawn_.wi_local);
      to_world(frame_, drawn_.wi_local, run.first, run.count, drawn_.wi);
    }
  }
}

void Mixture::draw_any_light(const Run& run) noexcept {
  const auto n = static_cast<double>(active_.size());
  for (std::size_t i = run.first; i < run.first + run.count; ++i) {
    Variates v = drawn_.variates[i];
    const float scaled = v.choice * static_cast<float>(n);
    const auto light = std::min(static_cast<std::size_t>(scaled), active_.size() - 1);
    v.choice = std::min(scaled - static_cast<float>(light), kOneMinusEpsilon);
    const LightSample s = active_[light].sample(v).value_or(LightSample{});
    auto pdf = static_cast<double>(s.pdf_w);
    for_each_met(s.wi, [&](std::size_t other) {
      if (other != light) pdf += static_cast<double>(active_[other].pdf_w(s.wi));
    });
    drawn_.wi.set(i, s.wi);
    drawn_.own_pdf[i] = static_cast<float>(pdf / n);
    drawn_.light[i] = static_cast<int>(light);
  }
}

void Mixture::draw_cone(const Run& run) noexcept {
  const Frame about_axis(cone_.axis);
  const float pdf = uniform_cone_pdf_w(cone_.one_minus_cos);
  for (std::size_t i = run.first; i < run.first + run.count; ++i) {
    const Vec3 local = sample_uniform_cone(drawn_.variates[i].u, cone_.one_minus_cos);
    drawn_.wi.set(i, about_axis.to_world(local).normalized());
    drawn_.own_pdf[i] = pdf;
  }
  to_local(frame_, drawn_.wi, run.first, run.count, drawn_.wi_local);
}

// Densities of the light components as far as they are wanted, and in any_light_pdf a number that
// is positive where one of them is.
void Mixture::fill_light_pdfs() noexcept {
  const std::size_t count = drawn_.count;
  const std::size_t lanes = whole_groups(count);
  const int lights = last_light_ - first_light_;
  Block<float>& sum = drawn_.any_light_pdf;
  if (densities_ == Densities::Own && drawn_.lights_only) {
    std::copy_n(drawn_.own_pdf.begin(), count, sum.begin());
    return;
  }
  if (many_ != nullptr) return fill_pdfs_of_many();
  if (lights_as_one_) return fill_pdf_of_all_as_one();
  for (int k = 0; k < lights; ++k) {
    Block<float>& pdf = light_pdfs_[static_cast<std::size_t>(k)];
    proposal(k).pdf_w(drawn_.wi, count, pdf);
    take_own_pdf(drawn_.component, k, drawn_.own_pdf, count, pdf);
    for (std::size_t i = 0; i < lanes; ++i) sum[i] = (k == 0 ? 0.0f : sum[i]) + pdf[i];
  }
}

void Mixture::fill_pdf_of_all_as_one() noexcept {
  const std::size_t lanes = whole_groups(drawn_.count);
  Block<float>& pdf = light_pdfs_[0];
  Block<double> sum{};
  for (const LightProposal& light : active_) {
    light.pdf_w(drawn_.wi, drawn_.count, pdf);
    for (std::size_t i = 0; i < lanes; ++i) sum[i] += static_cast<double>(pdf[i]);
  }
  const auto n = static_cast<double>(active_.size());
  for (std::size_t i = 0; i < lanes; ++i) pdf[i] = static_cast<float>(sum[i] / n);
  take_own_pdf(drawn_.component, 0, drawn_.own_pdf, drawn_.count, pdf);
  drawn_.any_light_pdf = pdf;
}

// Lanes above the horizon that meet a light's surface: no other direction brings light, whatever
// else is in the scene.
std::size_t Mixture::list_survivors() noexcept {
  const Vec3 normal = point_.geometric_normal;
  Block<std::uint32_t> alive;
  for (std::size_t i = 0; i < whole_groups(drawn_.count); ++i) {
    alive[i] = static_cast<std::uint32_t>((drawn_.wi_local.z[i] > 0.0f) &
                                          (dot(drawn_.wi[i], normal) > 0.0f) &
                                          (drawn_.any_light_pdf[i] > 0.0f));
  }
  std::size_t survivors = 0;
  for (std::size_t i = 0; i < drawn_.count; ++i) {
    drawn_.survivors[survivors] = static_cast<std::uint32_t>(i);
    survivors += alive[i];
  }
  return survivors;
}

// Turns the directions at hand into samples and rays.
void Mixture::keep_block() noexcept {
  draw_directions();
  fill_light_pdfs();
  const std::size_t survivors = list_survivors();
  if (record_ != nullptr) record_block();
  for (std::size_t i = 0; i < survivors; ++i) {
    drawn_.survivor_local.set(i, drawn_.wi_local[drawn_.survivors[i]]);
  }
  bsdf_.evaluate(drawn_.survivor_local, survivors, drawn_.f_cos, drawn_.bsdf_pdf);
  const auto lights = static_cast<std::size_t>(light_components());
  for (std::size_t i = 0; i < survivors; ++i) {
    const Rgb f_cos(drawn_.f_cos[i]);
    if (is_black(f_cos)) continue;
    const std::size_t lane = drawn_.survivors[i];
    const Vec3 wi = drawn_.wi[lane];
    const int component = drawn_.component[lane];
    const float own = component == bsdf_component() ? drawn_.bsdf_pdf[i] : drawn_.own_pdf[lane];
    if (densities_ == Densities::All && many_ != nullptr) {
      keep_pdfs_of_many(lane, drawn_.bsdf_pdf[i],
                        component == cone_component() ? own : cone_.pdf_w(wi));
    } else if (densities_ == Densities::All) {
      float* pdf = &pdfs_[size_];
      for (std::size_t k = 0; k < lights; ++k) pdf[k * stride_] = light_pdfs_[k][lane];
      pdf[lights * stride_] = drawn_.bsdf_pdf[i];
      pdf[(lights + 1) * stride_] = component == cone_component() ? own : cone_.pdf_w(wi);
    }
    own_pdf_[size_] = own;
    component_[size_] = component;
    light_[size_] = lights_as_one_ ? drawn_.light[lane] : first_light_ + component;
    wi_.set(size_, wi);
    f_[size_] = f_cos;
    if (record_ != nullptr) record_index_[size_] = record_lane_[lane];
    rays_.add(point_.position, wi);
    ++size_;
  }
  drawn_.count = 0;
  drawn_.runs = 0;
  drawn_.lights_only = true;
}

// Whether light counts for the sample that found it: with pairs and with own densities, light from
// another light than the component's does not.
bool Mixture::from_wanted_light(std::size_t sample, std::int32_t light) const noexcept {
  const bool from_light = component_[sample] < light_components();
  if (!restricted_ && !from_light) return true;
  const int wanted = first_light_ + (from_light ? component_[sample] : 0);
  return static_cast<std::uint32_t>(light) == active_ids_[static_cast<std::size_t>(wanted)];
}

// The light that a sample's ray brings: the one that the ray meets, `seen`, or the one that the
// sample was drawn for, which rounding can make the ray miss.
std::int32_t Mixture::light_met(std::size_t sample, const RayHit& hit,
                                std::int32_t seen) const noexcept {
  if (component_[sample] >= light_components()) return seen;
  const auto drawn = static_cast<std::size_t>(light_[sample]);
  const auto id = static_cast<std::int32_t>(active_ids_[drawn]);
  if (seen == id || !active_[drawn].grazes(wi_[sample], hit.distance)) return seen;
  return id;
}

// Traces the samples from `first` on and turns f into the integrand.
// kEnvironment  the scene has one: rays that meet nothing see it
// kSelects      not all light counts for all samples
template <bool kEnvironment, bool kSelects>
void Mixture::trace(std::size_t first) noexcept {
  enter(EstimateStage::Trace);
  scene_->intersect(rays_);
  enter(EstimateStage::Sample);
  counters_.rays += rays_.size();
  counters_.untraced += rays_.untraced();
  const std::span<const Light> lights = scene_->lights();
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const std::size_t sample = first + i;
    const RayHit& hit = rays_.hits[i];
    std::int32_t light = kNoLight;
    if (hit.hit()) {
      light = scene_->surface_emitter(hit, wi_[sample]);
    } else if constexpr (kEnvironment) {
      light = scene_->environment_light();
    }
    light = light_met(sample, hit, light);
    bool counts = light != kNoLight;
    if constexpr (kSelects) counts = counts && from_wanted_light(sample, light);
    if (counts) {
      const Light& source = lights[static_cast<std::size_t>(light)];
      f_[sample] *= kEnvironment ? source.radiance_along(wi_[sample]) : source.radiance;
      counters_.lit += is_black(f_[sample]) ? 0u : 1u;
    } else {
      f_[sample] = Rgb(0.0f);
    }
    if (record_ != nullptr) record_traced(sample, counts);
  }
}

void Mixture::mixture_pdfs_w(std::size_t first, std::span<const double> coefficients,
                             std::span<double> density) const noexcept {
  if (many_ != nullptr) return mixture_pdfs_of_many(first, coefficients, density);
  const std::size_t lanes = whole_groups(size_ - first);
  double* __restrict sum = density.data();
  for (std::size_t i = 0; i < lanes; ++i) sum[i] = 0.0;
  for (std::size_t k = 0; k < coefficients.size(); ++k) {
    const double c = coefficients[k];
    if (c == 0.0) continue;
    const float* pdf = &pdfs_[k * stride_ + first];
    for (std::size_t i = 0; i < lanes; ++i) sum[i] += c * static_cast<double>(pdf[i]);
  }
}

}  // namespace penumbra
