#include "estimators/mixture/estimates.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "scenes/core/error.h"

namespace penumbra {

std::size_t most_samples(const Scene& scene, const Budget& budget) {
  const std::size_t lights = scene.sampled_lights().size();
  const std::size_t samples = static_cast<std::size_t>(budget.srl()) * lights;
  if (samples <= kMaxSamples) return samples;
  throw InputError(std::to_string(budget.srl()) + " shadow rays per light and " +
                   std::to_string(lights) + " lights are " + std::to_string(samples) +
                   " samples of one estimate; allowed: up to " + std::to_string(kMaxSamples));
}

RgbSum balance_sum(Mixture& mixture, std::span<const double> coefficients,
                   std::span<double> density) noexcept {
  mixture.mixture_pdfs_w(0, coefficients, density);
  RgbSum sum(0.0);
  for (std::size_t i = 0; i < mixture.size(); ++i) {
    if (is_black(mixture.f(i))) continue;
    const double k = density[i];
    if (!(k > 0.0)) {
      ++mixture.counters().uncovered;
      continue;
    }
    mixture.record_weight(i, 1.0 / k);
    sum += widen(mixture.f(i)) * (1.0 / k);
  }
  return sum;
}

RgbSum own_density_sum(Mixture& mixture, std::span<const double> expected) noexcept {
  RgbSum sum(0.0);
  for (std::size_t i = 0; i < mixture.size(); ++i) {
    if (is_black(mixture.f(i))) continue;
    const auto component = static_cast<std::size_t>(mixture.component(i));
    const double density = expected[component] * static_cast<double>(mixture.own_pdf(i));
    if (!(density > 0.0)) {
      ++mixture.counters().uncovered;
      continue;
    }
    mixture.record_weight(i, 1.0 / density);
    sum += widen(mixture.f(i)) * (1.0 / density);
  }
  return sum;
}

void systematic_counts(std::span<const double> pmf, int total, double offset,
                       std::span<int> counts) noexcept {
  // The sum may round to just below the total: what is left over then goes to the last entry that
  // can be chosen at all.
  std::size_t last = pmf.size() - 1;
  while (last > 0 && !(pmf[last] > 0.0)) --last;
  double cumulative = 0.0;
  int before = 0;
  for (std::size_t k = 0; k < pmf.size(); ++k) {
    cumulative += total * pmf[k];
    const int upto =
        k >= last ? total : std::min(total, static_cast<int>(std::floor(cumulative + offset)));
    counts[k] = upto - before;
    before = upto;
  }
}

RgbSum chosen_lights_estimate(Mixture& mixture, const Budget& budget, StreamKey key,
                              std::span<const double> pmf, std::span<int> counts,
                              std::span<double> expected) noexcept {
  const std::size_t lights = pmf.size();
  const auto m = static_cast<std::size_t>(mixture.components());
  const int n = budget.srl() * mixture.active_lights();
  std::fill(counts.begin(), counts.end(), 0);
  StreamKey choice = key;
  choice.component = kRoundingComponent;
  const double offset = static_cast<double>(random_bits(choice)) * 0x1p-32;
  systematic_counts(pmf, n, offset, counts.first(lights));
  for (std::size_t l = 0; l < lights; ++l) expected[l] = n * pmf[l];
  mixture.draw(budget.sampler, key, counts.first(m));
  if (EstimateRecord* record = mixture.record()) {
    record->iterations.back().alpha.assign(pmf.begin(), pmf.end());
  }
  return own_density_sum(mixture, expected.first(m));
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

LightAndLobeCounts light_and_lobe_counts(int total, int lights, double lobe_share) noexcept {
  const auto wanted = static_cast<int>(lobe_share * total);
  const int per_light = std::max(1, (total - wanted) / lights);
  return {per_light, std::min(wanted, total - per_light * lights)};
}

double emitted_power(const Scene& scene, const Light& light) noexcept {
  if (light.type == LightType::Environment) {
    const double radius = 0.5 * scene.traits().diagonal;
    return M_PI * radius * radius * luminance(light.environment.power());
  }
  return M_PI * light.area * luminance(widen(light.radiance)) * (light.two_sided ? 2.0 : 1.0);
}

ParamSpec light_sampling_param(LightSampling by_default) {
  return {.name = "light_sampling",
          .default_value = std::string(to_string(by_default)),
          .doc =
              "density of the light samples: uniform over the area or over the solid angle; "
              "cosine: of rectangles, over the solid angle, warped by the receiver's cosines",
          .choices = {"area", "solid_angle", "cosine"}};
}

LightSampling light_sampling_of(const ParamSet& params) {
  const std::string& name = params.text("light_sampling");
  if (name == "cosine") return LightSampling::Cosine;
  return name == "solid_angle" ? LightSampling::SolidAngle : LightSampling::Area;
}

}  // namespace penumbra
