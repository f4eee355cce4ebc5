#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "scenes/core/bsdf.h"
#include "scenes/core/camera.h"
#include "scenes/core/light.h"
#include "scenes/core/ray_batch.h"
#include "scenes/core/scene_description.h"
#include "scenes/core/shading_point.h"
#include "scenes/core/surface_geometry.h"

namespace penumbra {

/// What a scene really has; worked out once on loading.
struct SceneTraits {
  std::size_t triangles{0};  ///< quads count as two
  std::size_t spheres{0};
  std::size_t materials{0};
  std::size_t rectangle_lights{0}, sphere_lights{0}, mesh_lights{0}, point_lights{0};
  bool has_environment{false};
  bool all_diffuse{true};  ///< no glossy or Phong lobe anywhere
  float min_alpha{1.0f};   ///< sharpest GGX lobe
  double scale{1.0};       ///< scene units per world unit, a power of two
  Vec3d center{0.0};       ///< world position of the scene's origin
  double diagonal{0.0};    ///< of the bounding box [scene units]
  std::size_t ray_scene_bytes{0};
  double ray_scene_build_s{0.0};  ///< time that the ray tracer's structure took
};

/// A loaded scene: immutable and shared by all threads. Geometry is recentred and rescaled in
/// double precision to a diagonal of order 1 to 10 by a power of two, so that nothing downstream
/// depends on units or on the distance from the origin. Radiance does not change under that;
/// lengths reported to the user are divided by `traits().scale`.
class Scene {
 public:
  /// @throws InputError when there is nothing to render, or a point light is too far away for float
  explicit Scene(SceneDescription description);

  const std::string& name() const noexcept { return name_; }
  const Camera& camera() const noexcept { return camera_; }
  std::span<const Light> lights() const noexcept { return lights_; }
  const Bsdf& bsdf(std::uint32_t material) const noexcept { return bsdfs_[material]; }
  /// Index of the material that turns radiance into irradiance: f = 1, so that the reflected
  /// "radiance" is the integral of arriving radiance x cosine [W/m^2].
  std::uint32_t irradiance_material() const noexcept {
    return static_cast<std::uint32_t>(bsdfs_.size() - 1);
  }
  /// The environment's index among the lights, or kNoLight.
  std::int32_t environment_light() const noexcept { return environment_light_; }
  const SceneTraits& traits() const noexcept { return traits_; }

  /// Hash of everything that decides the truth: geometry, materials, emission, camera; hexadecimal,
  /// 32 digits.
  const std::string& content_hash() const noexcept { return content_hash_; }

  /// The batch query of every estimator: the closest hit of each ray in `batch.hits`.
  void intersect(RayBatch& batch) const noexcept {
    if (recorder_ != nullptr) recorder_->batches.push_back(batch);
    rays_.intersect(batch);
  }
  /// Starts (or with nullptr ends) recording; only while a single thread traces. For `penumbra
  /// inspect`.
  void set_recorder(RayRecorder* recorder) noexcept { recorder_ = recorder; }

  /// Light whose emitting side a ray along `direction` met, or kNoLight. A ray that met nothing
  /// sees the environment where there is one.
  std::int32_t emitter(const RayHit& hit, const Vec3& direction) const noexcept {
    if (!hit.hit()) return environment_light_;
    const std::int32_t light = geometries_[hit.geometry].light;
    if (light == kNoLight) return kNoLight;
    return lights_[static_cast<std::size_t>(light)].emits_against(direction, hit.normal) ? light
                                                                                         : kNoLight;
  }

  /// The surface at a hit as a shading point seen along `direction`. The position comes from the
  /// primitive's own coordinates, which are exact to rounding at any distance from the ray's
  /// origin.
  ShadingPoint shading_point(const RayHit& hit, const Vec3& direction) const noexcept;

 private:
  void add_shape(const ShapeDescription& shape);
  void work_out_traits(const SceneDescription& normalised);

  std::string name_;
  Camera camera_;
  std::vector<Bsdf> bsdfs_;
  std::vector<Light> lights_;
  std::vector<SurfaceGeometry> geometries_;
  RayScene rays_;
  SceneTraits traits_;
  std::string content_hash_;
  std::int32_t environment_light_{kNoLight};
  RayRecorder* recorder_{nullptr};
};

/// Number of the scene core's version that decides images; part of every reference's key. Counted
/// up when a change of the core changes the true image (not its noise).
inline constexpr int kCoreVersion = 1;

}  // namespace penumbra
