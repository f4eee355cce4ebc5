#include "tests/support/correlation.h"

#include <cmath>

namespace penumbra::fixtures {

std::vector<double> errors_of_a_tile(const EstimatorEntry& entry, const ParamSet& params,
                                     const Budget& budget, const PlacedPoint& placed,
                                     std::uint64_t seed) {
  const std::vector<ShadingPoint> points(std::size_t{kCorrelationSide} * kCorrelationSide,
                                         placed.point);
  Tile tile;
  tile.width = tile.height = tile.image_width = kCorrelationSide;
  tile.spp = kCorrelationSpp;
  tile.points = points;
  std::vector<Rgb> radiance(tile.estimate_count());
  TileOutput out;
  out.radiance = radiance;
  entry.create(*placed.scene, params, budget)->estimate(tile, seed, out);
  double mean = 0.0;
  for (const Rgb& value : radiance) mean += static_cast<double>(value.x);
  mean /= static_cast<double>(radiance.size());
  std::vector<double> result;
  for (const Rgb& value : radiance) result.push_back(static_cast<double>(value.x) - mean);
  return result;
}

double correlation_z(const std::vector<double>& errors, std::size_t step) {
  double product = 0.0;
  double square = 0.0;
  double pairs = 0.0;
  for (std::size_t i = 0; i + step < errors.size(); ++i) {
    product += errors[i] * errors[i + step];
    square += 0.5 * (errors[i] * errors[i] + errors[i + step] * errors[i + step]);
    pairs += 1.0;
  }
  return product / square * std::sqrt(pairs);
}

}  // namespace penumbra::fixtures
