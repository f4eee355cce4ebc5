// PMC-HI: population Monte Carlo sampling of the hemispherical integral at one shading point.
//
// Idea: draw a small population of directions from a mixture of light, BSDF and cone proposals, see
// which components brought light, shift the mixture towards them, and draw the next population from
// it. Nothing is stored between points. Source: Lai, Chou, Chen and Fan 2014, "Robust and efficient
// adaptive direct lighting estimation", The Visual Computer.
//
// Equations, numbered as there:
//   (4)  K(w) = alpha_BSDF h_BSDF(w) + sum_l alpha_l h_l(w) + alpha_cone h_cone(w)
//   (5)  w_i = f(w_i)/K(w_i)
//   (6)  alpha_k = sum_{i drawn by k} w_i / sum_i w_i         of the previous population
//   (3)  estimate = plain average of all weights of all iterations
//   cone: axis = weighted mean direction, half angle = weighted RMS angle of the previous
//   population.
// Initial stage: srl_initial x lights directions with alpha_cone = 0 and the others equal. Adaptive
// stage: srl_adaptive x lights directions in iterations of about N = 2m, m the number of
// components. Two stages (the paper's section 6): a few such populations adapt the mixture, then
// one large iteration draws all the rest from it.
//
// Deviations from the paper, each with its reason; the literal reading is a set of switches:
//   sequence = fresh     points that go on where those that decided their number ended are not
//   uniform given that number.
//   n_min = 1            Eq. 6 never revives a component of weight 0, so the literal method loses
//   whole lights (-10 % on
//                        a fixture). One sample per component but the cone keeps the support
//                        covered.
//   denominator = counts K is formed with n_k/N, the deterministic-mixture (balance) weights for
//   counts that are fixed
//                        before drawing. With alpha_k and rounded counts the estimate is biased.
//   cone_min_hits = 2    one hit alone gives a cone of angle 0, which then captures all samples.
//   beta_min             smallest half angle [rad], for the same reason.
//   Lights that can not contribute at the point are left out before the first iteration.
//   cone = needed        the cone narrows a light down to its visible part; it is left out where
//                        boxes and planes show that nothing lies between the point and its lights.
//                        Depends on scene and point only, so it biases nothing.
// Parameters with defaults: see settings.cpp.
//
// Unbiased with the defaults: given the past, counts, axis and angle are constants, every light
// keeps a sample, random numbers are fresh in each iteration, and the number of iterations is fixed
// in advance. Weak case: small populations learn little; the cone of two widely spaced lights
// points between them.

#include "estimators/pmc_hi/pmc_hi.h"

#include <algorithm>
#include <memory>

#include "estimators/mixture/estimates.h"
#include "estimators/pmc_hi/combine.h"
#include "estimators/pmc_hi/kernel.h"
#include "estimators/pmc_hi/settings.h"

namespace penumbra::pmc_hi {
namespace {

// The weights that the maps show: those learned by the first two iterations.
constexpr int kMapIteration = 2;
// Maps behind those of the weights: cone angle, hits, rays.
constexpr std::size_t kOtherMaps = 3;

class PmcHi final : public Estimator {
 public:
  PmcHi(const Scene& scene, const ParamSet& params, const Budget& budget)
      : settings_(read_settings(params)),
        budget_(budget),
        scene_(&scene),
        mixture_(scene, settings_.light_sampling, settings_.lights_as_one,
                 most_samples(scene, budget)),
        max_components_(scene.sampled_lights().size() + 2),
        kernel_(settings_, max_components_),
        density_(most_samples(scene, budget) + kLaneGroup),
        weights_(most_samples(scene, budget)),
        drawn_(max_components_) {
    const std::size_t lights = scene.sampled_lights().size();
    check_budget(settings_, budget, lights);
    const std::size_t most = most_iterations(static_cast<int>(lights));
    iterations_.resize(most);
    if (settings_.combine == Combine::Pooled) coefficients_.resize(most * max_components_);
  }

  std::vector<MapInfo> maps() const override {
    const std::string weights = "mixture weight after two iterations";
    std::vector<MapInfo> maps;
    if (settings_.lights_as_one) {
      maps.push_back({"alpha_lights", weights});
    } else {
      for (const Light& light : scene_->lights()) maps.push_back({"alpha_" + light.name, weights});
    }
    maps.push_back({"alpha_bsdf", weights});
    maps.push_back({"alpha_cone", weights});
    maps.push_back({"cone_angle", "half angle after 2 iterations [rad]", 1.0f});
    maps.push_back({"hits", "share of samples", 1.0f});
    maps.push_back({"rays", "share of samples", 1.0f});
    return maps;
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    const std::size_t maps = out.maps.empty() ? 0 : weight_map_count() + kOtherMaps;
    const auto clear_map = [&](std::size_t i) {
      map_ = out.maps.subspan(i * maps, maps);
      std::fill(map_.begin(), map_.end(), 0.0f);
    };
    estimate_tile(mixture_, tile, seed, out, clear_map,
                  [this](const StreamKey& key) { return one_point(key); });
  }

 private:
  std::size_t weight_map_count() const noexcept {
    return (settings_.lights_as_one ? 1 : scene_->lights().size()) + 2;
  }

  // Samples per adaptive iteration for m components.
  int population(int light_components, bool with_cone) const noexcept {
    if (settings_.population > 0) return settings_.population;
    return 2 * (light_components + 1 + (with_cone ? 1 : 0));
  }

  int adaptive_iterations(int active_lights, int light_components, bool with_cone) const noexcept {
    const int rays = budget_.srl_adaptive * active_lights;
    if (!settings_.adapt || rays == 0) return 0;
    const int populations = std::max(1, rays / population(light_components, with_cone));
    return settings_.two_stage ? std::min(settings_.base_iterations + 1, populations) : populations;
  }

  // Samples of adaptive iteration t >= 1 of `count`. Populations: nearly equal shares, the first
  // take what is left over. Two stages: populations, then all the rest at once.
  int adaptive_samples(int t, int count, int rays, bool with_cone) const noexcept {
    if (!settings_.two_stage) return rays / count + (t <= rays % count ? 1 : 0);
    const int base = population(mixture_.light_components(), with_cone);
    return t < count ? base : rays - (count - 1) * base;
  }

  // Largest number of iterations at any point of the scene.
  std::size_t most_iterations(int lights) const noexcept {
    int most = 0;
    for (int active = 1; active <= lights; ++active) {
      // Without a cone populations are smaller.
      const bool with_cone = settings_.cone == ConeUse::Always;
      most = std::max(most,
                      adaptive_iterations(active, settings_.lights_as_one ? 1 : active, with_cone));
    }
    return static_cast<std::size_t>(most) + 1;
  }

  // The cone narrows a light down to the part that is not hidden. Where nothing can hide any of it,
  // the other components are at least as good.
  bool needs_cone() const noexcept {
    if (settings_.cone != ConeUse::Needed) return settings_.cone == ConeUse::Always;
    for (int i = 0; i < mixture_.active_lights(); ++i) {
      if (scene_->may_be_occluded(mixture_.light_index(i), mixture_.point())) return true;
    }
    return false;
  }

  Rgb one_point(StreamKey key) noexcept {
    const int lights = mixture_.active_lights();
    const bool with_cone = needs_cone();
    mixture_.enter(EstimateStage::Adapt);
    const int count = adaptive_iterations(lights, mixture_.light_components(), with_cone) + 1;
    const int initial_rays = (settings_.adapt ? budget_.srl_initial : budget_.srl()) * lights;
    const int adaptive_rays = count > 1 ? budget_.srl_adaptive * lights : 0;
    for (int t = 0; t < count; ++t) {
      key.iteration = static_cast<std::uint32_t>(t);
      Iteration& it = iterations_[static_cast<std::size_t>(t)];
      it = {};
      it.n = t == 0 ? initial_rays : adaptive_samples(t, count - 1, adaptive_rays, with_cone);
      if (t == 0) {
        kernel_.start(mixture_, key, it.n, with_cone);
      } else {
        kernel_.next(key, it.n);
      }
      run(key, static_cast<std::size_t>(t), it);
      mixture_.enter(EstimateStage::Adapt);
      // A last adaptation is wasted unless the maps want its weights.
      if (t + 1 == count && (map_.empty() || t >= kMapIteration)) break;
      kernel_.learn(mixture_, it.first, weights_of(it));
      if (!map_.empty() && t < kMapIteration) record_weights();
    }
    mixture_.enter(EstimateStage::Weigh);
    mixture_.counters().iterations += static_cast<std::uint64_t>(count);
    if (!map_.empty()) record_shares(initial_rays + adaptive_rays);
    return narrow(combine(settings_.combine, mixture_,
                          std::span(iterations_).first(static_cast<std::size_t>(count)),
                          coefficients_, max_components_));
  }

  std::span<const double> weights_of(const Iteration& it) const noexcept {
    return std::span(weights_).subspan(it.first, mixture_.size() - it.first);
  }

  void draw(StreamKey key, std::size_t t) noexcept {
    if (!settings_.continue_sequence) return mixture_.draw(budget_.sampler, key, kernel_.counts());
    const std::span<int> drawn = std::span(drawn_).first(kernel_.counts().size());
    if (t == 0) std::fill(drawn.begin(), drawn.end(), 0);
    key.iteration = 0;
    mixture_.draw(budget_.sampler, key, kernel_.counts(), drawn);
    for (std::size_t k = 0; k < drawn.size(); ++k) drawn[k] += kernel_.counts()[k];
  }

  // Draws, traces and weights one population.
  void run(const StreamKey& key, std::size_t t, Iteration& it) noexcept {
    it.cone = mixture_.cone();
    it.first = mixture_.size();
    draw(key, t);
    if (EstimateRecord* record = mixture_.record()) {
      record->iterations.back().alpha.assign(kernel_.alpha().begin(), kernel_.alpha().end());
    }
    if (settings_.combine == Combine::Pooled) {
      std::copy(kernel_.coefficients().begin(), kernel_.coefficients().end(),
                coefficients_.begin() + static_cast<std::ptrdiff_t>(t * max_components_));
    }
    mixture_.mixture_pdfs_w(it.first, kernel_.coefficients(), density_);
    RgbSum sum(0.0);
    double square_sum = 0.0;
    for (std::size_t i = it.first; i < mixture_.size(); ++i) {
      weights_[i] = 0.0;
      if (is_black(mixture_.f(i))) continue;
      const double k = density_[i - it.first];
      if (!(k > 0.0)) {
        ++mixture_.counters().uncovered;
        continue;
      }
      const RgbSum weight = widen(mixture_.f(i)) * (1.0 / k);
      weights_[i] = luminance(weight);
      sum += weight;
      square_sum += weights_[i] * weights_[i];
      mixture_.record_weight(i, 1.0 / k);
    }
    it.sum = sum;
    it.square_sum = square_sum;
  }

  // The learned weights before floors, at the places of the scene's lights; 0 for lights left out
  // at the point.
  void record_weights() noexcept {
    const std::span<const double> learned = kernel_.learned();
    const std::span<float> weights = map_.first(weight_map_count());
    std::fill(weights.begin(), weights.end(), 0.0f);
    const std::size_t lights = learned.size() - 2;
    for (std::size_t k = 0; k < lights; ++k) {
      const std::size_t place =
          settings_.lights_as_one ? 0 : mixture_.light_index(static_cast<int>(k));
      weights[place] = static_cast<float>(learned[k]);
    }
    weights[weights.size() - 2] = static_cast<float>(learned[lights]);
    weights[weights.size() - 1] = static_cast<float>(learned[lights + 1]);
    map_[weights.size()] = static_cast<float>(mixture_.cone().half_angle());
  }

  // What became of the samples of all iterations.
  void record_shares(int drawn) noexcept {
    const auto end = weights_.begin() + static_cast<std::ptrdiff_t>(mixture_.size());
    const auto hits = std::count_if(weights_.begin(), end, [](double w) { return w > 0.0; });
    map_[map_.size() - 2] = static_cast<float>(hits) / static_cast<float>(drawn);
    map_[map_.size() - 1] = static_cast<float>(mixture_.size()) / static_cast<float>(drawn);
  }

  Settings settings_;
  Budget budget_;
  const Scene* scene_;
  Mixture mixture_;
  std::size_t max_components_;
  Kernel kernel_;
  std::vector<double> density_;  // [sample of an iteration], K
  std::vector<double> weights_;  // [sample], luminance of f/K
  std::vector<Iteration> iterations_;
  std::vector<int> drawn_;            // [component] points of a continued set
  std::vector<double> coefficients_;  // [iteration][component], for the pooled denominator only
  std::span<float> map_;
};

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
  return std::make_unique<PmcHi>(scene, params, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "pmc_hi",
    .summary =
        "population Monte Carlo over light, BSDF and cone directions, adapted at every point",
    .citation =
        "Lai, Chou, Chen and Fan 2014, Robust and efficient adaptive direct lighting estimation",
    .adaptive = true,
    .min_srl = 2,
    .params = specs,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::pmc_hi
