#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimators/mixture/mixture.h"
#include "estimators/pmc_hi/settings.h"
#include "scenes/core/sampler.h"

namespace penumbra::pmc_hi {

/// The adaptive mixture K of one estimate (eq. 4): its weights and counts, and how they and the
/// cone are learned from a population. Component arrays are ordered as in Mixture: lights, BSDF,
/// cone (last).
class Kernel {
 public:
  /// @param max_components  of any point of the scene
  Kernel(const Settings& settings, std::size_t max_components);

  /// Weights and counts of the initial iteration, without a cone.
  /// @param samples     of the iteration
  /// @param learn_cone  whether later iterations of this estimate have one
  void start(const Mixture& mixture, const StreamKey& key, int samples, bool learn_cone) noexcept;

  /// Counts of an adaptive iteration from the weights learned before.
  void next(const StreamKey& key, int samples) noexcept;

  /// Learns weights and cone from samples [first, mixture.size()).
  /// @param weights  luminance of f/K of those samples
  void learn(Mixture& mixture, std::size_t first, std::span<const double> weights) noexcept;

  /// Weights alpha_k of the iteration at hand.
  std::span<const double> alpha() const noexcept { return std::span(alpha_).first(m_); }
  /// Weights as learned, before floors; what the paper's figure 2b shows.
  std::span<const double> learned() const noexcept { return std::span(learned_).first(m_); }
  std::span<const int> counts() const noexcept { return std::span(counts_).first(m_); }
  /// c_k of the iteration's density K = sum_k c_k h_k.
  std::span<const double> coefficients() const noexcept {
    return std::span(coefficients_).first(m_);
  }

 private:
  void set_coefficients(int samples) noexcept;
  void forget_cone(Mixture& mixture) noexcept;

  const Settings* settings_;
  std::size_t m_{0};
  bool learn_cone_{true};
  bool has_cone_{false};
  std::vector<double> alpha_;
  std::vector<double> learned_;
  std::vector<double> evidence_;  // numerators of Eq. 6 over all iterations, for that memory only
  std::vector<int> counts_;
  std::vector<double> coefficients_;
};

}  // namespace penumbra::pmc_hi
