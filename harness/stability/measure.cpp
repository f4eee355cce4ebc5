#include "harness/stability/measure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "harness/clocks.h"
#include "harness/keys.h"
#include "harness/tile.h"

namespace penumbra::stability {
namespace {

Tile tile_of(const StabilityStep& step, int estimates_per_point) {
  Tile tile;
  tile.width = kTileSide;
  tile.height = kTileSide;
  tile.image_width = kTileSide;
  tile.spp = estimates_per_point;
  tile.points = step.points;
  return tile;
}

void note_bad(const Rgb& value, std::uint64_t seed, std::size_t index, int spp,
              Measurement& result) {
  const bool finite = std::isfinite(value.x) && std::isfinite(value.y) && std::isfinite(value.z);
  ++(finite ? result.negative : result.non_finite);
  if (result.first_bad) return;
  const auto per_point = static_cast<std::size_t>(spp);
  result.first_bad = BadSample{seed, static_cast<std::uint32_t>(index / per_point),
                               static_cast<int>(index % per_point), value};
}

/// Mean of the channels over the exact value.
double relative(const Rgb& value, double exact) {
  const double mean =
      (static_cast<double>(value.x) + static_cast<double>(value.y) + static_cast<double>(value.z)) /
      3;
  return exact > 0 ? mean / exact : mean;
}

}  // namespace

Measurement measure(const StabilityStep& step, const Method& method, const Budget& budget,
                    std::uint64_t estimates, const std::string& key) {
  const auto per_point = static_cast<int>(std::clamp<std::uint64_t>(
      estimates / kTilePoints, 1, static_cast<std::uint64_t>(kEstimatesPerPoint)));
  const Tile tile = tile_of(step, per_point);
  const std::uint64_t per_tile = tile.estimate_count();
  const std::uint64_t tiles = (estimates + per_tile - 1) / per_tile;
  const auto estimator = method.entry->create(*step.scene, method.params(step.params), budget);
  std::vector<Rgb> radiance(per_tile);
  Measurement result;
  Welford tile_means;
  for (std::uint64_t t = 0; t < tiles; ++t) {
    const std::uint64_t seed = hash_texts({"stability", key, std::to_string(t)});
    std::fill(radiance.begin(), radiance.end(), Rgb(std::numeric_limits<float>::quiet_NaN()));
    TileOutput out;
    out.radiance = radiance;
    const double before = thread_cpu_s();
    estimator->estimate(tile, seed, out);
    result.cpu_s += thread_cpu_s() - before;
    result.counters += out.counters;
    Welford tile_values;
    for (std::size_t i = 0; i < radiance.size(); ++i) {
      if (is_bad_estimate(*method.entry, radiance[i])) {
        note_bad(radiance[i], seed, i, per_point, result);
        continue;
      }
      const std::size_t point = i / static_cast<std::size_t>(per_point);
      const double value = relative(radiance[i], step.exact[point]);
      result.statistics.add(value);
      tile_values.add(value);
    }
    if (tile_values.count() > 0) tile_means.add(tile_values.mean());
  }
  if (method.entry->shares_in_tile) {
    result.statistics.set_variance_of_tiles(tile_means.variance().value_or(0) *
                                            static_cast<double>(per_tile));
  }
  return result;
}

}  // namespace penumbra::stability
