#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "estimators/estimator.h"
#include "scenes/core/scene.h"

/// What the microbenchmarks estimate: a tile of shading points taken from all over a scene's image.
namespace penumbra::micro {

/// One block of 8x8 pixels. Its points are valid and evenly spread over the scene's image, so that
/// the mean cost over the tile is that of the image. Textures are left out: materials are as
/// described.
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

/// Shadow rays per light of one estimate; split 1:3 where the estimator adapts.
Budget budget_of(const EstimatorEntry& entry, int srl);
/// The same as configs have it: "16", or "4-12".
std::string srl_text(const EstimatorEntry& entry, int srl);

/// Mean luminance of estimates over the tile, from independent runs.
struct MeanEstimate {
  double mean{0};
  double standard_error{0};
  bool finite{true};
};

/// @param runs  with seeds first_seed, first_seed + 1, ...
MeanEstimate mean_over_tile(const BenchTile& tile, const EstimatorEntry& entry,
                            const Budget& budget, int spp, int runs, std::uint64_t first_seed);

}  // namespace penumbra::micro
