#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "estimators/estimator.h"
#include "estimators/restir_di/light_points.h"

/// Reservoirs of light points: how a pixel fills its own, and what it takes over from others.
namespace penumbra::restir_di {

inline constexpr int kMostCandidates = static_cast<int>(kBlock);
inline constexpr int kMostNeighbours = 8;

/// One light point that stands for all candidates of a pixel.
struct Reservoir {
  LightPoint at;
  double target{0.0};  ///< t_i(y_i) of the pixel i that chose it
  double weight{0.0};  ///< W_i: E[W_i g(y_i)] is the integral of g where t_i > 0; 0: empty
};

/// A pixel with the estimate at hand.
struct Pixel {
  explicit Pixel(const Scene& scene) : receiver(scene) {}

  Receiver receiver;
  std::uint32_t repetitions{0};  ///< reservoirs and rays of the estimate; 0: nothing to draw
  StreamKey key;                 ///< seed, pixel and estimate
  Reservoir own;                 ///< of the repetition at hand
  RgbSum sum{0.0};               ///< of the estimates of its repetitions
  EstimateRecord* record{nullptr};
};

/// The light point that a pixel traces a ray to.
struct Choice {
  LightPoint at;
  Connection connection;  ///< with the pixel
  double weight{0.0};     ///< the estimate is f x geometry x visibility x weight
};

struct ResamplingSettings {
  std::uint32_t candidates{8};
  std::uint32_t neighbours{3};
  bool one_over_m{false};  ///< every member counts the same, for whatever point
};

/// Equations at the top of restir_di.cpp. Holds scratch memory; one per thread.
class Reservoirs {
 public:
  Reservoirs(const Scene& scene, SamplerKind sampler, const ResamplingSettings& settings)
      : scene_(&scene), sampler_(sampler), settings_(settings), lights_(scene) {}

  /// Fills the pixel's own reservoir for repetition r; empty where no candidate can contribute.
  void fill(Pixel& pixel, std::uint32_t r) noexcept;

  /// Chooses among the reservoirs of a neighbourhood.
  /// @param members  the pixel itself, then its neighbours; all filled for repetition r
  /// @return nullopt where nothing on offer can contribute: the estimate is 0
  std::optional<Choice> choose(std::span<Pixel* const> members, std::uint32_t r) noexcept;

  /// Random numbers of a pixel's decisions in a repetition: point 0 for the choices, one more for
  /// the place of each neighbour.
  PointSet decisions(const Pixel& pixel, std::uint32_t r) const noexcept;

 private:
  StreamKey stream(const Pixel& pixel, std::uint32_t purpose,
                   std::uint32_t iteration) const noexcept;
  Connection connect(const Pixel& pixel, const LightPoint& at) const noexcept {
    return pixel.receiver.connect(scene_->lights()[at.light], at);
  }
  double share(std::span<Pixel* const> members, std::size_t s, double target_here) const noexcept;

  const Scene* scene_;
  SamplerKind sampler_;
  ResamplingSettings settings_;
  LightPoints lights_;
  VariateBlock places_, choices_;  // of the candidates
  std::array<Reservoir, kMostCandidates> candidate_;
  std::array<double, kMostCandidates> cumulative_{};
  std::array<Connection, kMostNeighbours + 1> connection_;
};

}  // namespace penumbra::restir_di
