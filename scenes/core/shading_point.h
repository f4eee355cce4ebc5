#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "scenes/core/surface_values.h"
#include "scenes/core/vec.h"

namespace penumbra {

class Scene;

inline constexpr std::int32_t kNoLight = -1;

/// A point whose direct light is to be estimated, in scene space. 56 bytes: a 1920x1080 image with
/// 8 camera samples keeps 16.6 million of them.
struct ShadingPoint {
  static constexpr std::uint32_t kInvalid = std::numeric_limits<std::uint32_t>::max();

  Vec3 position{0.0f};          ///< moved off the surface: the origin of its rays
  Vec3 geometric_normal{0.0f};  ///< unit, on the side of the viewer
  Vec3 shading_normal{0.0f};    ///< unit, in the same hemisphere
  Vec3 wo{0.0f};                ///< unit, towards the viewer
  std::uint32_t material{kInvalid};
  std::int32_t light{kNoLight};  ///< light whose emitting side is seen here (the environment, where
                                 ///< nothing was met), or kNoLight; none at points of irradiance
  /// False where the camera ray met nothing or a surface that is black there: no light can be
  /// reflected.
  bool valid() const noexcept { return material != kInvalid; }
};

/// The shading normal of a point from what its surface interpolates there. Unit, finite, and on the
/// side of both the viewer and the geometric normal, by these rules in turn:
/// 1. Without a direction (normals that cancel, not finite), it is the geometric normal.
/// 2. On the far side of the geometric normal it is turned round: meshes whose normals point
/// inwards
///    shade like those whose normals point outwards, and both sides of a surface alike.
/// 3. Where it turns away from the viewer, within 1e-3 of a right angle or beyond, as near
///    silhouettes of coarse meshes, it is bent towards the viewer in the plane of the two, up to
///    a cosine of 1e-3. Turning it round instead would light such points from behind, and dropping
///    them would leave black dots.
/// Directions below either normal reflect nothing, so what a shading normal changes is a loss,
/// never a gain: the reflected radiance stays below the albedo times the largest arriving one. The
/// rules are this project's own.
/// @param interpolated      any length
/// @param geometric_normal  unit, on the side of the viewer
/// @param wo                unit, towards the viewer
Vec3 make_shading_normal(const Vec3& interpolated, const Vec3& geometric_normal,
                         const Vec3& wo) noexcept;

/// What is estimated at the points of an image.
enum class Quantity : std::uint8_t {
  Radiance,    ///< reflected towards the viewer by direct light [W/(m^2 sr)]
  Irradiance,  ///< of the surface on the viewer's side, whatever its material [W/m^2]: what an
               ///< irradiance cache stores
};

std::string_view to_string(Quantity quantity);

/// A rectangle of pixels whose shading points lie together.
struct TileRect {
  int x0{0}, y0{0};
  int width{0},
      height{0};  ///< [pixels]; smaller than the tile's side at the right and lower border only
  std::size_t first{0};  ///< index of its first point
};

/// The shading points of an image, tile after tile: primary hits, made once per scene and never
/// timed.
struct ShadingPoints {
  int width{0}, height{0};  ///< of the image [pixels]
  int camera_samples{1};    ///< points per pixel
  Quantity quantity{Quantity::Radiance};
  std::vector<TileRect> tiles;          ///< row-major
  std::vector<ShadingPoint> points;     ///< [tile][pixel, row-major in the tile][camera sample]
  std::vector<SurfaceValues> surfaces;  ///< same length, values of the textures; empty: no textures
  std::size_t valid_count{0};

  std::span<const ShadingPoint> of(const TileRect& tile) const {
    return std::span(points).subspan(tile.first, count_of(tile));
  }
  /// Values of the textures at the same points; empty where there are no textures.
  std::span<const SurfaceValues> surfaces_of(const TileRect& tile) const {
    if (surfaces.empty()) return {};
    return std::span(surfaces).subspan(tile.first, count_of(tile));
  }
  std::size_t count_of(const TileRect& tile) const {
    return static_cast<std::size_t>(tile.width) * static_cast<std::size_t>(tile.height) *
           static_cast<std::size_t>(camera_samples);
  }
};

/// An image of 16384 x 16384 pixels with one camera sample; 14 GiB.
inline constexpr std::uint64_t kMaxShadingPoints = std::uint64_t{1} << 28;

/// Traces the primary rays. Camera samples are jittered over a stratified grid of each pixel (one
/// sample: the pixel's centre) and keyed by `seed`, so every estimator, block and reference sees
/// the same points and the antialiasing of edges is not mistaken for an error of the estimators.
/// The points do not depend on the tile's side, only their order. Points of irradiance look along
/// the normal at a surface of f = 1, so every estimator of radiance estimates irradiance there;
/// they have no textures.
/// @param tile_side  [pixels], > 0
/// @throws InputError when there are more than kMaxShadingPoints, before memory is asked for
ShadingPoints make_shading_points(const Scene& scene, int camera_samples, std::uint64_t seed,
                                  int tile_side, Quantity quantity = Quantity::Radiance);

}  // namespace penumbra
