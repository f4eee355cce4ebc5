#include "harness/tile.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {

Tile make_tile(const ShadingPoints& points, const TileRect& rect, int spp) {
  Tile tile;
  tile.x0 = rect.x0;
  tile.y0 = rect.y0;
  tile.width = rect.width;
  tile.height = rect.height;
  tile.image_width = points.width;
  tile.camera_samples = points.camera_samples;
  tile.spp = spp;
  tile.points = points.of(rect);
  tile.surfaces = points.surfaces_of(rect);
  return tile;
}

std::size_t tile_index_at(const ShadingPoints& points, int x, int y) {
  const auto found =
      std::find_if(points.tiles.begin(), points.tiles.end(), [&](const TileRect& tile) {
        return x >= tile.x0 && x < tile.x0 + tile.width && y >= tile.y0 &&
               y < tile.y0 + tile.height;
      });
  PN_CHECK(found != points.tiles.end(), "the pixel is inside the image");
  return static_cast<std::size_t>(found - points.tiles.begin());
}

std::span<const Rgb> estimates_of(const Tile& tile, int pixel, std::span<const Rgb> radiance) {
  const auto spp = static_cast<std::size_t>(tile.spp);
  return radiance.subspan(static_cast<std::size_t>(pixel) * spp, spp);
}

Vec3d pixel_mean(const Tile& tile, std::span<const Rgb> estimates) {
  const int samples = tile.camera_samples;
  Vec3d sum(0.0);
  for (int e = 0; e < tile.spp; ++e) {
    const int repeats = (tile.spp - 1 - e % samples) / samples + 1;
    sum += Vec3d(estimates[static_cast<std::size_t>(e)]) / static_cast<double>(repeats);
  }
  return sum / static_cast<double>(samples);
}

Rgb stored_pixel(const Vec3d& mean) { return Rgb(Imath::V3f(mean)); }

bool is_bad(const Rgb& value) noexcept {
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(value[i]) || value[i] < 0.0f) return true;
  }
  return false;
}

bool is_bad_estimate(const EstimatorEntry& estimator, const Rgb& value) noexcept {
  if (!estimator.may_be_negative) return is_bad(value);
  return !std::isfinite(value.x) || !std::isfinite(value.y) || !std::isfinite(value.z);
}

}  // namespace penumbra
