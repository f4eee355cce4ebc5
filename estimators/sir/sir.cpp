// Stratified importance resampling: many cheap candidates, few shadow rays.
//
// Idea: draw candidates from a mixture of light and BSDF proposals, weight each by what it would
// bring if nothing hid the lights, choose a few of them in proportion to the weights, and trace
// only those. The candidates' error, which needs no rays, and the error of visibility are then
// apart. Candidates lie along a space-filling curve in the unit square of their component, and the
// choice is systematic along that order, so rays are spread evenly over what contributes.
// Sources: Burke, Ghosh and Heidrich 2005, "Bidirectional importance sampling for direct
// illumination"; Talbot, Cline and Egbert 2005, "Importance resampling for global illumination";
// order of the candidates: Ciklabakkal et al. 2022, "Single-pass stratified importance resampling".
//
// Equations, with n_k of N candidates from density h_k (per steradian) and R rays:
//   K(w)  = sum_k (n_k / N) h_k(w)
//   t(w)  = luminance of BSDF x cosine x radiance of the lights along w, as if nothing hid them
//   u_j   = g_k t(w_j) / K(w_j)    for a candidate of component k, with U = sum_j u_j
//   g_k   = 1 - alike + alike (sum of t/K) / (components x sum of t/K of component k)
//   F     = (U / N R) sum_{chosen j} c_j f(w_j) / (g_k t(w_j)),    E[c_j] = R u_j / U
// with c_j copies of candidate j, which are traced once. The factors g give every component a part
// of the rays: the light that would bring most may be hidden.
//
// Parameters: candidates (per ray), bsdf (share of the candidates that glossy lobes draw), alike,
// light_sampling. The BSDF component draws from glossy lobes only, and not at all where there is
// none: the lights' components cover every direction that brings light.
// Unbiased: given the candidates, E[F] is their own mixture estimate (1/N) sum f/K because t is
// positive wherever f can be; that estimate is the balance heuristic with fixed counts.
// Weak case: visibility alone decides, as in deep penumbrae: candidates then cost and bring
// nothing.

#include "estimators/sir/sir.h"

#include <algorithm>
#include <memory>
#include <string>

#include "estimators/mixture/estimates.h"
#include "scenes/core/error.h"

namespace penumbra::sir {
namespace {

std::size_t most_candidates(const Scene& scene, const ParamSet& params, const Budget& budget) {
  const auto per_ray = static_cast<std::size_t>(params.integer("candidates"));
  const std::size_t candidates = per_ray * most_samples(scene, budget);
  if (candidates <= kMaxSamples) return candidates;
  throw InputError("candidates: " + std::to_string(per_ray) + " for each ray are " +
                   std::to_string(candidates) + " of one estimate; allowed: up to " +
                   std::to_string(kMaxSamples));
}

class Sir final : public Estimator {
 public:
  Sir(const Scene& scene, const ParamSet& params, const Budget& budget)
      : budget_(budget),
        per_ray_(static_cast<int>(params.integer("candidates"))),
        bsdf_share_(params.real("bsdf")),
        alike_(params.real("alike")),
        mixture_(scene, light_sampling_of(params), false, most_candidates(scene, params, budget)),
        counts_(scene.sampled_lights().size() + 2),
        coefficients_(counts_.size()),
        sums_(counts_.size()),
        factors_(counts_.size()),
        weights_(most_candidates(scene, params, budget) + kLaneGroup),
        copies_(weights_.size()),
        chosen_(most_samples(scene, budget)) {
    mixture_.leave_out_diffuse_samples();
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    estimate_tile(
        mixture_, tile, seed, out, [](std::size_t) {},
        [this](const StreamKey& key) { return one_point(key); });
    out.counters.iterations += mixture_.counters().estimates;
  }

 private:
  Rgb one_point(StreamKey key) noexcept {
    const auto m = static_cast<std::size_t>(mixture_.components());
    const int rays = budget_.srl() * mixture_.active_lights();
    const int candidates = count_candidates(rays * per_ray_);
    for (std::size_t k = 0; k < m; ++k) {
      coefficients_[k] = static_cast<double>(counts_[k]) / candidates;
    }
    mixture_.propose(budget_.sampler, key, std::span(counts_).first(m));
    const std::span<double> weights = std::span(weights_).first(mixture_.size());
    weigh(std::span(coefficients_).first(m), weights);
    const double sum = even_out(weights);
    if (!(sum > 0.0)) return Rgb(0.0f);

    key.component = kRoundingComponent;
    const double offset = static_cast<double>(random_bits(key)) * 0x1p-32;
    for (double& weight : weights) weight /= sum;
    const std::span<int> copies = std::span(copies_).first(weights.size());
    systematic_counts(weights, rays, offset, copies);
    std::size_t count = 0;
    for (std::size_t i = 0; i < copies.size(); ++i) {
      if (copies[i] > 0) chosen_[count++] = static_cast<std::uint32_t>(i);
    }
    const std::span<const std::uint32_t> chosen = std::span(chosen_).first(count);
    mixture_.trace_chosen(chosen, static_cast<std::uint64_t>(rays));
    const double scale = sum / candidates / rays;
    RgbSum total(0.0);
    for (std::size_t i = 0; i < count; ++i) {
      const double factor = factors_[static_cast<std::size_t>(mixture_.component(i))];
      const double weight =
          scale * copies[chosen[i]] / (factor * static_cast<double>(mixture_.unshadowed(i)));
      mixture_.record_weight(i, weight);
      if (!is_black(mixture_.f(i))) total += widen(mixture_.f(i)) * weight;
    }
    return narrow(total);
  }

  // Shares `total` candidates out. @return their number, which can be smaller
  int count_candidates(int total) noexcept {
    const int lights = mixture_.light_components();
    const LightAndLobeCounts n =
        light_and_lobe_counts(total, lights, mixture_.has_glossy_lobe() ? bsdf_share_ : 0.0);
    std::fill_n(counts_.begin(), lights, n.per_light);
    counts_[static_cast<std::size_t>(mixture_.bsdf_component())] = n.lobe;
    counts_[static_cast<std::size_t>(mixture_.cone_component())] = 0;
    return n.per_light * lights + n.lobe;
  }

  // Fills in u = t/K of all candidates.
  void weigh(std::span<const double> coefficients, std::span<double> weights) noexcept {
    mixture_.mixture_pdfs_w(0, coefficients, weights_);
    const std::span<const float> targets = mixture_.unshadowed();
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const auto target = static_cast<double>(targets[i]);
      if (target > 0.0 && !(weights[i] > 0.0)) ++mixture_.counters().uncovered;
      weights[i] = weights[i] > 0.0 ? target / weights[i] : 0.0;
    }
  }

  // Multiplies the weights of each component by a factor, so that a part of all choices is shared
  // alike. @return the sum of the new weights
  double even_out(std::span<double> weights) noexcept {
    std::fill(sums_.begin(), sums_.end(), 0.0);
    double sum = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      sums_[static_cast<std::size_t>(mixture_.component(i))] += weights[i];
      sum += weights[i];
    }
    const auto filled = std::count_if(sums_.begin(), sums_.end(), [](double s) { return s > 0.0; });
    for (std::size_t k = 0; k < sums_.size(); ++k) {
      factors_[k] = 1.0 - alike_;
      if (sums_[k] > 0.0) factors_[k] += alike_ * sum / (static_cast<double>(filled) * sums_[k]);
    }
    sum = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      weights[i] *= factors_[static_cast<std::size_t>(mixture_.component(i))];
      sum += weights[i];
    }
    return sum;
  }

  Budget budget_;
  int per_ray_;
  double bsdf_share_;
  double alike_;
  Mixture mixture_;
  std::vector<int> counts_;           // [component]
  std::vector<double> coefficients_;  // [component]
  std::vector<double> sums_;          // [component] of its candidates' weights
  std::vector<double> factors_;       // [component] on them
  std::vector<double> weights_;       // [candidate]: density K, then u, then its share
  std::vector<int> copies_;           // [candidate]
  std::vector<std::uint32_t> chosen_;
};

std::span<const ParamSpec> params() {
  static const std::vector<ParamSpec> specs = {
      {.name = "candidates",
       .default_value = std::int64_t{4},
       .doc = "candidates for each shadow ray",
       .min = 1,
       .max = 1024},
      {.name = "bsdf",
       .default_value = 0.25,
       .doc = "share of the candidates that glossy lobes draw, where there are any",
       .min = 0.0,
       .max = 0.9},
      {.name = "alike",
       .default_value = 0.5,
       .doc = "part of the rays that components share alike, whatever their candidates would bring",
       .min = 0.0,
       .max = 1.0},
      light_sampling_param(),
  };
  return specs;
}

std::string bias_reason(const ParamSet&) { return {}; }

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
  return std::make_unique<Sir>(scene, params, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "sir",
    .summary = "stratified importance resampling: shadow rays for a choice of many candidates",
    .citation =
        "Burke, Ghosh and Heidrich 2005, Bidirectional importance sampling for direct illumination",
    .params = params,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::sir
