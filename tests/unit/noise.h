#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string_view>

/// Random numbers of simulations.
namespace penumbra {

/// The seed is the FNV-1a hash of the test's name, so that tests do not share a stream.
class Noise {
 public:
  explicit Noise(std::string_view test) : engine_(hash(test)) {}

  double gaussian() {  // Box and Muller
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

  /// Mean 1, relative standard deviation sqrt(2 / degrees): the law of a mean squared error that
  /// `degrees` pixels decide.
  double mean_square(int degrees) {
    double sum = 0;
    for (int i = 0; i < degrees; ++i) {
      const double z = gaussian();
      sum += z * z;
    }
    return sum / degrees;
  }

 private:
  static std::uint64_t hash(std::string_view text) {
    std::uint64_t h = 14695981039346656037ULL;
    for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
    return h;
  }
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

  std::mt19937_64 engine_;
};

/// Whether a share of successes agrees with its nominal value: within 3.29 binomial standard
/// errors, a false-alarm level of 1e-3.
inline bool is_nominal(int hits, int trials, double nominal) {
  const double share = static_cast<double>(hits) / trials;
  return std::abs(share - nominal) <= 3.29 * std::sqrt(nominal * (1 - nominal) / trials);
}

}  // namespace penumbra
