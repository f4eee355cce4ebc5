// What ALSD's two passes cost beside their samples, over the number of lights.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>

#include "estimators/alsd/evidence.h"
#include "estimators/mixture/estimates.h"
#include "harness/micro/checks.h"
#include "harness/micro/register.h"

namespace penumbra::micro {
namespace {

constexpr int kPixels = 64;

// One estimate of the first pass in a field of lights.
struct FirstEstimate {
  Mixture mixture;
  std::vector<double> expected;  // [component] n P_l
  int samples;

  FirstEstimate(const LightField& field, int srl, std::uint64_t seed)
      : mixture(*field.scene, LightSampling::Area, false,
                most_samples(*field.scene, {SamplerKind::Independent, srl, 0}), Densities::Own) {
    mixture.set_up(field.point);
    const auto lights = static_cast<std::size_t>(mixture.active_lights());
    const std::vector<double> equal(lights, 1.0 / static_cast<double>(lights));
    std::vector<int> counts(lights + 2);
    expected.resize(lights + 2);
    StreamKey key;
    key.seed = seed;
    chosen_lights_estimate(mixture, {SamplerKind::Independent, srl, 0}, key, equal, counts,
                           expected);
    samples = srl * mixture.active_lights();
  }

  // What each light has brought, from the samples one by one.
  std::vector<double> contributions() const {
    std::vector<double> sums(expected.size() - 2, 0.0);
    for (std::size_t i = 0; i < mixture.size(); ++i) {
      const auto k = static_cast<std::size_t>(mixture.component(i));
      sums[k] +=
          luminance(widen(mixture.f(i))) / (expected[k] * static_cast<double>(mixture.own_pdf(i)));
    }
    return sums;
  }
};

std::string evidence_fault(const FirstEstimate& estimate) {
  const std::vector<double> own = estimate.contributions();
  alsd::Evidence evidence(own.size(), 2, {});
  evidence.add_estimate(0, estimate.mixture, estimate.expected, estimate.samples);
  evidence.add(1, 0, own[0]);
  evidence.finish();
  std::vector<double> block = own;
  block[0] += own[0];
  std::vector<double> pmf(own.size());
  evidence.probabilities(0, pmf);
  const alsd::EvidenceWeights weights;
  return probabilities_fault(pmf, own, block, estimate.samples, weights.uniform, weights.kappa);
}

void time_evidence(benchmark::State& state, Suite& suite) {
  const int lights = static_cast<int>(state.range(0));
  const FirstEstimate estimate(suite.light_field(lights), suite.config().alsd_srl,
                               suite.config().seed);
  if (!suite.passes(state, fmt::format("evidence/{}", lights),
                    [&] { return evidence_fault(estimate); })) {
    return;
  }
  alsd::Evidence evidence(static_cast<std::size_t>(lights), kPixels, {});
  int pixel = 0;
  time_kernel(state, {"sample", static_cast<double>(estimate.samples), &suite.ray_meter()}, [&] {
    evidence.add_estimate(pixel, estimate.mixture, estimate.expected, estimate.samples);
    pixel = (pixel + 1) % kPixels;
    benchmark::ClobberMemory();
  });
}

// A block's sums and the probabilities of all its pixels.
void time_probabilities(benchmark::State& state, Suite& suite) {
  const int lights = static_cast<int>(state.range(0));
  const FirstEstimate estimate(suite.light_field(lights), suite.config().alsd_srl,
                               suite.config().seed);
  alsd::Evidence evidence(static_cast<std::size_t>(lights), kPixels, {});
  for (int pixel = 0; pixel < kPixels; ++pixel) {
    evidence.add_estimate(pixel, estimate.mixture, estimate.expected, estimate.samples);
  }
  evidence.finish();
  std::vector<double> pmf(static_cast<std::size_t>(lights));
  if (!suite.passes(state, fmt::format("probabilities/{}", lights), [&] {
        evidence.probabilities(kPixels - 1, pmf);
        const std::vector<double> own = estimate.contributions();
        const alsd::EvidenceWeights w;
        return probabilities_fault(pmf, own, own, estimate.samples, w.uniform, w.kappa);
      })) {
    return;
  }
  time_kernel(state,
              {"light", static_cast<double>(lights) * kPixels, &suite.ray_meter(),
               static_cast<double>(estimate.samples) * kPixels},
              [&] {
                evidence.finish();
                for (int pixel = 0; pixel < kPixels; ++pixel) {
                  evidence.probabilities(pixel, pmf);
                  benchmark::DoNotOptimize(pmf.data());
                }
                benchmark::ClobberMemory();
              });
}

void time_draw(benchmark::State& state, Suite& suite) {
  const auto lights = static_cast<std::size_t>(state.range(0));
  const int total = suite.config().alsd_srl * static_cast<int>(lights);
  std::vector<double> pmf(lights);
  double sum = 0.0;
  for (std::size_t l = 0; l < lights; ++l) sum += pmf[l] = 1.0 + static_cast<double>(l * 7 % 5);
  for (double& p : pmf) p /= sum;
  std::vector<int> counts(lights);
  constexpr int kDraws = 1024;
  // Offsets in equal steps: the sums of the counts are then exact but for their rounding.
  if (!suite.passes(state, fmt::format("draw/{}", lights), [&]() -> std::string {
        std::vector<std::int64_t> sums(lights, 0);
        for (int draw = 0; draw < kDraws; ++draw) {
          systematic_counts(pmf, total, (draw + 0.5) / kDraws, counts);
          const std::string fault = counts_fault(counts, pmf, total, 1.0);
          if (!fault.empty()) return fault;
          for (std::size_t l = 0; l < lights; ++l) sums[l] += counts[l];
        }
        return mean_counts_fault(sums, pmf, total, kDraws);
      })) {
    return;
  }
  int draw = 0;
  time_kernel(
      state, {"light", static_cast<double>(lights), &suite.ray_meter(), static_cast<double>(total)},
      [&] {
        draw = (draw + 1) % kDraws;
        systematic_counts(pmf, total, static_cast<double>(draw) / kDraws, counts);
        benchmark::DoNotOptimize(counts.data());
        benchmark::ClobberMemory();
      });
}

}  // namespace

void register_alsd_kernels(Suite& suite) {
  const std::vector<int>& lights = suite.config().alsd_lights;
  register_sizes(suite, "alsd/evidence", "lights", lights,
                 [&suite](benchmark::State& state) { time_evidence(state, suite); });
  register_sizes(suite, "alsd/probabilities", "lights", lights,
                 [&suite](benchmark::State& state) { time_probabilities(state, suite); });
  register_sizes(suite, "alsd/draw", "lights", lights,
                 [&suite](benchmark::State& state) { time_draw(state, suite); });
}

}  // namespace penumbra::micro
