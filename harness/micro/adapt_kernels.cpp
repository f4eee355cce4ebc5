// The parts of PMC-HI's adaptation on a population with known components: all samples are drawn
// from the lights of a field, so that every one of them is kept.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <limits>
#include <numeric>

#include "estimators/mixture/estimates.h"
#include "estimators/pmc_hi/adaptation.h"
#include "harness/micro/checks.h"
#include "harness/micro/register.h"

namespace penumbra::micro {
namespace {

using pmc_hi::Rounding;

// A population of a mixture with all components at work, as the adaptation finds it.
struct Population {
  Mixture mixture;
  std::vector<double> coefficients;  // [component] c_k of K
  std::vector<double> density;       // [sample] K, with room for a group of lanes more
  std::vector<double> weights;       // [sample] luminance of f/K
  std::vector<Vec3> wi;

  Population(const LightField& field, int samples, std::uint64_t seed)
      : mixture(*field.scene, LightSampling::Area, false, static_cast<std::size_t>(samples)) {
    mixture.set_up(field.point);
    mixture.cone() = {Vec3(0.0f, 0.0f, 1.0f), 0.1f};
    const auto m = static_cast<std::size_t>(mixture.components());
    const int lights = mixture.light_components();
    std::vector<int> counts(m, 0);
    for (int i = 0; i < samples; ++i) ++counts[static_cast<std::size_t>(i % lights)];
    StreamKey key;
    key.seed = seed;
    mixture.draw(SamplerKind::Independent, key, counts);
    coefficients.assign(m, 1.0 / static_cast<double>(m));
    density.resize(mixture.size() + kLaneGroup);
    mixture.mixture_pdfs_w(0, coefficients, density);
    for (std::size_t i = 0; i < mixture.size(); ++i) {
      weights.push_back(luminance(widen(mixture.f(i))) / density[i]);
      wi.push_back(mixture.wi(i));
    }
  }
};

Work per_sample(Suite& suite, int samples) {
  return {"sample", static_cast<double>(samples), &suite.ray_meter()};
}

std::string key_of(const char* kernel, int population, int components) {
  return fmt::format("{}/{}/{}", kernel, population, components);
}

// Weights as after an iteration: no two alike, sum 1, the last is the cone's.
std::vector<double> learned_weights(int components) {
  std::vector<double> alpha(static_cast<std::size_t>(components));
  for (std::size_t k = 0; k < alpha.size(); ++k) alpha[k] = 1.0 + static_cast<double>(k * 7 % 5);
  pmc_hi::normalise(alpha);
  return alpha;
}

std::string rounding_fault(Rounding rounding, std::span<const double> alpha, int total,
                           StreamKey key) {
  constexpr int kDraws = 2000;
  const bool exact = rounding != Rounding::Multinomial;
  std::vector<int> counts(alpha.size());
  std::vector<std::int64_t> sums(alpha.size());
  for (int draw = 0; draw < kDraws; ++draw) {
    key.estimate = static_cast<std::uint32_t>(draw);
    pmc_hi::round_counts(rounding, alpha, total, key, counts);
    const double limit = exact ? 1.0 : std::numeric_limits<double>::infinity();
    const std::string fault = counts_fault(counts, alpha, total, limit);
    if (!fault.empty()) return fault;
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += counts[k];
  }
  // The largest remainder has the same counts in each draw.
  if (rounding == Rounding::LargestRemainder) return {};
  return mean_counts_fault(sums, alpha, total, kDraws);
}

void time_rounding(benchmark::State& state, Suite& suite, Rounding rounding, const char* name,
                   int total, int components) {
  const std::vector<double> alpha = learned_weights(components);
  StreamKey key;
  key.seed = suite.config().seed;
  if (!suite.passes(state, key_of(name, total, components),
                    [&] { return rounding_fault(rounding, alpha, total, key); })) {
    return;
  }
  std::vector<int> counts(alpha.size());
  time_kernel(state,
              {"component", static_cast<double>(components), &suite.ray_meter(),
               static_cast<double>(total)},
              [&] {
                ++key.estimate;
                pmc_hi::round_counts(rounding, alpha, total, key, counts);
                benchmark::DoNotOptimize(counts.data());
                benchmark::ClobberMemory();
              });
}

void time_raise(benchmark::State& state, Suite& suite, int population, int components) {
  // Most components have nothing, as when few lights are seen.
  std::vector<int> before(static_cast<std::size_t>(components), 0);
  const int total = std::max(population, 2 * components);
  before[0] = total / 2;
  before[1] = total - total / 2;
  std::vector<int> counts = before;
  if (!suite.passes(state, key_of("raise", population, components), [&] {
        pmc_hi::raise_to_minimum(counts, 1);
        return raised_fault(before, counts, 1);
      })) {
    return;
  }
  time_kernel(state,
              {"component", static_cast<double>(components), &suite.ray_meter(),
               static_cast<double>(total)},
              [&] {
                std::copy(before.begin(), before.end(), counts.begin());
                pmc_hi::raise_to_minimum(counts, 1);
                benchmark::DoNotOptimize(counts.data());
                benchmark::ClobberMemory();
              });
}

enum class Kernel { TagSums, PosteriorSums, Cone, MixturePdf };

std::string tag_fault(const Population& p) {
  std::vector<double> found(p.coefficients.size(), 0.0);
  pmc_hi::add_tag_sums(p.mixture, 0, p.weights, found);
  // Samples of light k are k, k + lights, ... in the order of the draw: k's come together.
  std::vector<double> expected(found.size(), 0.0);
  const auto lights = static_cast<std::size_t>(p.mixture.light_components());
  std::size_t i = 0;
  for (std::size_t k = 0; k < lights; ++k) {
    const std::size_t n = p.weights.size() / lights + (k < p.weights.size() % lights ? 1 : 0);
    expected[k] = std::accumulate(&p.weights[i], &p.weights[i] + n, 0.0);
    i += n;
  }
  return values_fault("sums of Eq. 6", found, expected, 1e-9);
}

std::string posterior_fault(const Population& p) {
  std::vector<double> found(p.coefficients.size(), 0.0);
  pmc_hi::add_posterior_sums(p.mixture, 0, p.weights, p.coefficients, found);
  std::vector<double> expected(found.size(), 0.0);
  for (std::size_t i = 0; i < p.weights.size(); ++i) {
    double sum = 0.0;
    for (int k = 0; k < p.mixture.components(); ++k) {
      sum += static_cast<double>(p.mixture.pdf_w(i, k));
    }
    for (int k = 0; k < p.mixture.components(); ++k) {
      expected[static_cast<std::size_t>(k)] +=
          p.weights[i] * static_cast<double>(p.mixture.pdf_w(i, k)) / sum;
    }
  }
  const double total = std::accumulate(found.begin(), found.end(), 0.0);
  const double weights = std::accumulate(p.weights.begin(), p.weights.end(), 0.0);
  const std::string fault = values_fault("posterior sums", found, expected, 1e-9, 1e-12 * weights);
  if (!fault.empty()) return fault;
  return values_fault("their total", std::span(&total, 1), std::span(&weights, 1), 1e-9);
}

// The scalar form, component by component.
std::string density_fault(const Population& p) {
  std::vector<double> expected(p.weights.size(), 0.0);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    for (int k = 0; k < p.mixture.components(); ++k) {
      expected[i] +=
          p.coefficients[static_cast<std::size_t>(k)] * static_cast<double>(p.mixture.pdf_w(i, k));
    }
  }
  return values_fault("mixture densities", std::span(p.density).first(expected.size()), expected,
                      1e-9);
}

std::string population_fault(Kernel kernel, const Population& p, int samples) {
  if (p.weights.size() != static_cast<std::size_t>(samples)) {
    return fmt::format("{} of {} samples were kept", p.weights.size(), samples);
  }
  switch (kernel) {
    case Kernel::TagSums:
      return tag_fault(p);
    case Kernel::PosteriorSums:
      return posterior_fault(p);
    case Kernel::Cone:
      return cone_fault(pmc_hi::fit_cone(p.mixture, 0, p.weights, {}), p.wi, p.weights, {});
    case Kernel::MixturePdf:
      return density_fault(p);
  }
  return {};
}

void time_population(benchmark::State& state, Suite& suite, Kernel kernel, const char* name,
                     int samples, int components) {
  Population p(suite.light_field(components - 2), samples, suite.config().seed);
  if (!suite.passes(state, key_of(name, samples, components),
                    [&] { return population_fault(kernel, p, samples); })) {
    return;
  }
  std::vector<double> sums(p.coefficients.size(), 0.0);
  const Work work = per_sample(suite, samples);
  switch (kernel) {
    case Kernel::TagSums:
      return time_kernel(state, work, [&] {
        pmc_hi::add_tag_sums(p.mixture, 0, p.weights, sums);
        benchmark::ClobberMemory();
      });
    case Kernel::PosteriorSums:
      return time_kernel(state, work, [&] {
        pmc_hi::add_posterior_sums(p.mixture, 0, p.weights, p.coefficients, sums);
        benchmark::ClobberMemory();
      });
    case Kernel::Cone:
      return time_kernel(state, work, [&] {
        benchmark::DoNotOptimize(pmc_hi::fit_cone(p.mixture, 0, p.weights, {}));
      });
    case Kernel::MixturePdf:
      return time_kernel(state, work, [&] {
        p.mixture.mixture_pdfs_w(0, p.coefficients, p.density);
        benchmark::ClobberMemory();
      });
  }
}

// One family over the population and one over the components.
template <typename Time>
void register_both(Suite& suite, const std::string& kernel, Time time) {
  const MicroConfig& config = suite.config();
  const int components = config.fixed_components;
  const int population = config.fixed_population;
  register_sizes(suite, fmt::format("adapt/{}/components:{}", kernel, components), "population",
                 config.populations, [=](benchmark::State& state) {
                   time(state, static_cast<int>(state.range(0)), components);
                 });
  register_sizes(suite, fmt::format("adapt/{}/population:{}", kernel, population), "components",
                 config.components, [=](benchmark::State& state) {
                   time(state, population, static_cast<int>(state.range(0)));
                 });
}

}  // namespace

void register_adaptation_kernels(Suite& suite) {
  for (const auto& [rounding, name] :
       {std::pair{Rounding::LargestRemainder, "round_largest_remainder"},
        std::pair{Rounding::Systematic, "round_systematic"},
        std::pair{Rounding::Multinomial, "round_multinomial"}}) {
    register_both(
        suite, name,
        [&suite, rounding = rounding, name = name](benchmark::State& state, int n, int m) {
          time_rounding(state, suite, rounding, name, n, m);
        });
  }
  register_both(suite, "raise_to_minimum", [&suite](benchmark::State& state, int n, int m) {
    time_raise(state, suite, n, m);
  });
  for (const auto& [kernel, name] :
       {std::pair{Kernel::TagSums, "eq6_tag"}, std::pair{Kernel::PosteriorSums, "eq6_posterior"},
        std::pair{Kernel::Cone, "cone_fit"}, std::pair{Kernel::MixturePdf, "mixture_pdf"}}) {
    register_both(suite, name,
                  [&suite, kernel = kernel, name = name](benchmark::State& state, int n, int m) {
                    time_population(state, suite, kernel, name, n, m);
                  });
  }
}

}  // namespace penumbra::micro
