// Light sampling alone: a baseline that explains the others.
//
// Idea: distribute the shadow rays over the lights with probabilities P_l, draw points on the
// lights chosen, and count what arrives from the light that the point was drawn on:
//   F = sum_i f_l(w_i) / (n P_l h_l(w_i)),    n = SRL x lights that can contribute.
// Lights are chosen by systematic sampling of P with one offset; equal probabilities thus give
// every light exactly SRL samples. Source: Shirley, Wang and Zimmerman 1996, "Monte Carlo
// techniques for direct lighting calculations".
//
// P: uniform over the lights that can contribute at the point, or in proportion to emitted power
// (radiance x area x pi, both sides; of the environment, the power through the scene's bounding
// sphere). Power here is luminance.
// With `samples` the n samples of an estimate do not grow with the number of lights: P is then over
// all lights, not only those that can contribute at the point, so that only the lights chosen are
// set up.
// Parameters: choice = uniform, light_sampling = area, samples = 0.
// Unbiased: every light that can contribute and emits has P_l > 0, and its density covers it. Weak
// case: glossy reflections of large lights; power knows nothing of distance.

#include "estimators/light/light.h"

#include <algorithm>
#include <memory>

#include "estimators/mixture/chosen_lights.h"
#include "estimators/mixture/estimates.h"

namespace penumbra::light {
namespace {

class LightOnly final : public Estimator {
 public:
  LightOnly(const Scene& scene, const ParamSet& params, const Budget& budget)
      : budget_(budget),
        by_power_(params.text("choice") == "power"),
        mixture_(scene, light_sampling_of(params), false, most_samples(scene, budget),
                 Densities::Own),
        power_(scene.lights().size()),
        pmf_(scene.sampled_lights().size() + 2),
        counts_(pmf_.size()),
        expected_(pmf_.size()) {
    for (std::size_t i = 0; i < power_.size(); ++i) {
      power_[i] = emitted_power(scene, scene.lights()[i]);
    }
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    estimate_tile(
        mixture_, tile, seed, out, [](std::size_t) {},
        [this](const StreamKey& key) { return one_point(key); });
    out.counters.iterations += mixture_.counters().estimates;
  }

 private:
  Rgb one_point(const StreamKey& key) noexcept {
    const auto lights = static_cast<std::size_t>(mixture_.active_lights());
    const std::span<double> pmf = std::span(pmf_).first(lights);
    double total = 0.0;
    for (std::size_t l = 0; l < lights; ++l) {
      pmf[l] = by_power_ ? power_[mixture_.light_index(static_cast<int>(l))] : 1.0;
      total += pmf[l];
    }
    if (!(total > 0.0)) return Rgb(0.0f);  // black lights
    for (double& p : pmf) p /= total;
    return narrow(chosen_lights_estimate(mixture_, budget_, key, pmf, counts_, expected_));
  }

  Budget budget_;
  bool by_power_;
  Mixture mixture_;
  std::vector<double> power_;  // [scene light], luminance [W]
  std::vector<double> pmf_;    // [active light]
  std::vector<int> counts_;
  std::vector<double> expected_;
};

// A given number of samples among all lights of the scene.
class FewSamples final : public Estimator {
 public:
  FewSamples(const Scene& scene, const ParamSet& params, const Budget& budget)
      : lights_(scene, light_sampling_of(params), budget.sampler,
                limited_samples(scene, budget, params.integer("samples"))) {
    const bool by_power = params.text("choice") == "power";
    double sum = 0.0;
    for (const std::uint32_t id : scene.sampled_lights()) {
      const double weight = by_power ? emitted_power(scene, scene.lights()[id]) : 1.0;
      if (!(weight > 0.0)) continue;  // black
      sum += weight;
      ids_.push_back(id);
      upto_.push_back(sum);
    }
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    lights_.estimate(tile, seed, out,
                     [this](const ShadingPoint&, const SurfaceValues*, double offset,
                            std::vector<ChosenLight>& chosen) { choose(offset, chosen); });
  }

 private:
  // Systematic sampling: lights whose interval of the cumulative weights holds one of the n places.
  void choose(double offset, std::vector<ChosenLight>& chosen) const noexcept {
    if (ids_.empty()) return;
    const int n = lights_.samples();
    const double step = upto_.back() / n;
    auto at = upto_.begin();
    for (int i = 0; i < n; ++i) {
      at = std::upper_bound(at, upto_.end() - 1, (i + offset) * step);
      const auto l = static_cast<std::size_t>(at - upto_.begin());
      if (!chosen.empty() && chosen.back().light == ids_[l]) {
        ++chosen.back().count;
        continue;
      }
      const double weight = upto_[l] - (l > 0 ? upto_[l - 1] : 0.0);
      chosen.push_back({ids_[l], 1, weight / step});
    }
  }

  ChosenLights lights_;
  std::vector<std::uint32_t> ids_;  // of lights that can be chosen
  std::vector<double> upto_;        // cumulative weights
};

std::span<const ParamSpec> params() {
  static const std::vector<ParamSpec> specs = {
      {.name = "choice",
       .default_value = std::string("uniform"),
       .doc = "probabilities of the lights: equal, or in proportion to emitted power",
       .choices = {"uniform", "power"}},
      light_sampling_param(),
      samples_param(0),
  };
  return specs;
}

std::string bias_reason(const ParamSet&) { return {}; }

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
  if (params.integer("samples") > 0) return std::make_unique<FewSamples>(scene, params, budget);
  return std::make_unique<LightOnly>(scene, params, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "light",
    .summary = "directions towards the lights alone",
    .citation =
        "Shirley, Wang and Zimmerman 1996, Monte Carlo techniques for direct lighting calculations",
    .params = params,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::light
