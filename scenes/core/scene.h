#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "scenes/core/bsdf.h"
#include "scenes/core/camera.h"
#include "scenes/core/light.h"
#include "scenes/core/occluders.h"
#include "scenes/core/ray_batch.h"
#include "scenes/core/scene_description.h"
#include "scenes/core/scene_parts.h"
#include "scenes/core/scene_textures.h"
#include "scenes/core/shading_point.h"
#include "scenes/core/surface_geometry.h"

namespace penumbra {

/// What a scene really has; worked out once on loading.
struct SceneTraits {
  std::string geometry{"own"};  ///< SceneDescription::geometry
  std::size_t triangles{0};     ///< that rays meet, see traced_triangles
  std::size_t spheres{0};
  std::size_t materials{0};
  std::size_t rectangle_lights{0}, sphere_lights{0}, mesh_lights{0};
  std::size_t point_lights{0}, spot_lights{0}, directional_lights{0};
  bool has_environment{false};
  bool has_mirrors{false};
  bool all_diffuse{true};  ///< no glossy or Phong lobe anywhere
  float min_alpha{1.0f};   ///< sharpest GGX lobe; textures of roughness can sharpen it further
  double scale{1.0};       ///< scene units per world unit, a power of two
  Vec3d center{0.0};       ///< world position of the scene's origin
  double diagonal{0.0};    ///< of the bounding box [scene units]
  std::size_t ray_scene_bytes{0};
  double ray_scene_build_s{0.0};  ///< time that the ray tracer's structure took
};

/// How a scene is loaded.
struct SceneOptions {
  /// Builds every part whether the scene needs it or not, and lets estimators sample components
  /// that can not contribute: what leaving out is compared with. The true image is the same.
  bool keep_all{false};
  /// Traces with Embree's fast flags instead of the robust ones, to measure what those cost.
  bool fast_rays{false};
};

/// A loaded scene: immutable and shared by all threads. Geometry is recentred and rescaled in
/// double precision to a diagonal of order 1 to 10 by a power of two, so that nothing downstream
/// depends on units or on the distance from the origin. Radiance does not change under that;
/// lengths reported to the user are divided by `traits().scale`.
class Scene {
 public:
  /// @throws InputError when there is nothing to render, or a point or spot light is too far away
  ///         for float
  explicit Scene(SceneDescription description, const SceneOptions& options = {});

  const std::string& name() const noexcept { return name_; }
  const Camera& camera() const noexcept { return camera_; }
  std::span<const Light> lights() const noexcept { return lights_; }
  /// Indices of the lights that have a density over directions, and of those that have none.
  std::span<const std::uint32_t> sampled_lights() const noexcept { return sampled_lights_; }
  std::span<const std::uint32_t> delta_lights() const noexcept { return delta_lights_; }
  const Bsdf& bsdf(std::uint32_t material) const noexcept { return bsdfs_[material]; }
  /// The material at a point.
  /// @param values  of the point's textures; nullptr: factors of 1
  Bsdf bsdf_at(std::uint32_t material, const SurfaceValues* values) const noexcept {
    return values != nullptr ? bsdfs_[material].with(*values) : bsdfs_[material];
  }
  /// Whether a material reflects along a single direction, so that there is nothing to sample.
  bool is_mirror(std::uint32_t material) const noexcept {
    return traits_.has_mirrors && bsdfs_[material].is_delta();
  }
  /// Index of the material that turns radiance into irradiance: f = 1, so that the reflected
  /// "radiance" is the integral of arriving radiance x cosine [W/m^2].
  std::uint32_t irradiance_material() const noexcept {
    return static_cast<std::uint32_t>(bsdfs_.size() - 1);
  }
  /// The environment's index among the lights, or kNoLight.
  std::int32_t environment_light() const noexcept { return environment_light_; }
  const SceneTraits& traits() const noexcept { return traits_; }
  const SceneParts& parts() const noexcept { return parts_; }
  /// Whether nothing is left out: neither parts of the scene nor components of mixtures.
  bool keep_all() const noexcept { return keep_all_; }

  /// Hash of everything that decides the truth: geometry, materials, emission, camera; hexadecimal,
  /// 32 digits.
  const std::string& content_hash() const noexcept { return content_hash_; }

  /// The batch query of every estimator: the closest hit of each ray in `batch.hits`.
  void intersect(RayBatch& batch) const noexcept {
    if (recorder_ != nullptr) recorder_->add(batch);
    rays_.intersect(batch);
  }
  const RayScene& rays() const noexcept { return rays_; }
  /// Starts (or with nullptr ends) recording; only while a single thread traces. For `penumbra
  /// inspect`.
  void set_recorder(RayRecorder* recorder) noexcept { recorder_ = recorder; }

  /// Light whose emitting side a ray along `direction` met, or kNoLight. A ray that met nothing
  /// sees the environment where there is one.
  std::int32_t emitter(const RayHit& hit, const Vec3& direction) const noexcept {
    return hit.hit() ? surface_emitter(hit, direction) : environment_light_;
  }

  /// The same for a ray that met a surface.
  std::int32_t surface_emitter(const RayHit& hit, const Vec3& direction) const noexcept {
    const std::int32_t light = geometries_[hit.geometry].light;
    if (light == kNoLight) return kNoLight;
    return lights_[static_cast<std::size_t>(light)].emits_against(direction, hit.normal) ? light
                                                                                         : kNoLight;
  }

  /// Whether something can lie between a point and a light (Occluders); true where all is kept.
  bool may_be_occluded(std::uint32_t light, const ShadingPoint& point) const noexcept {
    return keep_all_ || occluders_.may_be_between(lights_[light], static_cast<std::int32_t>(light),
                                                  point.position, point.geometric_normal);
  }

  /// The surface at a hit as a shading point seen from `origin` along `direction`. The position
  /// comes from the primitive's own coordinates, which are exact to rounding at any distance from
  /// the ray's origin; of a subdivision surface it is where the ray met the tessellation, because
  /// the limit surface at the same coordinates lies above or below what rays meet.
  ShadingPoint shading_point(const RayHit& hit, const Vec3& origin,
                             const Vec3& direction) const noexcept;

  /// Texture coordinates of the surface at a hit; (0, 0) where no texture or mask needs them.
  Vec2 surface_uv(const RayHit& hit) const noexcept {
    return uv_at(geometries_[hit.geometry], hit);
  }

  /// Whether the material of any shape has textures beside masks.
  bool has_textures() const noexcept { return textures_ != nullptr && textures_->has_values(); }

  /// Values of the material's textures at a hit; only where `has_textures()`.
  SurfaceValues surface_values(const RayHit& hit) const noexcept {
    return textures_->values(geometries_[hit.geometry].material, surface_uv(hit));
  }

 private:
  void add_shape(const ShapeDescription& shape);
  void add_lights(const SceneDescription& scene);
  void keep_or_drop_arrays(SurfaceGeometry& geometry);
  void work_out_traits(const SceneDescription& normalised);

  std::string name_;
  Camera camera_;
  std::vector<Bsdf> bsdfs_;
  std::vector<Light> lights_;
  std::vector<std::uint32_t> sampled_lights_, delta_lights_;
  std::vector<SurfaceGeometry> geometries_;
  Occluders occluders_;
  std::unique_ptr<SceneTextures> textures_;  // nullptr where no material in use has an image
  RayScene rays_;
  std::vector<std::unique_ptr<RayScene>> light_crossings_;  // of mesh lights of many triangles
  SceneTraits traits_;
  SceneParts parts_;
  std::string content_hash_;
  std::int32_t environment_light_{kNoLight};
  bool keep_all_{false};
  RayRecorder* recorder_{nullptr};
};

/// Number of the scene core's version that decides images; part of every reference's key. Counted
/// up when a change of the core changes the true image (not its noise).
inline constexpr int kCoreVersion = 1;

}  // namespace penumbra
