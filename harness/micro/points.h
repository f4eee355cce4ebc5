#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "estimators/estimator.h"
#include "scenes/core/scene.h"

/// What the microbenchmarks estimate: a tile of shading points taken from all over a scene's image.
namespace penumbra::micro {

/// One block of 8x8 pixels. Its points are valid and evenly spread over the scene's image, so that
/// the mean cost over the tile is that of the image.
struct BenchTile {
  static constexpr int kSide = 8;  ///< [pixels]
  static constexpr std::size_t kPoints = std::size_t{kSide} * kSide;

  std::unique_ptr<Scene> scene;
  std::vector<ShadingPoint> points;

  Tile tile(int spp) const;
};

/// @param scene  name of a shipped scene
BenchTile make_bench_tile(const std::string& scene);

/// An estimator's default parameters.
ParamSet default_params(const EstimatorEntry& entry);

/// Mean luminance of estimates over the tile, from independent runs.
struct MeanEstimate {
  double mean{0};
  double standard_error{0};
  bool finite{true};
};

/// @param runs  with seeds first_seed, first_seed + 1, ...
MeanEstimate mean_over_tile(const BenchTile& tile, const EstimatorEntry& entry,
                            const Budget& budget, int spp, int runs, std::uint64_t first_seed);

/// CPU time of this thread [s].
double thread_cpu_s();

}  // namespace penumbra::micro
