#include "estimators/pmc_hi/combine.h"

#include <algorithm>
#include <cmath>

namespace penumbra::pmc_hi {
namespace {

std::size_t end_of(const Mixture& mixture, std::span<const Iteration> iterations, std::size_t t) {
  return t + 1 < iterations.size() ? iterations[t + 1].first : mixture.size();
}

// Iterations with fixed factors: unbiased when each of them is, given the ones before.
template <typename Factor>
RgbSum with_fixed_factors(Mixture& mixture, std::span<const Iteration> iterations,
                          Factor factor) noexcept {
  RgbSum sum(0.0);
  double total = 0.0;
  for (std::size_t t = 0; t < iterations.size(); ++t) {
    sum += iterations[t].sum * factor(t);
    total += factor(t) * iterations[t].n;
  }
  for (std::size_t t = 0; mixture.record() != nullptr && t < iterations.size(); ++t) {
    mixture.scale_recorded_weights(iterations[t].first, end_of(mixture, iterations, t),
                                   factor(t) / total);
  }
  return sum / total;
}

double variance(const Iteration& it) noexcept {
  const double mean = luminance(it.sum) / it.n;
  return std::max(it.square_sum / it.n - mean * mean, 0.0) / it.n;
}

// Iterations weighted by the inverse of their own sample variances: the negative control, biased.
// A variance far below the largest (no sample hit) is held at a thousandth of it, or the weight
// would be infinite.
RgbSum inverse_variance(Mixture& mixture, std::span<const Iteration> iterations) noexcept {
  double largest = 0.0;
  for (const Iteration& it : iterations) largest = std::max(largest, variance(it));
  return with_fixed_factors(mixture, iterations, [&](std::size_t t) {
    const Iteration& it = iterations[t];
    return (largest > 0.0 ? 1.0 / std::max(variance(it), 1e-3 * largest) : 1.0) / it.n;
  });
}

// Every sample over the mixture of all iterations' kernels (AMIS): the other negative control,
// biased. Source: Cornuet, Marin, Mira and Robert 2012, "Adaptive multiple importance sampling".
RgbSum pooled(Mixture& mixture, std::span<const Iteration> iterations,
              std::span<const double> coefficients, std::size_t stride) noexcept {
  const int cone = mixture.cone_component();
  RgbSum sum(0.0);
  for (std::size_t i = 0; i < mixture.size(); ++i) {
    if (is_black(mixture.f(i))) continue;
    double k = 0.0;
    for (std::size_t t = 0; t < iterations.size(); ++t) {
      const Iteration& it = iterations[t];
      const std::span<const double> c = coefficients.subspan(t * stride, stride);
      for (int q = 0; q < cone; ++q) {
        k += it.n * c[static_cast<std::size_t>(q)] * static_cast<double>(mixture.pdf_w(i, q));
      }
      // The cone moved between iterations; a sample's own cone holds it by construction.
      const bool own =
          mixture.component(i) == cone && i >= it.first && i < end_of(mixture, iterations, t);
      k += it.n * c[static_cast<std::size_t>(cone)] *
           static_cast<double>(own ? mixture.own_pdf(i) : it.cone.pdf_w(mixture.wi(i)));
    }
    if (!(k > 0.0)) continue;
    mixture.record_weight(i, 1.0 / k);
    sum += widen(mixture.f(i)) / k;
  }
  return sum;
}

}  // namespace

RgbSum combine(Combine rule, Mixture& mixture, std::span<const Iteration> iterations,
               std::span<const double> coefficients, std::size_t stride) noexcept {
  const std::size_t last = iterations.size() - 1;
  switch (rule) {
    case Combine::Average:
      return with_fixed_factors(mixture, iterations, [](std::size_t) { return 1.0; });
    case Combine::Sqrt:
      return with_fixed_factors(mixture, iterations, [](std::size_t t) {
        return std::sqrt(static_cast<double>(t) + 1.0);
      });
    case Combine::Last:
      return with_fixed_factors(mixture, iterations,
                                [&](std::size_t t) { return t == last ? 1.0 : 0.0; });
    case Combine::AdaptiveOnly:
      return with_fixed_factors(mixture, iterations,
                                [&](std::size_t t) { return t > 0 || last == 0 ? 1.0 : 0.0; });
    case Combine::InverseVariance:
      return inverse_variance(mixture, iterations);
    case Combine::Pooled:
      break;
  }
  return pooled(mixture, iterations, coefficients, stride);
}

}  // namespace penumbra::pmc_hi
