#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <memory>

#include "estimators/alsd/evidence.h"
#include "estimators/mixture/estimates.h"
#include "estimators/pmc_hi/combine.h"
#include "estimators/pmc_hi/kernel.h"
#include "harness/micro/checks.h"
#include "harness/micro/register.h"
#include "scenes/core/error.h"

namespace penumbra::micro {
namespace {

constexpr std::uint64_t kSeed = 7;

// Times whole estimates of a tile and their adaptation alone in turns, and prints the share of the
// second in the first: both are hit alike by whatever else the machine does.
template <typename Adapt>
void share_of_estimates(benchmark::State& state, Estimator& estimator, const Tile& tile,
                        std::size_t adapted_estimates, Adapt adapt) {
  std::vector<Rgb> radiance(tile.estimate_count());
  double whole_s = 0.0;
  double adapt_s = 0.0;
  for (auto _ : state) {
    const double start = thread_cpu_s();
    TileOutput out;
    out.radiance = radiance;
    estimator.estimate(tile, kSeed, out);
    const double middle = thread_cpu_s();
    adapt();
    const double end = thread_cpu_s();
    whole_s += middle - start;
    adapt_s += end - middle;
    state.SetIterationTime(end - start);
  }
  const auto rounds = static_cast<double>(state.iterations());
  const double whole = whole_s / rounds / static_cast<double>(tile.estimate_count());
  const double adaptation = adapt_s / rounds / static_cast<double>(adapted_estimates);
  state.counters["estimate_ns"] = 1e9 * whole;
  state.counters["adapt_ns"] = 1e9 * adaptation;
  state.counters["share_percent"] = 100.0 * adaptation / whole;
}

// The populations of one estimate of pmc_hi, kept so that they can be learned from again.
class PmcHiEstimate {
 public:
  PmcHiEstimate(const Scene& scene, const pmc_hi::Settings& settings, const Budget& budget,
                const ShadingPoint& point, const StreamKey& key)
      : settings_(settings),
        key_(key),
        mixture_(scene, settings.light_sampling, settings.lights_as_one,
                 most_samples(scene, budget)),
        kernel_(settings, scene.lights().size() + 2),
        weights_(most_samples(scene, budget)) {
    mixture_.set_up(point);
    const int lights = mixture_.active_lights();
    // The default schedule: populations of twice the components.
    const int populations = std::max(1, budget.srl_adaptive * lights / (2 * mixture_.components()));
    iterations_.resize(static_cast<std::size_t>(populations) + 1);
    for (std::size_t t = 0; t < iterations_.size(); ++t) {
      const int rays = (t == 0 ? budget.srl_initial : budget.srl_adaptive) * lights;
      const int rest = rays % populations;
      iterations_[t].n = t == 0 ? rays : rays / populations + (static_cast<int>(t) <= rest ? 1 : 0);
      draw(t, budget.sampler);
      if (t + 1 < iterations_.size()) learn(t);
    }
  }

  // Everything but drawing, tracing and weighting the samples.
  RgbSum adapt() {
    for (std::size_t t = 0; t < iterations_.size(); ++t) {
      begin(t);
      if (t + 1 < iterations_.size()) learn(t);
    }
    return combine(settings_.combine, mixture_, iterations_, {}, 0);
  }

 private:
  void begin(std::size_t t) {
    key_.iteration = static_cast<std::uint32_t>(t);
    if (t == 0) {
      kernel_.start(mixture_, key_, iterations_[t].n, true);
    } else {
      kernel_.next(key_, iterations_[t].n);
    }
  }

  void draw(std::size_t t, SamplerKind sampler) {
    begin(t);
    pmc_hi::Iteration& it = iterations_[t];
    it.first = mixture_.size();
    mixture_.draw(sampler, key_, kernel_.counts());
    std::vector<double> density(mixture_.size() - it.first + kLaneGroup);
    mixture_.mixture_pdfs_w(it.first, kernel_.coefficients(), density);
    for (std::size_t i = it.first; i < mixture_.size(); ++i) {
      weights_[i] = 0.0;
      if (is_black(mixture_.f(i))) continue;
      const RgbSum weight = widen(mixture_.f(i)) * (1.0 / density[i - it.first]);
      weights_[i] = luminance(weight);
      it.sum += weight;
    }
  }

  void learn(std::size_t t) {
    const std::size_t first = iterations_[t].first;
    const std::size_t end = t + 1 < iterations_.size() && iterations_[t + 1].first > first
                                ? iterations_[t + 1].first
                                : mixture_.size();
    kernel_.learn(mixture_, first, std::span(weights_).subspan(first, end - first));
  }

  const pmc_hi::Settings& settings_;
  StreamKey key_;
  Mixture mixture_;
  pmc_hi::Kernel kernel_;
  std::vector<double> weights_;
  std::vector<pmc_hi::Iteration> iterations_;
};

// With the cone at every point, which is the most that there can be to adapt.
ParamSet pmc_hi_params() {
  std::vector<ParamProblem> problems;
  ParamSet params = resolve_params(find_estimator("pmc_hi")->params(),
                                   {{"cone", std::string("always")}}, problems);
  PN_CHECK(problems.empty(), "the parameter exists");
  return params;
}

// Counts, Eq. 6, cone and combination, as a share of pmc_hi's estimates.
void adapt_pmc_hi(benchmark::State& state, Suite& suite, const BenchTile& tile,
                  const Budget& budget) {
  const EstimatorEntry& entry = *find_estimator("pmc_hi");
  const ParamSet params = pmc_hi_params();
  const pmc_hi::Settings settings = pmc_hi::read_settings(params);
  const std::unique_ptr<Estimator> estimator = entry.create(*tile.scene, params, budget);
  const Tile job = tile.tile(1);
  std::vector<Rgb> radiance(job.estimate_count());
  TileOutput out;
  out.radiance = radiance;
  estimator->estimate(job, kSeed, out);
  std::vector<std::unique_ptr<PmcHiEstimate>> estimates;
  std::vector<double> found, expected;
  for (std::size_t i = 0; i < tile.points.size(); ++i) {
    StreamKey key;
    key.seed = kSeed;
    key.pixel = job.pixel_index(static_cast<int>(i));
    estimates.push_back(
        std::make_unique<PmcHiEstimate>(*tile.scene, settings, budget, tile.points[i], key));
    found.push_back(luminance(estimates.back()->adapt()));
    expected.push_back(static_cast<double>(luminance(radiance[i])));
  }
  // To rounding: the estimator may sum in another order.
  const std::string key = fmt::format("adapt_pmc_hi/{}", budget.srl());
  if (!suite.passes(state, key, [&] {
        return values_fault("estimates kept and made", found, expected, 1e-4, 1e-7);
      })) {
    return;
  }
  share_of_estimates(state, *estimator, job, estimates.size(), [&] {
    for (const auto& estimate : estimates) benchmark::DoNotOptimize(estimate->adapt());
  });
}

// Evidence, probabilities and choice of lights, as a share of alsd's estimates.
void adapt_alsd(benchmark::State& state, const BenchTile& tile, int srl) {
  constexpr int kSpp = 8;
  constexpr int kFirstPass = kSpp / 2;
  const EstimatorEntry& entry = *find_estimator("alsd");
  const Budget budget{SamplerKind::Independent, srl, 0};
  const std::unique_ptr<Estimator> estimator =
      entry.create(*tile.scene, default_params(entry), budget);
  const std::size_t lights = tile.scene->lights().size();
  const Tile job = tile.tile(kSpp);
  std::vector<std::unique_ptr<Mixture>> mixtures;
  std::vector<std::vector<double>> expected;
  std::vector<int> counts(lights + 2);
  for (std::size_t i = 0; i < tile.points.size(); ++i) {
    Mixture& mixture = *mixtures.emplace_back(
        std::make_unique<Mixture>(*tile.scene, LightSampling::Area, false,
                                  most_samples(*tile.scene, budget), Densities::Own));
    mixture.set_up(tile.points[i]);
    const auto active = static_cast<std::size_t>(mixture.active_lights());
    const std::vector<double> equal(active, 1.0 / static_cast<double>(active));
    StreamKey key;
    key.seed = kSeed;
    key.pixel = static_cast<std::uint32_t>(i);
    expected.emplace_back(lights + 2);
    chosen_lights_estimate(mixture, budget, key, equal, counts, expected.back());
  }
  alsd::Evidence evidence(lights, BenchTile::kPoints, {});
  std::vector<double> pmf(lights);
  share_of_estimates(state, *estimator, job, job.estimate_count(), [&] {
    evidence.clear();
    for (std::size_t i = 0; i < mixtures.size(); ++i) {
      for (int s = 0; s < kFirstPass; ++s) {
        evidence.add_estimate(static_cast<int>(i), *mixtures[i], expected[i],
                              srl * static_cast<int>(lights));
      }
    }
    evidence.finish();
    for (std::size_t i = 0; i < mixtures.size(); ++i) {
      evidence.probabilities(static_cast<int>(i), pmf);
      for (int s = 0; s < kSpp; ++s) {
        StreamKey key;
        key.pixel = static_cast<std::uint32_t>(i);
        key.estimate = static_cast<std::uint32_t>(s);
        const double offset = static_cast<double>(random_bits(key)) * 0x1p-32;
        systematic_counts(pmf, srl * static_cast<int>(lights), offset,
                          std::span(counts).first(lights));
        benchmark::DoNotOptimize(counts.data());
      }
    }
  });
}

}  // namespace

void register_adaptation_shares(Suite& suite) {
  const std::string& scene = suite.config().scenes.front();
  for (const int srl : suite.config().estimate_srl) {
    const Budget budget = budget_of(*find_estimator("pmc_hi"), srl);
    benchmark::RegisterBenchmark(
        fmt::format("adapt/pmc_hi/{}/srl:{}-{}", scene, budget.srl_initial, budget.srl_adaptive)
            .c_str(),
        [&suite, scene, budget](benchmark::State& state) {
          adapt_pmc_hi(state, suite, suite.tile(scene), budget);
        })
        ->UseManualTime();
    benchmark::RegisterBenchmark(fmt::format("adapt/alsd/{}/srl:{}", scene, srl).c_str(),
                                 [&suite, scene, srl](benchmark::State& state) {
                                   adapt_alsd(state, suite.tile(scene), srl);
                                 })
        ->UseManualTime();
  }
}

}  // namespace penumbra::micro
