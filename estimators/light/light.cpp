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
// Parameters: choice = uniform, light_sampling = area.
// Unbiased: every light that can contribute and emits has P_l > 0, and its density covers it. Weak
// case: glossy reflections of large lights; power knows nothing of distance.

#include "estimators/light/light.h"

#include <memory>

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

std::span<const ParamSpec> params() {
  static const std::vector<ParamSpec> specs = {
      {.name = "choice",
       .default_value = std::string("uniform"),
       .doc = "probabilities of the lights: equal, or in proportion to emitted power",
       .choices = {"uniform", "power"}},
      light_sampling_param(),
  };
  return specs;
}

std::string bias_reason(const ParamSet&) { return {}; }

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
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
