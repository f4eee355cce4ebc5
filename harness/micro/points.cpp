#include "harness/micro/points.h"

#include <array>
#include <cmath>

#include "harness/commands/commands.h"
#include "harness/scene_store.h"
#include "scenes/core/error.h"

namespace penumbra::micro {

Tile BenchTile::tile(int spp) const {
  Tile tile;
  tile.width = kSide;
  tile.height = kSide;
  tile.image_width = kSide;
  tile.spp = spp;
  tile.points = points;
  return tile;
}

BenchTile make_bench_tile(const std::string& scene) {
  BenchTile result;
  result.scene = load_scene(scene_path(scene), std::array<int, 2>{240, 135});
  const ShadingPoints all = make_shading_points(*result.scene, 1, kCameraSeed, 16);
  PN_CHECK(all.valid_count >= BenchTile::kPoints, "the scene covers enough of the image");
  // Valid points in equal steps through the image.
  std::size_t seen = 0;
  for (const ShadingPoint& point : all.points) {
    if (!point.valid()) continue;
    if (seen * BenchTile::kPoints / all.valid_count == result.points.size()) {
      result.points.push_back(point);
    }
    ++seen;
  }
  PN_CHECK(result.points.size() == BenchTile::kPoints, "one point per step");
  return result;
}

ParamSet default_params(const EstimatorEntry& entry) {
  std::vector<ParamProblem> problems;
  return resolve_params(entry.params(), {}, problems);
}

Budget budget_of(const EstimatorEntry& entry, int srl) {
  const int initial = srl / 4;
  return entry.adaptive ? Budget{SamplerKind::Independent, initial, srl - initial}
                        : Budget{SamplerKind::Independent, srl, 0};
}

std::string srl_text(const EstimatorEntry& entry, int srl) {
  const Budget budget = budget_of(entry, srl);
  return entry.adaptive
             ? std::to_string(budget.srl_initial) + "-" + std::to_string(budget.srl_adaptive)
             : std::to_string(srl);
}

MeanEstimate mean_over_tile(const BenchTile& tile, const EstimatorEntry& entry,
                            const Budget& budget, int spp, int runs, std::uint64_t first_seed) {
  const std::unique_ptr<Estimator> estimator =
      entry.create(*tile.scene, default_params(entry), budget);
  const Tile job = tile.tile(spp);
  std::vector<Rgb> radiance(job.estimate_count());
  MeanEstimate result;
  double sum = 0.0;
  double square_sum = 0.0;
  for (int run = 0; run < runs; ++run) {
    TileOutput out;
    out.radiance = radiance;
    estimator->estimate(job, first_seed + static_cast<std::uint64_t>(run), out);
    double mean = 0.0;
    for (const Rgb& value : radiance) mean += static_cast<double>(luminance(value));
    mean /= static_cast<double>(radiance.size());
    result.finite = result.finite && std::isfinite(mean);
    sum += mean;
    square_sum += mean * mean;
  }
  result.mean = sum / runs;
  const double variance = std::max(square_sum / runs - result.mean * result.mean, 0.0);
  result.standard_error = std::sqrt(variance / (runs - 1));
  return result;
}

}  // namespace penumbra::micro
