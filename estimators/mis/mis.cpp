// Multiple importance sampling of light and BSDF directions: the baseline of every comparison.
//
// Idea: draw a fixed number of directions from each light and from the BSDF and weight each sample
// by how likely the other techniques were to produce it. Source: Veach and Guibas 1995, "Optimally
// combining sampling techniques for Monte Carlo rendering".
//
// Equations, with n_k samples from density p_k (per steradian):
//   balance  F = sum_k sum_j f(X_kj) / sum_q n_q p_q(X_kj)
//   power-2  F = sum_k sum_j f(X_kj) n_k p_k(X_kj) / sum_q (n_q p_q(X_kj))^2
//
// Layouts, at SRL shadow rays per light:
//   pairs   each light has its own ceil(SRL/2) light and floor(SRL/2) BSDF directions; a BSDF
//   direction counts only for
//           the light of its pair. As in pbrt's direct lighting, with one ray where pbrt counts a
//           light and a BSDF ray.
//   shared  one mixture: ceil(SRL/2) directions per light and floor(SRL/2) x lights BSDF directions
//   that see all lights.
// Lights that can not contribute at a point (below the horizon, facing away) get no samples.
//
// Environments can be drawn by a compensated density, which leaves what is dim and even to the BSDF
// samples. Source: Karlik et al. 2019, "MIS compensation: Optimizing sampling techniques in
// multiple importance sampling".
//
// Parameters: layout = shared, heuristic = balance, light_sampling = area, environment = luminance.
// Unbiased: every direction that brings light is covered by its light's own samples, and counts are
// fixed in advance; what a compensated density leaves out is covered by the BSDF samples, which
// every SRL that is allowed has, and whose density is positive wherever the BSDF is. Weak case:
// samples are spent on techniques that do not suit the point; narrow visible parts of a large
// light.

#include <memory>

#include "estimators/mis/mis.h"
#include "estimators/mixture/estimates.h"

namespace penumbra::mis {
namespace {

enum class Layout : std::uint8_t { Pairs, Shared };
enum class Heuristic : std::uint8_t { Balance, Power2 };

class Mis final : public Estimator {
 public:
  Mis(const Scene& scene, const ParamSet& params, const Budget& budget)
      : budget_(budget),
        layout_(params.text("layout") == "pairs" ? Layout::Pairs : Layout::Shared),
        heuristic_(params.text("heuristic") == "power2" ? Heuristic::Power2 : Heuristic::Balance),
        mixture_(scene, light_sampling_of(params), false, most_samples(scene, budget)),
        counts_(scene.sampled_lights().size() + 2),
        coefficients_(scene.sampled_lights().size() + 2),
        density_(most_samples(scene, budget) + kLaneGroup) {
    if (params.text("environment") == "compensated") mixture_.compensate_environment();
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    estimate_tile(
        mixture_, tile, seed, out, [](std::size_t) {},
        [this](const StreamKey& key) { return one_point(key); });
    out.counters.iterations += mixture_.counters().estimates;
  }

 private:
  Rgb one_point(const StreamKey& key) noexcept {
    if (layout_ == Layout::Shared) {
      const int n = shared_mis_counts(budget_.srl(), mixture_.active_lights(),
                                      mixture_.light_components(), counts_);
      return narrow(one_mixture(key, n));
    }
    RgbSum sum(0.0);
    for (int light = 0; light < mixture_.active_lights(); ++light) {
      mixture_.restrict_to_light(light);
      mixture_.clear_samples();
      const int n = shared_mis_counts(budget_.srl(), 1, 1, counts_);
      sum += one_mixture(key, n);
    }
    return narrow(sum);
  }

  // Estimate from n samples with the counts of counts_.
  RgbSum one_mixture(const StreamKey& key, int n) noexcept {
    const auto m = static_cast<std::size_t>(mixture_.components());
    for (std::size_t k = 0; k < m; ++k) coefficients_[k] = static_cast<double>(counts_[k]) / n;
    mixture_.draw(budget_.sampler, key, std::span(counts_).first(m));
    const RgbSum sum = heuristic_ == Heuristic::Balance
                           ? balance_sum(mixture_, std::span(coefficients_).first(m), density_)
                           : power2_sum(std::span(coefficients_).first(m));
    mixture_.scale_recorded_weights(0, mixture_.size(), 1.0 / n);
    return sum / static_cast<double>(n);
  }

  // Sum of f c_k h_k / sum_q (c_q h_q)^2: N times the estimate, with c_k = n_k/N. Products of two
  // float densities can not overflow a double.
  RgbSum power2_sum(std::span<const double> coefficients) noexcept {
    RgbSum sum(0.0);
    for (std::size_t i = 0; i < mixture_.size(); ++i) {
      if (is_black(mixture_.f(i))) continue;
      double squares = 0.0;
      mixture_.for_each_pdf_w(i, [&](int k, float pdf) {
        const double density = coefficients[static_cast<std::size_t>(k)] * static_cast<double>(pdf);
        squares += density * density;
      });
      const auto own = static_cast<std::size_t>(mixture_.component(i));
      const double density = coefficients[own] * static_cast<double>(mixture_.own_pdf(i));
      if (!(squares > 0.0)) {
        ++mixture_.counters().uncovered;
        continue;
      }
      mixture_.record_weight(i, density / squares);
      sum += widen(mixture_.f(i)) * (density / squares);
    }
    return sum;
  }

  Budget budget_;
  Layout layout_;
  Heuristic heuristic_;
  Mixture mixture_;
  std::vector<int> counts_;
  std::vector<double> coefficients_;
  std::vector<double> density_;  // [sample], of the mixture
};

std::span<const ParamSpec> params() {
  static const std::vector<ParamSpec> specs = {
      {.name = "layout",
       .default_value = std::string("shared"),
       .doc = "shared: one mixture for all lights; pairs: light and BSDF samples for each light, "
              "as in pbrt",
       .choices = {"shared", "pairs"}},
      {.name = "heuristic",
       .default_value = std::string("balance"),
       .doc = "weights of the techniques: balance or power with exponent 2",
       .choices = {"balance", "power2"}},
      light_sampling_param(),
      {.name = "environment",
       .default_value = std::string("luminance"),
       .doc =
           "density of the samples of an environment: in proportion to its luminance, or to what "
           "of it is above its mean",
       .choices = {"luminance", "compensated"}},
  };
  return specs;
}

std::span<const Preset> presets() {
  using Text = std::string;
  static const std::vector<Preset> list = {
      {"paper",
       "what the paper of PMC-HI compares with: area sampling, pairs for each light",
       "independent",
       {{"layout", Text("pairs")}}},
      {"tuned",
       "solid angle, Owen-scrambled points, power heuristic",
       "sobol",
       {{"light_sampling", Text("solid_angle")}, {"heuristic", Text("power2")}}},
  };
  return list;
}

std::string bias_reason(const ParamSet&) { return {}; }

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
  return std::make_unique<Mis>(scene, params, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "mis",
    .summary = "multiple importance sampling of lights and BSDF",
    .citation =
        "Veach and Guibas 1995, Optimally combining sampling techniques for Monte Carlo rendering",
    .adaptive = false,
    .min_srl = 2,
    .params = params,
    .presets = presets,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::mis
