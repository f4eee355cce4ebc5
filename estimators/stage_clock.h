#pragma once

#include <array>
#include <cstdint>

#if defined(__x86_64__)
#include <x86intrin.h>
#else
#include <chrono>
#endif

/// Tells where the time of estimates goes, for `penumbra inspect` and the report. Estimators only
/// say what they turn to; results do not change by it, and no estimator reads it.
namespace penumbra {

enum class EstimateStage : std::uint8_t {
  Outside,  ///< not estimating
  SetUp,    ///< lights, BSDF and frame at a point, and light without extent
  Sample,   ///< directions, f, and the densities of the components
  Trace,    ///< ray queries
  Weigh,    ///< densities of the mixture, weights, sums
  Adapt,    ///< learning from samples, and choosing counts by what was learned
};
inline constexpr std::size_t kStages = 6;

/// For one thread.
class StageClock {
 public:
  /// Counts the time since the last change for the stage that ends, and one change for the stage
  /// that begins.
  void enter(EstimateStage stage) noexcept {
    const std::uint64_t now = ticks();
    ticks_[static_cast<std::size_t>(current_)] += now - since_;
    ++changes_[static_cast<std::size_t>(stage)];
    current_ = stage;
    since_ = now;
  }

  /// [EstimateStage], in ticks of no particular length.
  const std::array<std::uint64_t, kStages>& spent() const noexcept { return ticks_; }
  /// [EstimateStage], times that it was entered.
  const std::array<std::uint64_t, kStages>& entered() const noexcept { return changes_; }

 private:
  // The processor's counter: half the cost of the system's clock.
  static std::uint64_t ticks() noexcept {
#if defined(__x86_64__)
    return __rdtsc();
#else
    return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
  }

  std::uint64_t since_{ticks()};
  EstimateStage current_{EstimateStage::Outside};
  std::array<std::uint64_t, kStages> ticks_{};
  std::array<std::uint64_t, kStages> changes_{};
};

/// Says that a stage begins where someone listens.
inline void enter_stage(StageClock* clock, EstimateStage stage) noexcept {
  if (clock != nullptr) clock->enter(stage);
}

}  // namespace penumbra
