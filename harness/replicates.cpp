#include "harness/replicates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

// Float pixels round; a difference of that order is none.
constexpr double kTolerance = 1e-6;

double mean_of_channels(const Vec3d& v) { return (v.x + v.y + v.z) / 3.0; }

// Noise of a tile's mean: the sum of (A-B)/2 over each square of pixels that may be correlated.
std::vector<double> square_sums(const ReplicateReference& reference, int width,
                                const PixelRect& rect) {
  const int side = reference.correlated_side > 0
                       ? reference.correlated_side
                       : std::max(rect.x + rect.width, rect.y + rect.height);
  const int first_x = rect.x / side;
  const int first_y = rect.y / side;
  const int columns = (rect.x + rect.width - 1) / side - first_x + 1;
  const int rows = (rect.y + rect.height - 1) / side - first_y + 1;
  std::vector<double> sums(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0.0);
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      const std::size_t p = pixel_index(width, x, y);
      const Vec3d difference = Vec3d(reference.halves.a[p]) - Vec3d(reference.halves.b[p]);
      sums[pixel_index(columns, x / side - first_x, y / side - first_y)] +=
          0.5 * mean_of_channels(difference);
    }
  }
  return sums;
}

double mean_of_reference(const ReplicateReference& reference, int width, const PixelRect& rect) {
  double sum = 0;
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      const std::size_t p = pixel_index(width, x, y);
      sum += 0.5 * mean_of_channels(Vec3d(reference.halves.a[p]) + Vec3d(reference.halves.b[p]));
    }
  }
  return sum / (static_cast<double>(rect.width) * rect.height);
}

}  // namespace

std::vector<MeanEstimate> tile_estimates(const ReplicateReference& reference, int width,
                                         std::span<const BiasTile> tiles) {
  std::vector<MeanEstimate> estimates;
  for (const BiasTile& tile : tiles) {
    MeanEstimate& estimate = estimates.emplace_back();
    estimate.mean = mean_of_reference(reference, width, tile.rect);
    if (reference.exact) continue;
    const double pixels = static_cast<double>(tile.rect.width) * tile.rect.height;
    std::vector<double> variances = square_sums(reference, width, tile.rect);
    for (double& value : variances) value *= value / (pixels * pixels);
    for (const double value : variances) estimate.variance_of_mean += value;
    // Satterthwaite's degrees of freedom of a sum of variances with one degree each.
    estimate.degrees_of_freedom = effective_pixels(variances, 1.0).value_or(0.0);
  }
  return estimates;
}

ReplicateSums::ReplicateSums(int width, int height)
    : width_(width),
      height_(height),
      mean_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), Vec3d(0.0)),
      squares_(mean_.size(), Vec3d(0.0)),
      widened_(mean_.size()),
      tiles_(bias_tiles(width, height, kBiasTileSides)) {}

void ReplicateSums::add(std::span<const Rgb> image) {
  widened_.assign(image.begin(), image.end());
  tiles_.add(widened_);
  const auto n = static_cast<double>(tiles_.count());
  for (std::size_t p = 0; p < mean_.size(); ++p) {
    const Vec3d before = widened_[p] - mean_[p];
    mean_[p] += before / n;
    squares_[p] += before * (widened_[p] - mean_[p]);
  }
}

ReplicateSummary ReplicateSums::summary(const ReplicateReference& reference) const {
  if (count() < 2 || reference.halves.a.size() != mean_.size() ||
      reference.halves.b.size() != mean_.size()) {
    throw InputError(fmt::format(
        "replicates: {} images of {} pixels and a reference of {}, allowed are 2 or more images, "
        "of the reference's size",
        count(), mean_.size(), reference.halves.a.size()));
  }
  ReplicateSummary result;
  result.count = count();
  result.mean = {width_, height_, std::vector<Rgb>(mean_.size())};
  result.standard_deviation = result.mean;
  std::vector<double> variances(mean_.size());
  double product = 0;
  for (std::size_t p = 0; p < mean_.size(); ++p) {
    const Vec3d variance = squares_[p] / (count() - 1.0);
    const Vec3d from_a = mean_[p] - Vec3d(reference.halves.a[p]);
    const Vec3d from_b = mean_[p] - Vec3d(reference.halves.b[p]);
    variances[p] = mean_of_channels(variance);
    result.variance += variances[p];
    product += mean_of_channels(from_a * from_b);
    result.mean.pixels[p] = Rgb(mean_[p]);
    for (int c = 0; c < 3; ++c) {
      result.standard_deviation.pixels[p][c] = static_cast<float>(std::sqrt(variance[c]));
    }
  }
  const auto pixels = static_cast<double>(mean_.size());
  result.variance /= pixels;
  result.bias2 = product / pixels - result.variance / count();
  result.p_eff = effective_pixels(variances, count() - 1.0);
  result.bias = test_bias(tiles_, reference, width_, height_);
  return result;
}

std::optional<BiasTestResult> test_bias(const TileReplicates& tiles,
                                        const ReplicateReference& reference, int width,
                                        int height) {
  if (tiles.count() < kReplicatesForTest) return std::nullopt;
  BiasTestOptions options;
  options.tolerance = kTolerance;
  TileReplicates whole(bias_tiles(width, height, {}));
  Welford means;
  for (std::size_t r = 0; r < tiles.count(); ++r) {
    whole.add_values(tiles.replicate(r).first(1));
    means.add(tiles.replicate(r)[0]);
  }
  const std::vector<MeanEstimate> of_whole = tile_estimates(reference, width, whole.tiles());
  const double allowed =
      kReferenceVarianceForTiles * *means.variance() / static_cast<double>(tiles.count());
  if (tiles.count() < kReplicatesForTiles || of_whole[0].variance_of_mean > allowed) {
    return bias_test(whole, of_whole, options);
  }
  return bias_test(tiles, tile_estimates(reference, width, tiles.tiles()), options);
}

void add_replicates(EfficiencyRow& row, const ReplicateSummary& summary) {
  row.variance = summary.variance;
  row.bias2 = summary.bias2;
  row.p_eff_runs = summary.p_eff;
  row.bias_smallest_p.reset();
  row.bias_tost.clear();
  if (!summary.bias) return;
  row.bias_smallest_p = summary.bias->smallest_p;
  if (summary.bias->relative_bias) {
    row.bias_tost = summary.bias->relative_bias->shown_small ? "shown" : "not shown";
  }
}

}  // namespace penumbra
