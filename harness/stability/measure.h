#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "estimators/estimator.h"
#include "harness/stability/estimate_statistics.h"
#include "harness/stability/method.h"
#include "harness/stability/stability_case.h"

namespace penumbra::stability {

/// An estimate that is not finite, or negative without leave, with what makes it again.
struct BadSample {
  std::uint64_t seed{0};
  std::uint32_t pixel{0};  ///< of the tile
  int estimate{0};         ///< of the pixel
  Rgb value{0.0f};
};

/// Many estimates of one step by one method.
struct Measurement {
  EstimateStatistics statistics;  ///< relative to the exact value; as they are where that is 0
  EstimateCounters counters;
  std::uint64_t non_finite{0}, negative{0};
  std::optional<BadSample> first_bad;
  double cpu_s{0};  ///< of the estimation alone, of the thread that made it
};

/// Estimates of a tile, in one call of the estimator; fewer where fewer are asked for.
inline constexpr int kEstimatesPerPoint = 16;

/// Makes estimates through the public interface, tile after tile, each with a seed of its own. The
/// result does not depend on the thread or on what was measured before, but for the time.
/// @param estimates  rounded up to whole tiles
/// @param key        names the run: all seeds follow from it
/// @throws InputError when the method's parameters have no meaning for the scene and budget
Measurement measure(const StabilityStep& step, const Method& method, const Budget& budget,
                    std::uint64_t estimates, const std::string& key);

}  // namespace penumbra::stability
