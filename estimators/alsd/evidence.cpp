#include "estimators/alsd/evidence.h"

#include <algorithm>
#include <numeric>

namespace penumbra::alsd {

Evidence::Evidence(std::size_t lights, std::size_t pixels, const EvidenceWeights& weights)
    : lights_(lights),
      weights_(weights),
      pixel_(lights * pixels),
      block_(lights),
      samples_(pixels) {}

void Evidence::clear() noexcept {
  std::fill(pixel_.begin(), pixel_.end(), 0.0);
  std::fill(block_.begin(), block_.end(), 0.0);
  std::fill(samples_.begin(), samples_.end(), 0.0);
}

void Evidence::add_estimate(int pixel, const Mixture& mixture, std::span<const double> expected,
                            int samples) noexcept {
  for (std::size_t i = 0; i < mixture.size(); ++i) {
    if (is_black(mixture.f(i))) continue;
    const int component = mixture.component(i);
    const double density =
        expected[static_cast<std::size_t>(component)] * static_cast<double>(mixture.own_pdf(i));
    if (density > 0.0) {
      add(pixel, mixture.light_index(component), luminance(widen(mixture.f(i))) / density);
    }
  }
  add_samples(pixel, samples);
}

void Evidence::finish() noexcept {
  for (std::size_t i = 0; i < pixel_.size(); ++i) block_[i % lights_] += pixel_[i];
}

void Evidence::probabilities(int pixel, std::span<double> pmf) const noexcept {
  const auto p = static_cast<std::size_t>(pixel);
  const std::span<const double> own = std::span(pixel_).subspan(p * lights_, lights_);
  const double own_sum = std::accumulate(own.begin(), own.end(), 0.0);
  const double block_sum = std::accumulate(block_.begin(), block_.end(), 0.0);
  if (!(block_sum > 0.0)) {
    std::fill(pmf.begin(), pmf.end(), 1.0 / static_cast<double>(lights_));
    return;
  }
  const double learned = 1.0 - weights_.uniform;
  // A pixel without light gives its weight to the block. samples_ > 0 where own_sum is.
  const double own_weight =
      own_sum > 0.0 ? learned * samples_[p] / (samples_[p] + weights_.kappa) : 0.0;
  const double own_scale = own_sum > 0.0 ? own_weight / own_sum : 0.0;
  const double block_scale = (learned - own_weight) / block_sum;
  const double uniform = weights_.uniform / static_cast<double>(lights_);
  for (std::size_t l = 0; l < lights_; ++l) {
    pmf[l] = uniform + block_scale * block_[l] + own_scale * own[l];
  }
}

}  // namespace penumbra::alsd
