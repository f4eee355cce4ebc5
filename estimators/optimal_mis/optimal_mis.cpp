// Optimal multiple importance sampling: the mixture's own densities as control variates.
//
// Idea: the densities h_k of the techniques integrate to 1 each, so that sum_k beta_k h_k may be
// subtracted from the integrand and its integral sum_k beta_k added again. With the best beta this
// has the least variance of all weights that sum to 1, negative ones included. Sources: Owen and
// Zhou 2000, "Safe and effective importance sampling"; Kondapaneni et al. 2019, "Optimal multiple
// importance sampling", which shows that both are the same estimator.
//
// Equations, with N samples w_i of the mixture K = sum_k (n_k/N) h_k, n_k fixed in advance (the
// counts of `mis` with the shared layout):
//   estimate   F = 1/N sum_i f(w_i)/K(w_i) + sum_k beta_k (1 - 1/N sum_i h_k(w_i)/K(w_i))
//   beta       solves sum_l A_kl beta_l = b_k with A_kl = sum h_k h_l/K^2, b_k = sum f h_k/K^2,
//              per colour channel; the sums run over samples of other estimates
// Directions that bring no light count in the sums of h_k/K like all others. A draw of the BSDF
// below the horizon, which has no density there, is an event of its own that no other technique can
// cause: h_BSDF/K = N/n_BSDF; so h_BSDF integrates to 1 together with these.
//
// Coefficients are shared by estimates whose points have the same material, the same dominant axis
// of the normal and the same lights that can contribute. Up to kGroup estimates of a tile are drawn
// once; those that share are dealt out to kFolds folds, and each fold gets its coefficients from
// the samples of the other folds. Where these are fewer than kSamplesPerCoefficient for each
// coefficient, beta = 0: that is `mis` with the balance heuristic. Beyond kMostLights lights, one
// component stands for all of them, which draws a light uniformly.
//
// Parameters: coefficients = others, ridge = 1e-5, light_sampling = area.
// Unbiased: given the other folds' samples beta is fixed, every h_k integrates to 1 and is covered
// by K. With coefficients = own they follow from the very samples they are applied to: biased, the
// control that tests must reject. Estimates may be negative, and are left so: clamping them would
// bias the mean. Weak case: occluded lights, where f/K is nothing like a sum of densities; pixels
// unlike the others of their tile.

#include "estimators/optimal_mis/optimal_mis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "estimators/mixture/estimates.h"
#include "estimators/optimal_mis/normal_equations.h"

namespace penumbra::optimal_mis {
namespace {

constexpr std::size_t kGroup = 1024;     // estimates that are drawn before any is finished
constexpr std::size_t kBuckets = 32;     // sets of estimates that share coefficients, in a group
constexpr std::size_t kFolds = 8;        // of a bucket
constexpr std::size_t kMostLights = 16;  // with a component of their own
constexpr double kSamplesPerCoefficient = 16.0;

// What estimates that share coefficients have in common.
struct Kind {
  std::uint32_t material{ShadingPoint::kInvalid};
  int axis{0};              // of the normal, 0 to 5
  std::uint64_t lights{0};  // that can contribute, bit by bit; 0 where one component stands for all

  bool operator==(const Kind&) const = default;
};

int dominant_axis(const Vec3& normal) noexcept {
  int axis = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::abs(normal[i]) > std::abs(normal[axis])) axis = i;
  }
  return 2 * axis + (normal[axis] < 0.0f ? 1 : 0);
}

class OptimalMis final : public Estimator {
 public:
  OptimalMis(const Scene& scene, const ParamSet& params, const Budget& budget)
      : budget_(budget),
        from_own_(params.text("coefficients") == "own"),
        ridge_(params.real("ridge")),
        lights_as_one_(scene.sampled_lights().size() > kMostLights),
        most_coefficients_((lights_as_one_ ? 1 : scene.sampled_lights().size()) + 1),
        mixture_(scene, light_sampling_of(params), lights_as_one_, most_samples(scene, budget)),
        counts_(most_coefficients_ + 1),
        weights_(most_coefficients_ + 1),
        density_(most_samples(scene, budget) + kLaneGroup),
        x_(most_coefficients_),
        own_(most_coefficients_),
        others_(most_coefficients_),
        deferred_(kGroup),
        means_(kGroup * most_coefficients_),
        equations_(kBuckets * kFolds, own_),
        beta_(kFolds * most_coefficients_),
        kinds_(kBuckets),
        light_bit_(scene.lights().size()) {
    mixture_.keep_dropped();
    for (std::size_t i = 0; !lights_as_one_ && i < scene.sampled_lights().size(); ++i) {
      light_bit_[scene.sampled_lights()[i]] = static_cast<int>(i);
    }
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    mixture_.counters() = {};
    mixture_.set_clock(out.clock);
    const std::size_t count = tile.estimate_count();
    // Groups of equal size, so that none is too small to learn from.
    const std::size_t groups = (count + kGroup - 1) / kGroup;
    for (std::size_t g = 0; g < groups; ++g) {
      one_group(tile, seed, count * g / groups, count * (g + 1) / groups, out);
    }
    mixture_.counters().iterations = mixture_.counters().estimates;
    mixture_.enter(EstimateStage::Outside);
    out.counters += mixture_.counters();
  }

 private:
  // An estimate that is drawn and waits for its coefficients.
  struct Deferred {
    std::size_t index;  // in the tile
    int pixel, sample;
    std::size_t bucket, fold;
  };

  void one_group(const Tile& tile, std::uint64_t seed, std::size_t first, std::size_t last,
                 TileOutput& out) noexcept {
    deferred_count_ = 0;
    buckets_ = 0;
    for (std::size_t i = first; i < last; ++i) {
      const auto pixel = static_cast<int>(i / static_cast<std::size_t>(tile.spp));
      const auto s = static_cast<int>(i % static_cast<std::size_t>(tile.spp));
      estimate_one(mixture_, tile, seed, pixel, s, out, [&](const StreamKey& key) {
        return one_point(key, {i, pixel, s, 0, 0});
      });
    }
    mixture_.enter(EstimateStage::Adapt);
    for (std::size_t bucket = 0; bucket < buckets_; ++bucket) {
      find_coefficients(bucket);
      for (std::size_t d = 0; d < deferred_count_; ++d) {
        if (deferred_[d].bucket == bucket) finish(d, out);
      }
    }
  }

  // Draws the samples of an estimate. @return its part without control variates
  Rgb one_point(const StreamKey& key, Deferred estimate) noexcept {
    const int n = shared_mis_counts(budget_.srl(), mixture_.active_lights(),
                                    mixture_.light_components(), counts_);
    const auto components = static_cast<std::size_t>(mixture_.components());
    for (std::size_t k = 0; k < components; ++k) weights_[k] = static_cast<double>(counts_[k]) / n;
    mixture_.draw(budget_.sampler, key, std::span(counts_).first(components));

    // The cone takes no part.
    const std::size_t m = components - 1;
    const std::span<double> means =
        std::span(means_).subspan(deferred_count_ * most_coefficients_, m);
    const RgbSum sum = add_up(m, means);
    for (double& mean : means) mean /= n;
    mixture_.scale_recorded_weights(0, mixture_.size(), 1.0 / n);
    const RgbSum balance = sum / static_cast<double>(n);
    mixture_.enter(EstimateStage::Adapt);
    if (from_own_) {
      const std::span<RgbSum> beta = std::span(beta_).first(m);
      own_.solve(ridge_, beta);
      const RgbSum control = control_variates(beta, means);
      if (EstimateRecord* record = mixture_.record()) record->control = narrow(control);
      return narrow(balance + control);
    }
    defer(estimate);
    return narrow(balance);
  }

  // Sums over all directions of f/K, and of h_k/K for each k, and the equations of their
  // regression.
  RgbSum add_up(std::size_t m, std::span<double> sums) noexcept {
    own_.clear(m);
    std::fill(sums.begin(), sums.end(), 0.0);
    const auto add = [&](double density, const RgbSum& f, auto pdf_w) {
      const double inverse = 1.0 / density;
      for (std::size_t k = 0; k < m; ++k) {
        x_[k] = pdf_w(static_cast<int>(k)) * inverse;
        sums[k] += x_[k];
      }
      own_.add(x_, f * inverse);
    };
    mixture_.mixture_pdfs_w(0, std::span(weights_).first(m + 1), density_);
    RgbSum sum(0.0);
    for (std::size_t i = 0; i < mixture_.size(); ++i) {
      if (!(density_[i] > 0.0)) {
        mixture_.counters().uncovered += is_black(mixture_.f(i)) ? 0u : 1u;
        continue;
      }
      mixture_.record_weight(i, 1.0 / density_[i]);
      const RgbSum f = widen(mixture_.f(i));
      sum += f * (1.0 / density_[i]);
      add(density_[i], f, [&](int k) { return static_cast<double>(mixture_.pdf_w(i, k)); });
    }
    for (std::size_t i = 0; i < mixture_.dropped(); ++i) {
      const auto pdf_w = [&](int k) { return static_cast<double>(mixture_.dropped_pdf_w(i, k)); };
      double density = 0.0;
      for (std::size_t k = 0; k < m; ++k) density += weights_[k] * pdf_w(static_cast<int>(k));
      add(density, RgbSum(0.0), pdf_w);
    }
    for (std::size_t k = 0; k < m; ++k) {
      const int alone = mixture_.dropped_alone(static_cast<int>(k));
      if (alone == 0) continue;
      own_.add_alone(k, 1.0 / weights_[k], alone);
      sums[k] += alone / weights_[k];
    }
    return sum;
  }

  // Adds an estimate to its bucket; where there are too many kinds it is finished as it is.
  void defer(Deferred estimate) noexcept {
    Kind kind{mixture_.point().material, dominant_axis(mixture_.point().shading_normal)};
    for (int l = 0; !lights_as_one_ && l < mixture_.active_lights(); ++l) {
      kind.lights |= std::uint64_t{1} << light_bit_[mixture_.light_index(l)];
    }
    std::size_t bucket = 0;
    while (bucket < buckets_ && !(kinds_[bucket] == kind)) ++bucket;
    if (bucket == kBuckets) return;
    if (bucket == buckets_) {
      kinds_[bucket] = kind;
      members_[bucket] = 0;
      for (std::size_t f = 0; f < kFolds; ++f) equations(bucket, f).clear(own_.size());
      ++buckets_;
    }
    estimate.bucket = bucket;
    estimate.fold = members_[bucket]++ % kFolds;
    equations(bucket, estimate.fold).add(own_);
    deferred_[deferred_count_++] = estimate;
  }

  // The coefficients of each fold of a bucket.
  void find_coefficients(std::size_t bucket) noexcept {
    const std::size_t m = equations(bucket, 0).size();
    for (std::size_t fold = 0; fold < std::min(kFolds, members_[bucket]); ++fold) {
      others_.clear(m);
      for (std::size_t f = 0; f < kFolds; ++f) {
        if (f != fold) others_.add(equations(bucket, f));
      }
      const std::span<RgbSum> beta = coefficients(fold, m);
      if (others_.samples() < kSamplesPerCoefficient * static_cast<double>(m)) {
        std::fill(beta.begin(), beta.end(), RgbSum(0.0));
      } else {
        others_.solve(ridge_, beta);
      }
    }
  }

  void finish(std::size_t d, TileOutput& out) noexcept {
    const Deferred& estimate = deferred_[d];
    const std::size_t m = equations(estimate.bucket, 0).size();
    const Rgb control = narrow(control_variates(
        coefficients(estimate.fold, m), std::span(means_).subspan(d * most_coefficients_, m)));
    out.radiance[estimate.index] += control;
    if (out.recorder == nullptr) return;
    if (EstimateRecord* record = out.recorder->find(estimate.pixel, estimate.sample)) {
      record->control = control;
    }
  }

  static RgbSum control_variates(std::span<const RgbSum> beta,
                                 std::span<const double> means) noexcept {
    RgbSum sum(0.0);
    for (std::size_t k = 0; k < beta.size(); ++k) sum += beta[k] * (1.0 - means[k]);
    return sum;
  }

  NormalEquations& equations(std::size_t bucket, std::size_t fold) noexcept {
    return equations_[bucket * kFolds + fold];
  }
  std::span<RgbSum> coefficients(std::size_t fold, std::size_t m) noexcept {
    return std::span(beta_).subspan(fold * most_coefficients_, m);
  }

  Budget budget_;
  bool from_own_;
  double ridge_;
  bool lights_as_one_;
  std::size_t most_coefficients_;
  Mixture mixture_;
  std::vector<int> counts_;      // [component]
  std::vector<double> weights_;  // [component] n_k/N
  std::vector<double> density_;  // [sample] K
  std::vector<double> x_;        // [coefficient] h_k/K of one direction
  NormalEquations own_;          // of one estimate
  NormalEquations others_;       // of all folds but one

  // Of a group.
  std::size_t deferred_count_{0};
  std::vector<Deferred> deferred_;
  std::vector<double> means_;  // [deferred][coefficient] 1/N sum h_k/K
  std::size_t buckets_{0};
  std::vector<NormalEquations> equations_;  // [bucket][fold]
  std::vector<RgbSum> beta_;                // [fold][coefficient]
  std::vector<Kind> kinds_;                 // [bucket]
  std::array<std::size_t, kBuckets> members_{};

  std::vector<int> light_bit_;  // [scene light] of Kind::lights
};

std::span<const ParamSpec> params() {
  static const std::vector<ParamSpec> specs = {
      light_sampling_param(),
      {.name = "coefficients",
       .default_value = std::string("others"),
       .doc = "samples that the control variates' coefficients follow from: those of other "
              "estimates, or the estimate's own, which biases it",
       .choices = {"others", "own"}},
      {.name = "ridge",
       .default_value = 1e-5,
       .doc = "added to the diagonal of the normal equations, as a share of it",
       .min = 1e-12,
       .max = 1.0},
  };
  return specs;
}

std::string bias_reason(const ParamSet& params) {
  return params.text("coefficients") == "others"
             ? ""
             : "coefficients follow from the samples that they are applied to";
}

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
  return std::make_unique<OptimalMis>(scene, params, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "optimal_mis",
    .summary = "multiple importance sampling with the densities as control variates",
    .citation =
        "Kondapaneni, Vevoda, Grittmann, Skrivan, Slusallek and Krivanek 2019, Optimal "
        "multiple importance sampling",
    .shares_in_tile = true,
    .may_be_negative = true,
    .min_srl = 2,
    .params = params,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::optimal_mis
