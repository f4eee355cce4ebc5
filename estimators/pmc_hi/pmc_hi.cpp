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
// Parameters with defaults: see settings.cpp.
//
// Unbiased with the defaults: given the past, counts, axis and angle are constants, every light
// keeps a sample, random numbers are fresh in each iteration, and the number of iterations is fixed
// in advance. Weak case: small populations learn little; the cone of two widely spaced lights
// points between them.

#include "estimators/pmc_hi/pmc_hi.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/mixture/mixture.h"
#include "estimators/pmc_hi/adaptation.h"
#include "estimators/pmc_hi/settings.h"

namespace penumbra::pmc_hi {
namespace {

// The weights that the maps show: those learned by the first two iterations.
constexpr int kMapIteration = 2;
// Maps behind those of the weights: cone angle, hits, rays.
constexpr std::size_t kOtherMaps = 3;

struct Iteration {
  int n{0};
  std::size_t first{0};  // of its samples in the mixture
  RgbSum sum{0.0};       // of the weights f/K
  double square_sum{0};  // of squared luminances, for the biased combination only
  Cone cone;
};

class PmcHi final : public Estimator {
 public:
  PmcHi(const Scene& scene, const ParamSet& params, const Budget& budget)
      : settings_(read_settings(params)),
        budget_(budget),
        scene_(&scene),
        mixture_(scene, settings_.light_sampling, settings_.lights_as_one,
                 most_samples(scene, budget)),
        alpha_(scene.lights().size() + 2),
        learned_(alpha_.size()),
        evidence_(alpha_.size()),
        counts_(alpha_.size()),
        weights_(most_samples(scene, budget)) {
    const auto lights = static_cast<std::size_t>(
        std::count_if(scene.lights().begin(), scene.lights().end(),
                      [](const Light& light) { return !light.is_delta(); }));
    check_budget(settings_, budget, lights);
    const std::size_t most = most_iterations(static_cast<int>(lights));
    iterations_.resize(most);
    coefficients_.resize(most * alpha_.size());
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
    maps.push_back({"cone_angle", "half angle of the cone after two iterations [rad]", 1.0f});
    maps.push_back({"hits", "share of samples that brought light", 1.0f});
    maps.push_back({"rays", "share of samples that were traced", 1.0f});
    return maps;
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    const std::size_t maps = out.maps.empty() ? 0 : map_count();
    const auto clear_map = [&](std::size_t i) {
      map_ = out.maps.subspan(i * maps, maps);
      std::fill(map_.begin(), map_.end(), 0.0f);
    };
    estimate_tile(mixture_, tile, seed, out, clear_map,
                  [this](const StreamKey& key) { return one_point(key); });
  }

 private:
  // Maps of mixture weights, and all maps.
  std::size_t weight_map_count() const noexcept {
    return (settings_.lights_as_one ? 1 : scene_->lights().size()) + 2;
  }
  std::size_t map_count() const noexcept { return weight_map_count() + kOtherMaps; }

  // Samples per adaptive iteration for m components.
  int population(int light_components) const noexcept {
    if (settings_.population > 0) return settings_.population;
    return 2 * (light_components + 1 + (settings_.cone ? 1 : 0));
  }

  int adaptive_iterations(int active_lights, int light_components) const noexcept {
    const int rays = budget_.srl_adaptive * active_lights;
    if (!settings_.adapt || rays == 0) return 0;
    const int populations = std::max(1, rays / population(light_components));
    return settings_.two_stage ? std::min(settings_.base_iterations + 1, populations) : populations;
  }

  // Samples of adaptive iteration t >= 1 of `count`. Populations: nearly equal shares, the first
  // take what is left over. Two stages: populations, then all the rest at once.
  int adaptive_samples(int t, int count, int rays) const noexcept {
    if (!settings_.two_stage) return rays / count + (t <= rays % count ? 1 : 0);
    const int base = population(mixture_.light_components());
    return t < count ? base : rays - (count - 1) * base;
  }

  // Largest number of iterations at any point of the scene.
  std::size_t most_iterations(int lights) const noexcept {
    int most = 0;
    for (int active = 1; active <= lights; ++active) {
      most = std::max(most, adaptive_iterations(active, settings_.lights_as_one ? 1 : active));
    }
    return static_cast<std::size_t>(most) + 1;
  }

  Rgb one_point(StreamKey key) noexcept {
    const int lights = mixture_.active_lights();
    m_ = static_cast<std::size_t>(mixture_.components());
    cone_valid_ = false;
    std::fill(evidence_.begin(), evidence_.end(), 0.0);
    count_ = adaptive_iterations(lights, mixture_.light_components()) + 1;
    const int initial_rays = (settings_.adapt ? budget_.srl_initial : budget_.srl()) * lights;
    const int adaptive_rays = budget_.srl_adaptive * lights;

    for (int t = 0; t < count_; ++t) {
      key.iteration = static_cast<std::uint32_t>(t);
      Iteration& it = iterations_[static_cast<std::size_t>(t)];
      it = {};
      if (t == 0) {
        start(key, initial_rays, lights);
        it.n = initial_rays;
      } else {
        it.n = adaptive_samples(t, count_ - 1, adaptive_rays);
        round_counts(settings_.rounding, std::span(alpha_).first(m_), it.n, key,
                     std::span(counts_).first(m_));
        raise_to_minimum(std::span(counts_).first(m_), settings_.n_min);
      }
      run(key, t, it);
      // A last adaptation is wasted unless the maps want its weights.
      if (t + 1 < count_ || (!map_.empty() && t < kMapIteration)) adapt(t, it);
    }
    mixture_.counters().iterations += static_cast<std::uint64_t>(count_);
    record_shares(initial_rays + (count_ > 1 ? adaptive_rays : 0));
    return narrow(combined());
  }

  // Weights and counts of the first iteration: no cone.
  void start(const StreamKey& key, int rays, int lights) noexcept {
    const std::size_t sampled = m_ - 1;
    const std::span<int> counts = std::span(counts_).first(m_);
    if (settings_.initial == Initial::MisSplit) {
      shared_mis_counts(rays / lights, lights, mixture_.light_components(), counts);
      for (std::size_t k = 0; k < m_; ++k) alpha_[k] = static_cast<double>(counts_[k]) / rays;
      return;
    }
    for (std::size_t k = 0; k < m_; ++k) {
      alpha_[k] = k < sampled ? 1.0 / static_cast<double>(sampled) : 0.0;
    }
    round_counts(settings_.rounding, std::span(alpha_).first(m_), rays, key, counts);
    raise_to_minimum(counts, settings_.n_min);
  }

  std::span<double> coefficients(int t) noexcept {
    return std::span(coefficients_).subspan(static_cast<std::size_t>(t) * alpha_.size(), m_);
  }

  // Draws, traces and weights one population.
  void run(const StreamKey& key, int t, Iteration& it) noexcept {
    const std::span<double> c = coefficients(t);
    for (std::size_t k = 0; k < m_; ++k) {
      c[k] = settings_.denominator == Denominator::Counts ? static_cast<double>(counts_[k]) / it.n
                                                          : alpha_[k];
    }
    it.cone = mixture_.cone();
    it.first = mixture_.size();
    mixture_.draw(budget_.sampler, key, std::span(counts_).first(m_));
    if (EstimateRecord* record = mixture_.record()) {
      record->iterations.back().alpha.assign(alpha_.begin(),
                                             alpha_.begin() + static_cast<std::ptrdiff_t>(m_));
    }
    it.sum = balance_sum(mixture_, it.first, c);
    for (std::size_t i = it.first; i < mixture_.size(); ++i) {
      const double f = luminance(widen(mixture_.f(i)));
      const double k = f > 0.0 ? mixture_pdf_w(mixture_.pdfs(i), c) : 0.0;
      weights_[i] = k > 0.0 ? f / k : 0.0;
      it.square_sum += weights_[i] * weights_[i];
    }
  }

  // Learns the next mixture from iteration t: Eq. 6, then the cone.
  void adapt(int t, const Iteration& it) noexcept {
    const std::span<const double> weights =
        std::span(weights_).subspan(it.first, mixture_.size() - it.first);
    const std::span<double> alpha = std::span(alpha_).first(m_);
    const std::size_t cone = m_ - 1;
    const auto hits =
        std::count_if(weights.begin(), weights.end(), [](double w) { return w > 0.0; });

    const std::span<double> learned = std::span(learned_).first(m_);
    const std::span<double> evidence = std::span(evidence_).first(m_);
    if (!settings_.cumulative) std::fill(evidence.begin(), evidence.end(), 0.0);
    if (settings_.update == Update::Tag) {
      add_tag_sums(mixture_, it.first, weights, evidence);
    } else {
      add_posterior_sums(mixture_, it.first, weights, coefficients(t), evidence);
    }
    std::copy(evidence.begin(), evidence.end(), learned.begin());
    if (hits == 0 || !normalise(learned)) {
      // Nothing was seen: Eq. 6 is 0/0. The weights stay, without a cone.
      cone_valid_ = false;
      mixture_.cone() = Cone{};
      alpha[cone] = 0.0;
      if (!normalise(alpha)) set_equal(alpha);
      record_map(t, alpha);
      return;
    }
    const bool had_cone = cone_valid_;
    mixture_.cone() = settings_.cone && hits >= settings_.cone_min_hits
                          ? fit_cone(mixture_, it.first, weights, settings_.cone_rules)
                          : Cone{};
    cone_valid_ = mixture_.cone().active();
    if (!cone_valid_) {
      learned[cone] = 0.0;
      if (!normalise(learned)) set_equal(learned);
    } else if (!had_cone) {
      learned[cone] = 0.0;
      if (!normalise(learned)) set_equal(learned);
      for (double& value : learned) value *= 1.0 - settings_.alpha_cone;
      learned[cone] = settings_.alpha_cone;
    }
    record_map(t, learned);
    const double floored = settings_.alpha_floor * static_cast<double>(cone);
    for (std::size_t k = 0; k < m_; ++k) {
      alpha[k] = (1.0 - floored) * learned[k] + (k < cone ? settings_.alpha_floor : 0.0);
    }
  }

  // All components but the cone.
  static void set_equal(std::span<double> alpha) noexcept {
    std::fill(alpha.begin(), alpha.end(), 1.0 / static_cast<double>(alpha.size() - 1));
    alpha.back() = 0.0;
  }

  // The learned weights before floors, at the places of the scene's lights; 0 for lights left out
  // at the point.
  void record_map(int t, std::span<const double> learned) noexcept {
    if (map_.empty() || t + 1 > kMapIteration) return;
    const std::span<float> weights = map_.first(weight_map_count());
    std::fill(weights.begin(), weights.end(), 0.0f);
    const std::size_t lights = m_ - 2;
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
    if (map_.empty()) return;
    const auto hits = std::count_if(weights_.begin(),
                                    weights_.begin() + static_cast<std::ptrdiff_t>(mixture_.size()),
                                    [](double w) { return w > 0.0; });
    map_[map_.size() - 2] = static_cast<float>(hits) / static_cast<float>(drawn);
    map_[map_.size() - 1] = static_cast<float>(mixture_.size()) / static_cast<float>(drawn);
  }

  RgbSum combined() noexcept {
    if (settings_.combine == Combine::Pooled) return pooled();
    const int first = settings_.combine == Combine::AdaptiveOnly && count_ > 1 ? 1
                      : settings_.combine == Combine::Last                     ? count_ - 1
                                                                               : 0;
    if (settings_.combine == Combine::InverseVariance) return inverse_variance();
    RgbSum sum(0.0);
    double total = 0.0;
    for (int t = first; t < count_; ++t) {
      const Iteration& it = iterations_[static_cast<std::size_t>(t)];
      const double factor = settings_.combine == Combine::Sqrt ? std::sqrt(t + 1.0) : 1.0;
      sum += it.sum * factor;
      total += factor * it.n;
    }
    if (mixture_.record() != nullptr) {
      for (int t = 0; t < count_; ++t) {
        const double factor = settings_.combine == Combine::Sqrt ? std::sqrt(t + 1.0) : 1.0;
        scale_record(t, t < first ? 0.0 : factor / total);
      }
    }
    return sum / total;
  }

  // Scales the recorded weights of one iteration.
  void scale_record(int t, double factor) noexcept {
    const auto next = static_cast<std::size_t>(t) + 1;
    mixture_.scale_recorded_weights(iterations_[next - 1].first,
                                    t + 1 < count_ ? iterations_[next].first : mixture_.size(),
                                    factor);
  }

  // Iterations weighted by the inverse of their own sample variances: the negative control, biased.
  // A variance far below the largest (no sample hit) is held at a thousandth of it, or the weight
  // would be infinite.
  RgbSum inverse_variance() noexcept {
    const auto variance = [](const Iteration& it) {
      const double mean = luminance(it.sum) / it.n;
      return std::max(it.square_sum / it.n - mean * mean, 0.0) / it.n;
    };
    double largest = 0.0;
    for (int t = 0; t < count_; ++t) {
      largest = std::max(largest, variance(iterations_[static_cast<std::size_t>(t)]));
    }
    RgbSum sum(0.0);
    double total = 0.0;
    for (int t = 0; t < count_; ++t) {
      const Iteration& it = iterations_[static_cast<std::size_t>(t)];
      const double weight = largest > 0.0 ? 1.0 / std::max(variance(it), 1e-3 * largest) : 1.0;
      sum += it.sum * (weight / it.n);
      total += weight;
      scale_record(t, weight / it.n);
    }
    mixture_.scale_recorded_weights(0, mixture_.size(), 1.0 / total);
    return sum / total;
  }

  // Every sample over the mixture of all iterations' kernels (AMIS): the other negative control,
  // biased. Source: Cornuet, Marin, Mira and Robert 2012, "Adaptive multiple importance sampling".
  RgbSum pooled() noexcept {
    RgbSum sum(0.0);
    for (std::size_t i = 0; i < mixture_.size(); ++i) {
      if (is_black(mixture_.f(i))) continue;
      const std::span<const float> pdfs = mixture_.pdfs(i);
      double k = 0.0;
      for (int t = 0; t < count_; ++t) {
        const Iteration& it = iterations_[static_cast<std::size_t>(t)];
        const std::span<const double> c = coefficients(t);
        k += it.n * mixture_pdf_w(pdfs.first(m_ - 1), c.first(m_ - 1));
        // The cone moved between iterations; a sample's own cone holds it by construction.
        const bool own =
            mixture_.component(i) == mixture_.cone_component() && i >= it.first &&
            (t + 1 == count_ || i < iterations_[static_cast<std::size_t>(t) + 1].first);
        k += it.n * c[m_ - 1] *
             static_cast<double>(own ? pdfs[m_ - 1] : it.cone.pdf_w(mixture_.wi(i)));
      }
      if (!(k > 0.0)) continue;
      mixture_.record_weight(i, 1.0 / k);
      sum += widen(mixture_.f(i)) / k;
    }
    return sum;
  }

  Settings settings_;
  Budget budget_;
  const Scene* scene_;
  Mixture mixture_;

  // Of the current point; sized for all lights.
  std::size_t m_{0};  // components
  int count_{0};      // iterations
  bool cone_valid_{false};
  std::vector<double> alpha_;
  std::vector<double> learned_;
  std::vector<double> evidence_;  // numerators of Eq. 6
  std::vector<int> counts_;
  std::vector<double> weights_;  // [sample], luminance of f/K
  std::vector<Iteration> iterations_;
  std::vector<double> coefficients_;  // [iteration][component]: c_k of K
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
