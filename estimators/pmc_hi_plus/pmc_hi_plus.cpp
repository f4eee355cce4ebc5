// PMC-HI+: populations that tell their neighbours where samples are worth their rays.
//
// Idea: PMC-HI adapts the mixture at every point from a handful of samples, and pays for the
// knowledge with the samples that bought it. Here every estimate of a block of pixels draws a small
// initial population; how much the samples of each light and of the glossy lobe vary there decides
// how many more its neighbours draw from that component. Where a light is wholly seen or wholly
// hidden nothing more is drawn; penumbrae and sharp highlights get the rest. Samples are never
// thrown away: those that are added continue the same sequence.
// Sources: population Monte Carlo for direct light, Lai et al. 2014, "Robust and efficient adaptive
// direct lighting estimation"; allocation by Neyman 1934, "On the two different aspects of the
// representative method", with the error of stratified points in place of independent ones; power
// heuristic by Veach and Guibas 1995.
//
// Equations, for component k (a light, or the glossy lobe) of an estimate:
//   n0_k   initial samples: srl_initial per light, of which the lobe takes its share
//   v_k    variance of the component's part of the estimate if it drew one sample, from the
//          initial weights of estimates of the other half in the neighbourhood (nearer ones count
//          more, those at the same point at least by themselves)
//   n_k    = max(n0_k, rays (v_k / L^2)^exponent),  L the luminance there (at least a tenth of the
//          block's mean); scaled down where the block's mean exceeds srl_adaptive per light
//   F      = sum_i f_i w_i over all samples, w by the power (or balance) heuristic with the n_k
// The error of n stratified points falls about as n^(-3/2) where visibility jumps: a sum of
// v_k n_k^(-3/2) is smallest for n_k in proportion to v_k^(2/5), hence the exponent 0.4. `rays` is
// the same everywhere, so all parts of an image end at the same gain per further ray.
//
// Halves: pixels and estimates alternate like the squares of a chessboard, and so do the estimates
// at one point of a pixel. One half's samples decide the other half's numbers and never their own.
// Unbiased: given the other half, the n_k are constants, every light has n_k >= 1, and each point
// of a sequence is uniform: F is multiple importance sampling with fixed counts. Continuing a
// sequence would not be allowed if its own first points decided how it goes on (as in pmc_hi).
// Errors of neighbours are not quite independent: their numbers of samples depend on one another.
//
// Parameters: see settings.cpp. Weak case: shadows thinner than the spacing of the initial
// samples of a whole neighbourhood, which then gets no more; blocks where everything is noisy.

#include "estimators/pmc_hi_plus/pmc_hi_plus.h"

#include <algorithm>
#include <memory>

#include "estimators/mixture/estimates.h"
#include "estimators/pmc_hi_plus/allocation.h"
#include "estimators/pmc_hi_plus/population.h"
#include "estimators/pmc_hi_plus/samples.h"
#include "estimators/pmc_hi_plus/settings.h"
#include "scenes/core/error.h"

namespace penumbra::pmc_hi_plus {
namespace {

// Samples of an estimate at most, in multiples of the mean that the budget allows; fewer where one
// estimate alone fills much memory.
constexpr std::size_t kMostOfMean = 8;
constexpr std::size_t kLargeEstimate = std::size_t{1} << 16;
// Bounds the memory of a block: members x slots.
constexpr std::size_t kMostStored = std::size_t{1} << 16;

class PmcHiPlus final : public Estimator {
 public:
  PmcHiPlus(const Scene& scene, const ParamSet& params, const Budget& budget)
      : settings_(read_settings(params, budget)),
        budget_(budget),
        slots_(scene.sampled_lights().size() + 1),
        group_(static_cast<int>(
            std::clamp<std::size_t>(kMostStored / (kBlockPixels * slots_), 1, kMostEstimates))),
        most_of_mean_(most_samples(scene, budget) * kMostOfMean <= kLargeEstimate ? kMostOfMean
                                                                                  : 2),
        mixture_(scene, settings_.light_sampling, false,
                 most_of_mean_ * most_samples(scene, budget)),
        population_(slots_, group_),
        allocation_(slots_, population_.most_places(), settings_.allocation),
        lit_(static_cast<std::size_t>(kBlockPixels * group_) * initial_samples(scene, budget),
             slots_ + 1),
        slot_of_light_(scene.lights().size(), 0),
        initial_(slots_ + 1),
        further_(slots_ + 1),
        counts_(slots_ + 1),
        sums_(slots_ + 1),
        squares_(slots_ + 1) {
    if (budget.srl_initial < 1) {
      throw InputError("pmc_hi_plus needs at least 1 initial shadow ray per light, found 0");
    }
    for (std::size_t i = 0; i + 1 < slots_; ++i) slot_of_light_[scene.sampled_lights()[i]] = i;
    if (settings_.glossy_lobes_only) mixture_.leave_out_diffuse_samples();
  }

  std::vector<MapInfo> maps() const override {
    return {{"samples", "samples, as a part of the budget", 2.0f}};
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    mixture_.counters() = {};
    mixture_.set_clock(out.clock);
    tile_ = &tile;
    out_ = &out;
    seed_ = seed;
    for (int y = 0; y < tile.height; y += kBlockSide) {
      for (int x = 0; x < tile.width; x += kBlockSide) {
        for (int s = 0; s < tile.spp; s += group_) one_group(x, y, s);
      }
    }
    mixture_.enter(EstimateStage::Outside);
    mixture_.counters().iterations += mixture_.counters().estimates;
    out.counters += mixture_.counters();
  }

 private:
  static std::size_t initial_samples(const Scene& scene, const Budget& budget) {
    return static_cast<std::size_t>(budget.srl_initial) * scene.sampled_lights().size();
  }

  // Estimates [first, first + group) of the pixels of a block.
  void one_group(int x, int y, int first) noexcept {
    x0_ = x;
    y0_ = y;
    first_ = first;
    population_.begin(std::min(kBlockSide, tile_->width - x),
                      std::min(kBlockSide, tile_->height - y), std::min(group_, tile_->spp - first),
                      tile_->camera_samples);
    lit_.clear();
    for_each_estimate([&](int pixel, int e) { draw_initial(pixel, e); });
    mixture_.enter(EstimateStage::Adapt);
    population_.gather();
    allocation_.decide(population_, [&](const Population::Member& member) {
      return initial_counts(member.lights, member.lobe);
    });
    for_each_estimate([&](int pixel, int e) {
      if (population_[population_.index(pixel, e)].used) complete(pixel, e);
    });
  }

  template <typename Visit>
  void for_each_estimate(Visit visit) noexcept {
    for (int pixel = 0; pixel < population_.pixels(); ++pixel) {
      for (int e = 0; e < population_.estimates(); ++e) visit(pixel, e);
    }
  }

  int pixel_in_tile(int pixel) const noexcept {
    return (y0_ + pixel / population_.width()) * tile_->width + x0_ + pixel % population_.width();
  }
  std::size_t output(int pixel, int s) const noexcept {
    return static_cast<std::size_t>(pixel_in_tile(pixel)) * static_cast<std::size_t>(tile_->spp) +
           static_cast<std::size_t>(s);
  }
  LightAndLobeCounts initial_counts(int lights, bool lobe) const noexcept {
    return light_and_lobe_counts(budget_.srl_initial * lights, lights,
                                 lobe ? settings_.allocation.bsdf_share : 0.0);
  }

  // Stores what needs no sampling; `complete` adds the rest.
  void draw_initial(int pixel, int e) noexcept {
    const int s = first_ + e;
    note_samples(pixel, s, 0, 1);
    estimate_one(mixture_, *tile_, seed_, pixel_in_tile(pixel), s, *out_,
                 [&](const StreamKey& key) {
                   draw_member(population_.index(pixel, e), key);
                   return Rgb(0.0f);
                 });
  }

  // The initial population of the point that the mixture is bound to.
  void draw_member(std::size_t i, const StreamKey& key) noexcept {
    Population::Member& member = population_.use(i, mixture_.point());
    member.key = key;
    member.lights = mixture_.active_lights();
    member.lobe = mixture_.has_glossy_lobe();
    count_initial(member);
    mixture_.draw(budget_.sampler, key, of_components(initial_));
    member.first = lit_.size();
    lit_.add(mixture_);
    member.last = lit_.size();
    learn(member, population_.variance(i));
  }

  // Initial counts of the point at hand.
  void count_initial(const Population::Member& member) noexcept {
    const LightAndLobeCounts n = initial_counts(member.lights, member.lobe);
    std::fill_n(initial_.begin(), member.lights, n.per_light);
    initial_[static_cast<std::size_t>(mixture_.bsdf_component())] = n.lobe;
    initial_[static_cast<std::size_t>(mixture_.cone_component())] = 0;
  }

  std::span<const int> of_components(const std::vector<int>& counts) const noexcept {
    return std::span(counts).first(static_cast<std::size_t>(mixture_.components()));
  }
  std::size_t slot_of(int component) const noexcept {
    return component < mixture_.light_components() ? slot_of_light_[mixture_.light_index(component)]
                                                   : slots_ - 1;
  }

  // The initial estimate, and how the parts of it vary.
  void learn(Population::Member& member, std::span<double> variance) noexcept {
    std::fill(sums_.begin(), sums_.end(), 0.0);
    std::fill(squares_.begin(), squares_.end(), 0.0);
    const int lobe = mixture_.bsdf_component();
    const std::span<const int> counts = of_components(initial_);
    for (std::size_t i = member.first; i < member.last; ++i) {
      const MisWeight weight = lit_.weight(i, settings_.heuristic, counts);
      const double w = weight_of(weight);
      const RgbSum value = widen(lit_[i].f) * w;
      const double l = luminance(value);
      const auto own = static_cast<std::size_t>(lit_[i].component);
      sums_[own] += l;
      squares_[own] += l * l;
      member.radiance += value;
      member.luminance += l;
      const double of_lobe =
          counts[static_cast<std::size_t>(lobe)] * static_cast<double>(lit_.pdf_w(i, lobe));
      member.lobe_luminance += l * weight.share(of_lobe);
      if (EstimateRecord* record = mixture_.record()) {
        record->samples[lit_[i].record_place].weight = w;
      }
    }
    for (int k = 0; k <= lobe; ++k) {
      const auto component = static_cast<std::size_t>(k);
      const double n = counts[component];
      if (n < 2) continue;
      const double spread = squares_[component] - sums_[component] * sums_[component] / n;
      variance[slot_of(k)] = std::max(0.0, spread) * n * n / (n - 1.0);
    }
  }

  double weight_of(const MisWeight& weight) noexcept {
    const double w = weight.value();
    if (!(w > 0.0)) ++mixture_.counters().uncovered;
    return w;
  }

  // Draws what the neighbours found to be worth it, and stores the estimate.
  void complete(int pixel, int e) noexcept {
    const Population::Member& member = population_[population_.index(pixel, e)];
    const std::span<const double> wanted = allocation_.samples(population_.place_of(pixel, e));
    const int s = first_ + e;
    Rgb& result = out_->radiance[output(pixel, s)];
    if (!wants_more(wanted)) {
      result += narrow(member.radiance);
      note_samples(pixel, s, budget_.srl_initial * member.lights, member.lights);
      return;
    }
    mixture_.enter(EstimateStage::Adapt);
    const int in_tile = pixel_in_tile(pixel);
    mixture_.set_up(tile_->point(in_tile, s), tile_->surface(in_tile, s),
                    out_->recorder != nullptr ? out_->recorder->find(in_tile, s) : nullptr);
    count_initial(member);
    const int drawn = count_further(member, wanted);
    StreamKey stream = member.key;
    // Only a sequence can be continued: other sets are stratified over their own number of points.
    const bool continues = settings_.continue_sequence && budget_.sampler == SamplerKind::Sobol;
    if (!continues) stream.iteration = 1;
    mixture_.draw(budget_.sampler, stream, of_components(further_),
                  continues ? of_components(initial_) : std::span<const int>{});
    ++mixture_.counters().iterations;
    note_samples(pixel, s, drawn, member.lights);
    result += narrow(sum_of_all(member));
  }

  static bool wants_more(std::span<const double> samples) noexcept {
    return std::any_of(samples.begin(), samples.end(), [](double n) { return n >= 1.0; });
  }

  // Whole numbers of further samples and of all samples. Rounded down, so that the mean stays
  // within the budget.
  // @return samples of all components
  int count_further(const Population::Member& member, std::span<const double> samples) noexcept {
    double wanted = 0.0;
    for (int k = 0; k < mixture_.cone_component(); ++k) wanted += samples[slot_of(k)];
    const double most = static_cast<double>(most_of_mean_ - 1) * budget_.srl() * member.lights;
    const double scale = wanted > most ? most / wanted : 1.0;
    int total = 0;
    for (int k = 0; k < mixture_.components(); ++k) {
      const auto component = static_cast<std::size_t>(k);
      further_[component] =
          k == mixture_.cone_component() ? 0 : static_cast<int>(samples[slot_of(k)] * scale);
      counts_[component] = initial_[component] + further_[component];
      total += counts_[component];
    }
    return total;
  }

  // The initial samples, weighted anew, and the further ones.
  RgbSum sum_of_all(const Population::Member& member) noexcept {
    const std::span<const int> counts = of_components(counts_);
    RgbSum sum(0.0);
    for (std::size_t i = member.first; i < member.last; ++i) {
      const double w = weight_of(lit_.weight(i, settings_.heuristic, counts));
      sum += widen(lit_[i].f) * w;
      if (EstimateRecord* record = mixture_.record()) {
        record->samples[lit_[i].record_place].weight = w;
      }
    }
    for (std::size_t i = 0; i < mixture_.size(); ++i) {
      if (is_black(mixture_.f(i))) continue;
      MisWeight weight(settings_.heuristic, counts, mixture_.component(i), mixture_.own_pdf(i));
      mixture_.for_each_pdf_w(i, [&](int k, float pdf) { weight.add(k, pdf); });
      const double w = weight_of(weight);
      sum += widen(mixture_.f(i)) * w;
      mixture_.record_weight(i, w);
    }
    return sum;
  }

  void note_samples(int pixel, int s, int samples, int lights) noexcept {
    if (out_->maps.empty()) return;
    out_->maps[output(pixel, s)] =
        static_cast<float>(samples) / static_cast<float>(budget_.srl() * lights);
  }

  Settings settings_;
  Budget budget_;
  std::size_t slots_;  // of lights, and the BSDF
  int group_;          // estimates of a pixel that are made together
  std::size_t most_of_mean_;
  Mixture mixture_;
  Population population_;
  Allocation allocation_;
  LitSamples lit_;  // of the initial populations
  std::vector<std::size_t> slot_of_light_;
  std::vector<int> initial_, further_, counts_;  // [component] of the point at hand
  std::vector<double> sums_, squares_;           // [component]

  // The tile and the block at hand.
  const Tile* tile_{nullptr};
  TileOutput* out_{nullptr};
  std::uint64_t seed_{0};
  int x0_{0}, y0_{0}, first_{0};
};

std::string bias_reason(const ParamSet&) { return {}; }

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
  return std::make_unique<PmcHiPlus>(scene, params, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "pmc_hi_plus",
    .summary = "populations whose variance decides how many samples their neighbours draw",
    .citation = "this project, after Lai et al. 2014; see estimators/README.md",
    .adaptive = true,
    .shares_in_tile = true,
    .min_srl = 2,
    .params = specs,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::pmc_hi_plus
