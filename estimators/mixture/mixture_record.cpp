// What a mixture writes into an EstimateRecord. Apart from the sampling loop, which only tests for
// a record.

#include "estimators/mixture/mixture.h"

namespace penumbra {

// Components of a record: all active lights (or one for all of them), BSDF, cone; also while the
// mixture is restricted to one light.
std::size_t Mixture::recorded_component(int component) const noexcept {
  const std::size_t lights = lights_as_one_ ? 1 : active_.size();
  if (component == bsdf_component()) return lights;
  if (component == cone_component()) return lights + 1;
  return lights_as_one_ ? 0 : static_cast<std::size_t>(first_light_ + component);
}

void Mixture::begin_record(EstimateRecord* record) noexcept {
  record_ = record;
  if (lights_as_one_) {
    record->components.emplace_back("lights");
  } else {
    for (const LightProposal& light : active_) record->components.push_back(light.light().name);
  }
  record->components.emplace_back("bsdf");
  record->components.emplace_back("cone");
}

void Mixture::record_draw(std::span<const int> counts) noexcept {
  IterationRecord& iteration = record_->iterations.emplace_back();
  iteration.counts.resize(record_->components.size());
  for (int k = 0; k < components(); ++k) {
    iteration.counts[recorded_component(k)] = counts[static_cast<std::size_t>(k)];
  }
  if (cone_.active()) {
    iteration.cone_axis = cone_.axis;
    iteration.cone_angle = cone_.half_angle();
  }
}

// The lanes at hand as they were drawn. What passes the early tests is a sample of black f until it
// is traced.
void Mixture::record_block() noexcept {
  for (std::size_t lane = 0; lane < drawn_.count; ++lane) {
    record_lane_[lane] = record_->samples.size();
    SampleRecord& sample = record_->samples.emplace_back();
    const int component = drawn_.component[lane];
    sample.iteration = static_cast<int>(record_->iterations.size()) - 1;
    sample.component = static_cast<int>(recorded_component(component));
    sample.wi = drawn_.wi[lane];
    const Vec3 local = drawn_.wi_local[lane];
    if (sample.wi.length2() == 0.0f) continue;
    const bool above = local.z > 0.0f && dot(sample.wi, point_.geometric_normal) > 0.0f;
    const float bsdf_pdf = local.z > 0.0f ? bsdf_.evaluate(local).pdf_w : 0.0f;
    sample.own_pdf = component == bsdf_component() ? bsdf_pdf : drawn_.own_pdf[lane];
    sample.fate = !above                              ? SampleFate::BelowHorizon
                  : drawn_.any_light_pdf[lane] > 0.0f ? SampleFate::BlackBsdf
                                                      : SampleFate::MissesLights;
    if (densities_ == Densities::Own) continue;
    sample.pdfs.assign(record_->components.size(), 0.0f);
    if (many_ != nullptr) {
      for (const LightDensity& d : many_->lane(lane)) {
        sample.pdfs[recorded_component(static_cast<int>(d.component))] = d.pdf_w;
      }
    }
    for (int k = 0; many_ == nullptr && k < light_components(); ++k) {
      sample.pdfs[recorded_component(k)] = light_pdfs_[static_cast<std::size_t>(k)][lane];
    }
    sample.pdfs[recorded_component(bsdf_component())] = bsdf_pdf;
    sample.pdfs[recorded_component(cone_component())] =
        component == cone_component() ? drawn_.own_pdf[lane] : cone_.pdf_w(sample.wi);
  }
}

void Mixture::record_traced(std::size_t i, bool lit) noexcept {
  SampleRecord& sample = record_->samples[record_index_[i]];
  sample.f = f_[i];
  sample.fate = lit ? SampleFate::Lit : SampleFate::Dark;
  IterationRecord& iteration = record_->iterations.back();
  ++iteration.rays;
  iteration.hits += lit && !is_black(f_[i]) ? 1 : 0;
}

void Mixture::record_not_chosen(std::span<const std::uint32_t> chosen) noexcept {
  std::size_t next = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    if (next < chosen.size() && chosen[next] == i) {
      ++next;
    } else {
      record_->samples[record_index_[i]].fate = SampleFate::NotChosen;
    }
  }
}

void Mixture::scale_recorded_weights(std::size_t first, std::size_t last, double factor) noexcept {
  if (record_ == nullptr) return;
  for (std::size_t i = first; i < last; ++i) record_->samples[record_index_[i]].weight *= factor;
}

}  // namespace penumbra
