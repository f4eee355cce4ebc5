#pragma once

#include <cstdint>
#include <vector>

#include "estimators/mixture/sums.h"
#include "scenes/core/frame.h"
#include "scenes/core/scene.h"

/// Points on lights, which keep their identity wherever they are seen from, and what they reflect
/// at the points of an image. Classes of their own, so that tests reach them.
namespace penumbra::restir_di {

/// A point on a light's surface, or a direction towards the environment. Densities and integrands
/// are per area on surfaces and per solid angle at infinity, so that a shift from one shading point
/// to another leaves them alone.
struct LightPoint {
  std::uint32_t light{0};
  Vec3d position{0.0};  ///< scene space; unit direction of the environment
  Vec3 normal{0.0f};    ///< of the surface, unit
  double pdf{0.0};      ///< of LightPoints::sample at the point it was drawn for; 0: no point
};

/// Draws points on all lights of a scene that have a density. A light is drawn half by its emitted
/// power, half like all others; then a point uniformly on its area, or a direction of the
/// environment by its texels. From inside a sphere, parts of which may be near without bound,
/// points are uniform in direction.
class LightPoints {
 public:
  explicit LightPoints(const Scene& scene);

  /// @param from   that is to be lit, scene space
  /// @param light  uniform in [0, 1): which light
  /// @param place  where on it
  LightPoint sample(const Vec3& from, float light, const Variates& place) const noexcept;

 private:
  const Scene* scene_;
  DiscreteDistribution choice_;  // of sampled_lights
};

/// What a light point reflects at a shading point, as far as no occluder is looked for.
struct Connection {
  Vec3 wi{0.0f};         ///< unit
  float distance{0.0f};  ///< infinite for the environment
  Rgb f{0.0f};           ///< arriving radiance x BSDF x cosine [W/(m^2 sr)]
  double geometry{0.0};  ///< solid angle of a unit of the light point's measure
  double target{0.0};    ///< luminance of f x geometry: what points are drawn in proportion to
};

/// A shading point that light points are connected to.
class Receiver {
 public:
  explicit Receiver(const Scene& scene);

  /// @param surface  values of the point's textures; nullptr: factors of 1
  void set_up(const Scene& scene, const ShadingPoint& point, const SurfaceValues* surface) noexcept;

  const ShadingPoint& point() const noexcept { return point_; }
  const Frame& frame() const noexcept { return frame_; }
  const BoundBsdf& bsdf() const noexcept { return bsdf_; }

  /// target = 0 where the light point faces away, lies below a horizon or on the far side of a
  /// sphere, or nothing is reflected.
  Connection connect(const Light& light, const LightPoint& at) const noexcept;

  /// Whether a ray along the connection that met `hit` found its light point. Rays that miss the
  /// light by rounding alone found it (LightProposal::grazes). On a mesh, which can hide parts of
  /// itself, the hit has to lie at the point's distance to kSameSurface of it.
  bool sees(const Scene& scene, const LightPoint& at, const Connection& connection,
            const RayHit& hit) const noexcept;

 private:
  ShadingPoint point_;
  Frame frame_{Vec3(0.0f, 0.0f, 1.0f)};
  BoundBsdf bsdf_;
};

/// Relative difference of distances up to which a mesh light's hit is the point aimed at.
inline constexpr float kSameSurface = 1e-4f;

}  // namespace penumbra::restir_di
