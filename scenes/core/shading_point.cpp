#include "scenes/core/shading_point.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

#include "scenes/core/error.h"
#include "scenes/core/float_mode.h"
#include "scenes/core/sampler.h"
#include "scenes/core/scene.h"

namespace penumbra {
namespace {

// The same place as a probe of irradiance.
void look_along_normal(const Scene& scene, ShadingPoint& point) {
  point.wo = point.shading_normal;
  point.material = scene.irradiance_material();
  point.light = kNoLight;
}

// Looks the textures up. What they make black reflects nothing, like a material that is black.
SurfaceValues texture_point(const Scene& scene, const RayHit& hit, ShadingPoint& point) {
  const SurfaceValues values = scene.surface_values(hit);
  if (point.valid() && scene.bsdf_at(point.material, &values).is_black()) {
    point.material = ShadingPoint::kInvalid;
  }
  return values;
}

// Primary hits of one tile. Directions that meet nothing leave invalid points.
// @param surfaces  nullptr where there are no textures
std::size_t shade_tile(const Scene& scene, const TileRect& tile, int camera_samples,
                       std::uint64_t seed, Quantity quantity, RayBatch& batch, ShadingPoint* out,
                       SurfaceValues* surfaces) {
  const Camera& camera = scene.camera();
  const auto count = static_cast<std::uint32_t>(camera_samples);
  batch.clear();
  for (int pixel = 0; pixel < tile.width * tile.height; ++pixel) {
    const int x = tile.x0 + pixel % tile.width;
    const int y = tile.y0 + pixel / tile.width;
    StreamKey key;
    key.seed = seed;
    key.pixel = static_cast<std::uint32_t>(y * camera.width() + x);
    key.component = kCameraComponent;
    const PointSet jitter(SamplerKind::Stratified, key, count);
    for (std::uint32_t s = 0; s < count; ++s) {
      const Vec2 u = count == 1 ? Vec2(0.5f) : jitter(s).u;
      batch.add(camera.position(),
                camera.direction(static_cast<float>(x) + u.x, static_cast<float>(y) + u.y));
    }
  }
  scene.intersect(batch);
  std::size_t valid = 0;
  for (std::size_t i = 0; i < batch.size(); ++i) {
    out[i] = ShadingPoint{};
    out[i].wo = -batch.direction(i);
    if (batch.hits[i].hit()) {
      out[i] = scene.shading_point(batch.hits[i], batch.origin(i), batch.direction(i));
      if (surfaces != nullptr) surfaces[i] = texture_point(scene, batch.hits[i], out[i]);
      if (quantity == Quantity::Irradiance) look_along_normal(scene, out[i]);
    } else if (quantity == Quantity::Radiance) {
      // Seen directly; an irradiance there is none without a surface.
      out[i].light = scene.environment_light();
    }
    valid += out[i].valid() ? 1u : 0u;
  }
  return valid;
}

void check_count(const Scene& scene, int camera_samples) {
  const auto width = static_cast<std::uint64_t>(scene.camera().width());
  const auto height = static_cast<std::uint64_t>(scene.camera().height());
  const std::uint64_t count = width * height * static_cast<std::uint64_t>(camera_samples);
  if (count <= kMaxShadingPoints) return;
  throw InputError("scene \"" + scene.name() + "\": " + std::to_string(width) + " x " +
                   std::to_string(height) + " pixels with " + std::to_string(camera_samples) +
                   " camera samples are " + std::to_string(count) +
                   " shading points; allowed: up to " + std::to_string(kMaxShadingPoints));
}

std::size_t area(const TileRect& tile) {
  return static_cast<std::size_t>(tile.width) * static_cast<std::size_t>(tile.height);
}

}  // namespace

std::string_view to_string(Quantity quantity) {
  return quantity == Quantity::Radiance ? "radiance" : "irradiance";
}

ShadingPoints make_shading_points(const Scene& scene, int camera_samples, std::uint64_t seed,
                                  int tile_side, Quantity quantity) {
  check_count(scene, camera_samples);
  ShadingPoints result;
  result.width = scene.camera().width();
  result.height = scene.camera().height();
  result.camera_samples = camera_samples;
  result.quantity = quantity;
  const auto samples = static_cast<std::size_t>(camera_samples);
  std::size_t total = 0;
  for (int y = 0; y < result.height; y += tile_side) {
    for (int x = 0; x < result.width; x += tile_side) {
      result.tiles.push_back({x, y, std::min(tile_side, result.width - x),
                              std::min(tile_side, result.height - y), total});
      total += area(result.tiles.back()) * samples;
    }
  }
  result.points.resize(total);
  if (scene.has_textures() && quantity == Quantity::Radiance) result.surfaces.resize(total);
  std::atomic<std::size_t> valid{0};
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, result.tiles.size()), [&](const auto& range) {
        const DenormalMode mode(Denormals::Flushed);
        RayBatch batch(static_cast<std::size_t>(tile_side) * static_cast<std::size_t>(tile_side) *
                       samples);
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          const TileRect& tile = result.tiles[i];
          valid += shade_tile(scene, tile, camera_samples, seed, quantity, batch,
                              &result.points[tile.first],
                              result.surfaces.empty() ? nullptr : &result.surfaces[tile.first]);
        }
      });
  result.valid_count = valid;
  return result;
}

}  // namespace penumbra
