#include "estimators/mixture/chosen_lights.h"

namespace penumbra {

std::size_t limited_samples(const Scene& scene, const Budget& budget, std::int64_t limit) {
  if (limit == 0) return most_samples(scene, budget);
  const std::size_t all = static_cast<std::size_t>(budget.srl()) * scene.sampled_lights().size();
  return std::min(all, static_cast<std::size_t>(limit));
}

ParamSpec samples_param(std::int64_t default_value) {
  return {.name = "samples",
          .default_value = default_value,
          .doc = "most samples of one estimate, for scenes of many lights; 0: SRL x lights",
          .min = 0,
          .max = static_cast<double>(kMaxSamples)};
}

// With 2^-52 as its unit, and not the 2^-32 of a single draw, expected counts far below 1 are met
// as well.
double ChosenLights::offset(StreamKey key) noexcept {
  key.component = kRoundingComponent;
  const std::uint64_t high = random_bits(key);
  const std::uint64_t low = random_bits(key, 1) >> 12;
  return static_cast<double>((high << 20) | low) * 0x1p-52;
}

void ChosenLights::set_up(const ShadingPoint& point, const SurfaceValues* surface,
                          EstimateRecord* record) noexcept {
  lights_.clear();
  for (const ChosenLight& c : chosen_) lights_.push_back(c.light);
  mixture_.set_up(point, surface, record, lights_);
  // Lights that turn out unable to contribute lose their samples.
  std::size_t next = 0;
  for (const ChosenLight& c : chosen_) {
    if (static_cast<int>(next) == mixture_.active_lights()) break;
    if (mixture_.light_index(static_cast<int>(next)) != c.light) continue;
    counts_[next] = c.count;
    expected_[next] = c.expected;
    ++next;
  }
  counts_[next] = counts_[next + 1] = 0;
}

Rgb ChosenLights::draw_and_sum(const StreamKey& key) noexcept {
  const auto m = static_cast<std::size_t>(mixture_.components());
  mixture_.draw(sampler_, key, std::span(counts_).first(m));
  if (EstimateRecord* record = mixture_.record()) {
    std::vector<double>& alpha = record->iterations.back().alpha;
    alpha.assign(expected_.begin(), expected_.begin() + mixture_.active_lights());
    for (double& a : alpha) a /= samples_;
  }
  return narrow(own_density_sum(mixture_, std::span(expected_).first(m)));
}

}  // namespace penumbra
