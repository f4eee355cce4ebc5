#pragma once

#include <vector>

#include "harness/render.h"

/// One pixel of a render again, with every sample.
namespace penumbra {

struct PixelRecord {
  Tile tile;                            ///< that holds the pixel; views the shading points
  int pixel{0};                         ///< index in the tile
  std::vector<Rgb> estimates;           ///< [estimate], the bits of the render
  std::vector<EstimateRecord> records;  ///< of the estimates that the estimator left a record of
};

/// Runs the pixel's tile again, which decides every bit of it, and records the pixel.
/// @param x, y  inside the image
PixelRecord record_pixel(const Scene& scene, const ShadingPoints& points,
                         const RenderSettings& settings, int x, int y);

/// Fills in BadEstimate::cause of the listed estimates. Recording costs the time of a tile for each
/// of their pixels, and nothing where all is well.
/// @param result  of render() with the same arguments
void find_causes(const Scene& scene, const ShadingPoints& points, const RenderSettings& settings,
                 RenderResult& result);

}  // namespace penumbra
