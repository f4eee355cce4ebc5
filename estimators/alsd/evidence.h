#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "estimators/mixture/mixture.h"

/// What the first pass of ALSD learns about one block of pixels. A class of its own, so that tests
/// and microbenchmarks reach it.
namespace penumbra::alsd {

/// How the parts of the second pass's probabilities are weighted.
struct EvidenceWeights {
  double uniform{0.2};  ///< w_u, in [0, 1]
  double kappa{64.0};   ///< samples at which pixel and block weigh the same
};

/// Contributions of every light to every pixel of a block, and the probabilities that follow.
class Evidence {
 public:
  /// @param lights  of the scene
  /// @param pixels  largest number in a block
  Evidence(std::size_t lights, std::size_t pixels, const EvidenceWeights& weights);

  /// Forgets everything; for a new block.
  void clear() noexcept;

  /// Adds what an estimate of the first pass has learned: the luminance that each light has
  /// contributed to it, and its samples.
  /// @param mixture   with the samples of the estimate
  /// @param expected  [active light] n P_l
  void add_estimate(int pixel, const Mixture& mixture, std::span<const double> expected,
                    int samples) noexcept;

  /// Adds to the luminance that a light has contributed to a pixel's estimates.
  void add(int pixel, std::size_t light, double contribution) noexcept {
    pixel_[static_cast<std::size_t>(pixel) * lights_ + light] += contribution;
  }
  /// Adds to the samples that the pixel's evidence rests on.
  void add_samples(int pixel, int count) noexcept {
    samples_[static_cast<std::size_t>(pixel)] += count;
  }

  /// Sums the pixels up; between the passes.
  void finish() noexcept;

  /// Probabilities of the second pass in a pixel.
  /// @param pmf  result [light], sum 1
  void probabilities(int pixel, std::span<double> pmf) const noexcept;

 private:
  std::size_t lights_;
  EvidenceWeights weights_;
  std::vector<double> pixel_;    // [pixel][light]
  std::vector<double> block_;    // [light]
  std::vector<double> samples_;  // [pixel]
};

}  // namespace penumbra::alsd
