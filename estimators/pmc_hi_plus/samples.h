#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "estimators/mixture/mixture.h"

/// Samples that brought light, kept until the numbers of all samples of their estimate are known.
namespace penumbra::pmc_hi_plus {

/// How the densities of the components make the weight of a sample.
enum class Heuristic : std::uint8_t { Balance, Power2 };

/// Weight of a sample with n_k samples from density h_k: 1 / sum n_k h_k, or
/// n_own h_own / sum (n_k h_k)^2; the estimate is the sum of weight x f. 0 where no density covers
/// the sample.
class MisWeight {
 public:
  MisWeight(Heuristic heuristic, std::span<const int> counts, int own, float own_pdf) noexcept
      : heuristic_(heuristic),
        counts_(counts),
        own_(counts[static_cast<std::size_t>(own)] * static_cast<double>(own_pdf)) {}

  void add(int component, float pdf_w) noexcept {
    const double density =
        counts_[static_cast<std::size_t>(component)] * static_cast<double>(pdf_w);
    sum_ += density;
    squares_ += density * density;
  }

  double value() const noexcept {
    if (heuristic_ == Heuristic::Balance) return sum_ > 0.0 ? 1.0 / sum_ : 0.0;
    return squares_ > 0.0 ? own_ / squares_ : 0.0;
  }
  /// Share of component `count * pdf_w` in the density.
  double share(double density) const noexcept { return sum_ > 0.0 ? density / sum_ : 0.0; }

 private:
  Heuristic heuristic_;
  std::span<const int> counts_;
  double own_;
  double sum_{0.0}, squares_{0.0};
};

/// The lit samples of many estimates, one estimate after the other.
class LitSamples {
 public:
  struct Sample {
    Rgb f{0.0f};  ///< integrand: arriving radiance x BSDF x cosine
    int component{0};
    float own_pdf{0.0f};  ///< [1/sr]
    std::size_t first_density{0}, last_density{0};
    std::size_t record_place{0};  ///< only with a record
  };

  /// @param samples     most samples at a time
  /// @param components  most components of a mixture
  LitSamples(std::size_t samples, std::size_t components)
      : samples_(samples),
        densities_(std::make_unique_for_overwrite<LightDensity[]>(samples * components)) {}

  void clear() noexcept { count_ = density_count_ = 0; }
  std::size_t size() const noexcept { return count_; }
  const Sample& operator[](std::size_t i) const noexcept { return samples_[i]; }

  /// Appends those samples of a mixture that brought light.
  void add(Mixture& mixture) noexcept {
    for (std::size_t i = 0; i < mixture.size(); ++i) {
      if (is_black(mixture.f(i))) continue;
      Sample& sample = samples_[count_++];
      sample = {mixture.f(i), mixture.component(i), mixture.own_pdf(i), density_count_, 0, 0};
      if (mixture.record() != nullptr) sample.record_place = mixture.record_place(i);
      mixture.for_each_pdf_w(i, [&](int k, float pdf) {
        if (pdf > 0.0f) densities_[density_count_++] = {static_cast<std::uint32_t>(k), pdf};
      });
      sample.last_density = density_count_;
    }
  }

  /// The weight of sample i when n_k samples were drawn from component k.
  MisWeight weight(std::size_t i, Heuristic heuristic, std::span<const int> counts) const noexcept {
    const Sample& s = samples_[i];
    MisWeight weight(heuristic, counts, s.component, s.own_pdf);
    for (std::size_t d = s.first_density; d < s.last_density; ++d) {
      weight.add(static_cast<int>(densities_[d].component), densities_[d].pdf_w);
    }
    return weight;
  }

  /// Density of a component at sample i [1/sr].
  float pdf_w(std::size_t i, int component) const noexcept {
    const Sample& s = samples_[i];
    for (std::size_t d = s.first_density; d < s.last_density; ++d) {
      if (static_cast<int>(densities_[d].component) == component) return densities_[d].pdf_w;
    }
    return 0.0f;
  }

 private:
  std::size_t count_{0}, density_count_{0};
  std::vector<Sample> samples_;
  std::unique_ptr<LightDensity[]> densities_;  // memory is touched as far as it is used
};

}  // namespace penumbra::pmc_hi_plus
