#pragma once

#include <span>

#include "estimators/estimator.h"

/// From the shading points of an image to an estimator's tile and back to pixels: shared by runs
/// and by `penumbra replay`, which must give the same bits.
namespace penumbra {

/// One rectangle of an image's shading points as an estimator takes it.
/// @param spp  estimates per pixel, >= camera samples
Tile make_tile(const ShadingPoints& points, const TileRect& rect, int spp);

/// Index of the rectangle that holds a pixel of the image. The pixel must be inside the image.
std::size_t tile_index_at(const ShadingPoints& points, int x, int y);

/// The estimates of one pixel. @param radiance  [pixel][estimate], of the whole tile
std::span<const Rgb> estimates_of(const Tile& tile, int pixel, std::span<const Rgb> radiance);

/// A pixel's value: the mean over its camera samples of the mean of the estimates made at each.
/// @param estimates  [spp], of one pixel
Vec3d pixel_mean(const Tile& tile, std::span<const Rgb> estimates);

/// A pixel's value in single precision, as image files hold it.
Rgb stored_pixel(const Vec3d& mean);

/// Whether a channel is not finite or negative.
bool is_bad(const Rgb& value) noexcept;

/// Whether an estimate is an error: not finite, or negative where the estimator may not be.
bool is_bad_estimate(const EstimatorEntry& estimator, const Rgb& value) noexcept;

}  // namespace penumbra
