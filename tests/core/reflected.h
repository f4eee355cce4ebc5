#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "estimators/estimator.h"
#include "tests/support/fixtures.h"
#include "tests/support/statistics_support.h"

/// Reflected radiance at given points, by any estimator with its default parameters.
namespace penumbra::test {

struct Reflected {
  double mean{0}, standard_error{0};  ///< of the red channel
  float largest{0};                   ///< single estimate, any channel
};

/// @param estimates  per point, of one shadow ray per light each where the estimator allows it
inline std::vector<Reflected> reflect(const Scene& scene, const std::vector<ShadingPoint>& points,
                                      std::string_view estimator, int estimates) {
  const EstimatorEntry& entry = *find_estimator(estimator);
  Tile tile;
  tile.width = static_cast<int>(points.size());
  tile.height = 1;
  tile.image_width = tile.width;
  tile.spp = estimates;
  tile.points = points;
  std::vector<Rgb> radiance(tile.estimate_count());
  TileOutput out;
  out.radiance = radiance;
  Budget budget;
  budget.srl_initial = entry.min_srl;
  entry.create(scene, fixtures::params_with(entry, {}), budget)->estimate(tile, test_seed(), out);
  std::vector<Reflected> result(points.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    Moments moments;
    for (int e = 0; e < estimates; ++e) {
      const Rgb& value =
          radiance[p * static_cast<std::size_t>(estimates) + static_cast<std::size_t>(e)];
      moments.add(static_cast<double>(value.x));
      result[p].largest = std::max({result[p].largest, value.x, value.y, value.z});
    }
    result[p].mean = moments.mean();
    result[p].standard_error = moments.standard_error();
  }
  return result;
}

}  // namespace penumbra::test
