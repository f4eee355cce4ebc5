#include "estimators/mixture/mixture.h"

#include <algorithm>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

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
      unshadowed_(max_samples + kLaneGroup),
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

void Mixture::compensate_environment() {
  PN_CHECK(densities_ == Densities::All && !lights_as_one_, "another technique covers the rest");
  if (scene_->environment_light() == kNoLight) return;
  const auto id = static_cast<std::size_t>(scene_->environment_light());
  compensated_ = std::make_unique<CompensatedDensity>(scene_->lights()[id].environment);
}

// Whether directions without a density of any light may bring light of the environment.
bool Mixture::sees_compensated() const noexcept {
  return compensated_light_ >= first_light_ && compensated_light_ < last_light_;
}

void Mixture::list_active_lights(const ShadingPoint& point,
                                 std::span<const std::uint32_t> candidates) noexcept {
  const std::span<const Light> lights = scene_->lights();
  LightProposal proposal;
  for (const std::uint32_t id : candidates) {
    if (!proposal.set_up(lights[id], light_sampling_, point.position, point.geometric_normal,
                         scene_->keep_all())) {
      continue;
    }
    if (compensated_ != nullptr && lights[id].type == LightType::Environment) {
      proposal.compensate(*compensated_);
      compensated_light_ = static_cast<int>(active_.size());
    }
    active_.push_back(proposal);
    active_ids_.push_back(id);
  }
}

void Mixture::set_up(const ShadingPoint& point, const SurfaceValues* surface,
                     EstimateRecord* record, std::span<const std::uint32_t> lights) noexcept {
  active_.clear();
  active_ids_.clear();
  compensated_light_ = -1;
  if (!scene_->is_mirror(point.material)) list_active_lights(point, lights);
  if (many_ != nullptr) many_->built = false;
  point_ = point;
  record_ = nullptr;
  if (active_.empty() && !exact_.possible()) return;
  restrict_to_light(-1);
  frame_ = Frame(point.shading_normal);
  bsdf_ = BoundBsdf(scene_->bsdf_at(point.material, surface), frame_.to_local(point.wo));
  if (glossy_lobes_only_) bsdf_.leave_out_diffuse_samples();
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

void Mixture::draw(SamplerKind sampler, const StreamKey& key, std::span<const int> counts,
                   std::span<const int> first) noexcept {
  const std::size_t before = size_;
  drawn_.independent = sampler == SamplerKind::Independent;
  drawn_.along_curve = drawn_.candidates = false;
  rays_.clear();
  counters_.samples += draw_all(sampler, key, counts, first);
  const bool selects = restricted_ || densities_ == Densities::Own;
  (this->*(selects ? trace_selected_ : trace_all_))(before);
  enter(EstimateStage::Weigh);
}

// Draws and keeps directions of all components.
// @return their number
std::uint64_t Mixture::draw_all(SamplerKind sampler, const StreamKey& key,
                                std::span<const int> counts, std::span<const int> first) noexcept {
  enter(EstimateStage::Sample);
  drawn_.key = key;
  if (record_ != nullptr) record_draw(counts);
  std::uint64_t total = 0;
  for (int k = 0, last = components(); k < last; ++k) {
    const int count = counts[static_cast<std::size_t>(k)];
    if (count <= 0) continue;
    const int left_out = first.empty() ? 0 : first[static_cast<std::size_t>(k)];
    draw_points(sampler, k, static_cast<std::uint32_t>(left_out),
                static_cast<std::uint32_t>(count));
    total += static_cast<std::uint64_t>(count);
  }
  keep_block();
  return total;
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
  if (!sees_compensated()) return;
  for (std::size_t i = 0; i < lanes; ++i) sum[i] += 1.0f;
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

// Densities of the BSDF and the cone and f of all lanes, and in `survivors` the lanes of
// directions that can bring light: above the horizon, towards a light's surface, f not black. No
// other does, whatever else is in the scene.
// @return the number of survivors
std::size_t Mixture::evaluate_lanes() noexcept {
  const Vec3 normal = point_.geometric_normal;
  const std::size_t lanes = whole_groups(drawn_.count);
  const int bsdf = bsdf_component();
  const int cone = cone_component();
  const Cone at_hand = cone_;
  VectorBlock above;  // the rest stands upright, where every BSDF has a value
  Block<std::uint32_t> alive;
  for (std::size_t i = 0; i < lanes; ++i) {
    const Vec3 local = drawn_.wi_local[i];
    const bool is_above = local.z > 0.0f;
    const bool lives =
        is_above & (dot(drawn_.wi[i], normal) > 0.0f) & (drawn_.any_light_pdf[i] > 0.0f);
    alive[i] = lives ? 1u : 0u;
    above.x[i] = is_above ? local.x : 0.0f;
    above.y[i] = is_above ? local.y : 0.0f;
    above.z[i] = is_above ? local.z : 1.0f;
  }
  bsdf_.evaluate(above, drawn_.count, drawn_.f_cos, drawn_.bsdf_pdf);
  for (std::size_t i = 0; i < lanes; ++i) {
    alive[i] &= static_cast<std::uint32_t>(
        (drawn_.f_cos.x[i] != 0.0f) | (drawn_.f_cos.y[i] != 0.0f) | (drawn_.f_cos.z[i] != 0.0f));
    const float own = drawn_.component[i] == bsdf ? drawn_.bsdf_pdf[i] : drawn_.own_pdf[i];
    const float of_cone = at_hand.pdf_w(drawn_.wi[i]);
    drawn_.cone_pdf[i] = drawn_.component[i] == cone ? own : of_cone;
    drawn_.own_pdf[i] = own;
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
  if (drawn_.independent) {
    Block<float>* position = drawn_.along_curve ? &drawn_.position : nullptr;
    fill_independent(drawn_.key, drawn_.points, drawn_.count, drawn_.variates, position);
    if (drawn_.along_curve) place_runs_along_curves();
  }
  draw_directions();
  fill_light_pdfs();
  if (record_ != nullptr) record_block();
  const std::size_t survivors = evaluate_lanes();
  const std::uint32_t* lanes = drawn_.survivors.data();
  for (std::size_t i = 0; i < survivors; ++i) {
    const std::size_t lane = lanes[i];
    own_pdf_[size_ + i] = drawn_.own_pdf[lane];
    component_[size_ + i] = drawn_.component[lane];
    const Vec3 wi = drawn_.wi[lane];
    wi_.set(size_ + i, wi);
    if (!drawn_.candidates) rays_.add(point_.position, wi);
    f_[size_ + i] = Rgb(drawn_.f_cos[lane]);
  }
  if (lights_as_one_) pack(drawn_.light, survivors, &light_[size_]);
  if (record_ != nullptr) pack(record_lane_, survivors, &record_index_[size_]);
  if (densities_ == Densities::All) keep_pdfs(survivors);
  if (keeps_dropped_) keep_dropped_pdfs(survivors);
  if (drawn_.candidates) keep_unshadowed(survivors);
  size_ += survivors;
  drawn_.count = 0;
  drawn_.runs = 0;
  drawn_.lights_only = true;
}

// The densities of all components at the first `survivors` lanes of the list.
void Mixture::keep_pdfs(std::size_t survivors) noexcept {
  if (many_ != nullptr) return keep_pdfs_of_many(survivors);
  const auto lights = static_cast<std::size_t>(light_components());
  const Block<float>* of_light = light_pdfs_.data();
  for (std::size_t i = 0; i < survivors; ++i) {
    const std::size_t lane = drawn_.survivors[i];
    float* pdf = &pdfs_[size_ + i];
    for (std::size_t k = 0; k < lights; ++k, pdf += stride_) *pdf = of_light[k][lane];
    *pdf = drawn_.bsdf_pdf[lane];
    pdf[stride_] = drawn_.cone_pdf[lane];
  }
}

// Whether light counts for the sample that found it: with pairs and with own densities, light from
// another light than the component's does not.
bool Mixture::from_wanted_light(std::size_t sample, std::int32_t light) const noexcept {
  const bool from_light = component_[sample] < light_components();
  if (!restricted_ && !from_light) return true;
  const int wanted = first_light_ + (from_light ? component_[sample] : 0);
  return static_cast<std::uint32_t>(light) == active_ids_[static_cast<std::size_t>(wanted)];
}

// The active light that a light's sample was drawn for.
std::size_t Mixture::drawn_light(std::size_t sample) const noexcept {
  return static_cast<std::size_t>(lights_as_one_ ? light_[sample]
                                                 : first_light_ + component_[sample]);
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
  const int light_end = light_components();
  const std::size_t count = rays_.size();
  std::uint64_t lit = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t sample = first + i;
    const RayHit& hit = rays_.hits[i];
    std::int32_t light = kNoLight;
    if (hit.hit()) {
      light = scene_->surface_emitter(hit, wi_[sample]);
    } else if constexpr (kEnvironment) {
      light = scene_->environment_light();
    }
    if (component_[sample] < light_end) {
      // Rounding can make a ray miss the light that it was drawn for.
      const std::size_t drawn = drawn_light(sample);
      const auto id = static_cast<std::int32_t>(active_ids_[drawn]);
      if (light != id && active_[drawn].grazes(wi_[sample], hit.distance)) light = id;
    }
    bool counts = light != kNoLight;
    if constexpr (kSelects) counts = counts && from_wanted_light(sample, light);
    if (counts) {
      const Light& source = lights[static_cast<std::size_t>(light)];
      f_[sample] *= kEnvironment ? source.radiance_along(wi_[sample]) : source.radiance;
      lit += is_black(f_[sample]) ? 0u : 1u;
    } else {
      f_[sample] = Rgb(0.0f);
    }
    if (record_ != nullptr) record_traced(sample, counts);
  }
  counters_.lit += lit;
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
