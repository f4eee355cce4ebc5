// Candidates of a mixture: directions that are weighted before any ray is traced.

#include "estimators/mixture/mixture.h"
#include "scenes/core/curve_points.h"

namespace penumbra {
namespace {

inline Vec3 luminance_weights(const Rgb& radiance) noexcept {
  return {0.2126f * radiance.x, 0.7152f * radiance.y, 0.0722f * radiance.z};
}

}  // namespace

void Mixture::propose(SamplerKind sampler, const StreamKey& key,
                      std::span<const int> counts) noexcept {
  drawn_.independent = true;
  drawn_.along_curve = sampler != SamplerKind::Independent;
  drawn_.candidates = true;
  counters_.candidates += draw_all(sampler, key, counts);
  enter(EstimateStage::Weigh);
}

// Each run's lanes follow one another in its set.
void Mixture::place_runs_along_curves() noexcept {
  for (std::size_t r = 0; r < drawn_.runs; ++r) {
    const Run& run = drawn_.run[r];
    place_along_curve(drawn_.points.index[run.first], run.count, run.set_size, drawn_.position,
                      drawn_.variates, run.first);
  }
}

void Mixture::keep_unshadowed(std::size_t survivors) noexcept {
  float* const out = &unshadowed_[size_];
  for (std::size_t i = 0; i < survivors; ++i) out[i] = 0.0f;
  if (many_ != nullptr || lights_as_one_) {
    for (std::size_t i = 0; i < survivors; ++i) {
      const Vec3 wi = wi_[size_ + i];
      const Rgb f = f_[size_ + i];
      for_each_met(wi, [&](std::size_t light) {
        if (!(active_[light].pdf_w(wi) > 0.0f)) return;
        out[i] += dot(f, luminance_weights(active_[light].light().radiance_along(wi)));
      });
    }
    return;
  }
  for (int k = 0; k < light_components(); ++k) {
    const Light& light = proposal(k).light();
    const Block<float>& pdf = light_pdfs_[static_cast<std::size_t>(k)];
    if (light.type == LightType::Environment) {
      for (std::size_t i = 0; i < survivors; ++i) {
        const Rgb radiance = light.environment.radiance(wi_[size_ + i]);
        out[i] += pdf[drawn_.survivors[i]] > 0.0f ? dot(f_[size_ + i], luminance_weights(radiance))
                                                  : 0.0f;
      }
      continue;
    }
    const Vec3 weights = luminance_weights(light.radiance);
    for (std::size_t i = 0; i < survivors; ++i) {
      out[i] += pdf[drawn_.survivors[i]] > 0.0f ? dot(f_[size_ + i], weights) : 0.0f;
    }
  }
}

void Mixture::trace_chosen(std::span<const std::uint32_t> chosen, std::uint64_t count) noexcept {
  rays_.clear();
  counters_.samples += count;
  if (record_ != nullptr) record_not_chosen(chosen);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const std::size_t from = chosen[i];
    const Vec3 wi = wi_[from];
    wi_.set(i, wi);
    rays_.add(point_.position, wi);
    f_[i] = f_[from];
    component_[i] = component_[from];
    own_pdf_[i] = own_pdf_[from];
    unshadowed_[i] = unshadowed_[from];
    if (lights_as_one_) light_[i] = light_[from];
    if (record_ != nullptr) record_index_[i] = record_index_[from];
  }
  size_ = chosen.size();
  const bool selects = restricted_ || densities_ == Densities::Own;
  (this->*(selects ? trace_selected_ : trace_all_))(0);
  enter(EstimateStage::Weigh);
}

}  // namespace penumbra
