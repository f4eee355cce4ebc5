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
//   u_j   = t(w_j) / K(w_j)
//   F     = (sum_j u_j / N) (1/R) sum_{chosen j} c_j f(w_j) / t(w_j),    E[c_j] = R u_j / sum u
// with c_j copies of candidate j, which are traced once.
//
// Parameters: candidates (per ray), bsdf (share of the candidates that glossy lobes draw),
// light_sampling. The BSDF component draws from glossy lobes only, and not at all where there is
// none: the lights' components cover every direction that brings light.
// Unbiased: given the candidates, E[F] is their own mixture estimate (1/N) sum f/K because t is
// positive wherever f can be; that estimate is the balance heuristic with fixed counts.
// Weak case: visibility alone decides, as in deep penumbrae: candidates then cost and bring
// nothing.

#include "estimators/sir/sir.h"

#include <cmath>
#include <memory>
#include <string>

#include "estimators/mixture/estimates.h"
#include "estimators/sir/resampling.h"
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
        mixture_(scene, light_sampling_of(params), false, most_candidates(scene, params, budget)),
        counts_(scene.sampled_lights().size() + 2),
        coefficients_(counts_.size()),
        weights_(most_candidates(scene, params, budget) + kLaneGroup),
        choices_(most_samples(scene, budget)),
        chosen_(choices_.size()) {
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
    const double sum = weigh(std::span(coefficients_).first(m), weights);
    if (!(sum > 0.0)) return Rgb(0.0f);

    key.component = kRoundingComponent;
    const double offset = static_cast<double>(random_bits(key)) * 0x1p-32;
    const std::size_t count =
        systematic_choice(weights, sum, static_cast<std::uint32_t>(rays), offset, choices_);
    for (std::size_t i = 0; i < count; ++i) chosen_[i] = choices_[i].candidate;
    mixture_.trace_chosen(std::span(chosen_).first(count), static_cast<std::uint64_t>(rays));
    const double scale = sum / candidates / rays;
    RgbSum total(0.0);
    for (std::size_t i = 0; i < count; ++i) {
      const double weight =
          scale * choices_[i].copies / static_cast<double>(mixture_.unshadowed(i));
      mixture_.record_weight(i, weight);
      if (!is_black(mixture_.f(i))) total += widen(mixture_.f(i)) * weight;
    }
    return narrow(total);
  }

  // Shares `total` candidates out: lights alike, glossy lobes their share.
  // @return their number, which can be smaller: components get whole numbers
  int count_candidates(int total) noexcept {
    const int lights = mixture_.light_components();
    int of_bsdf = mixture_.has_glossy_lobe() ? static_cast<int>(bsdf_share_ * total) : 0;
    const int per_light = std::max(1, (total - of_bsdf) / lights);
    of_bsdf = std::min(of_bsdf, total - per_light * lights);
    for (int k = 0; k < lights; ++k) counts_[static_cast<std::size_t>(k)] = per_light;
    counts_[static_cast<std::size_t>(mixture_.bsdf_component())] = of_bsdf;
    counts_[static_cast<std::size_t>(mixture_.cone_component())] = 0;
    return per_light * lights + of_bsdf;
  }

  // Fills in t/K of all candidates. @return their sum
  double weigh(std::span<const double> coefficients, std::span<double> weights) noexcept {
    mixture_.mixture_pdfs_w(0, coefficients, weights_);
    const std::span<const float> targets = mixture_.unshadowed();
    double sum = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const auto target = static_cast<double>(targets[i]);
      if (target > 0.0 && !(weights[i] > 0.0)) ++mixture_.counters().uncovered;
      weights[i] = weights[i] > 0.0 ? target / weights[i] : 0.0;
      sum += weights[i];
    }
    return sum;
  }

  Budget budget_;
  int per_ray_;
  double bsdf_share_;
  Mixture mixture_;
  std::vector<int> counts_;           // [component]
  std::vector<double> coefficients_;  // [component]
  std::vector<double> weights_;       // [candidate]; first its density K
  std::vector<Choice> choices_;
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
      light_sampling_param(LightSampling::SolidAngle),
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
