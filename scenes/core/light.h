#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scenes/core/block.h"
#include "scenes/core/distribution.h"
#include "scenes/core/environment.h"
#include "scenes/core/ray_batch.h"
#include "scenes/core/sampler.h"
#include "scenes/core/vec.h"

/// Lights, and the densities over directions by which estimators sample them.
namespace penumbra {

enum class LightType : std::uint8_t {
  Rectangle,
  Sphere,
  Mesh,
  Environment,  ///< light from infinitely far away, where a ray meets nothing
  Point,        ///< a position: no direction sampling can find it
  Spot,         ///< a position that shines into a cone
  Directional,  ///< one direction, from infinitely far away
};

/// How a direction towards a light is drawn where there is a choice.
enum class LightSampling : std::uint8_t {
  Area,        ///< uniform point on the surface
  SolidAngle,  ///< uniform direction in the solid angle where a closed form exists (rectangle,
               ///< sphere)
  Cosine,      ///< of rectangles: the solid angle, warped by the cosines at the receiver
};

std::string_view to_string(LightSampling sampling);

/// Bounds of a mesh's geometric normals, and of the mesh along their axis.
struct NormalBounds {
  Vec3d axis{0.0};      ///< unit
  double cosine{-1.0};  ///< of the largest angle between the axis and a normal; <= 0: no bounds
  double sine{0.0};
  double lowest{0.0};  ///< smallest coordinate of a vertex along the axis

  /// Whether every triangle certainly turns its back to a point.
  bool all_face_away_from(const Vec3& point, double farthest_vertex) const noexcept;
};

/// One light in scene space; immutable after loading. Emission is constant over a shape's surface.
struct Light {
  LightType type{LightType::Rectangle};
  bool two_sided{false};
  std::string name;
  Rgb radiance{0.0f};    ///< of shapes [W/(m^2 sr)]
  Rgb irradiance{0.0f};  ///< of a directional light, on a surface that faces it [W/m^2]
  Vec3d intensity{0.0};  ///< of point and spot, RGB: irradiance x distance^2 in scene units;
                         ///< double, because the square of a scale can leave the range of float
  double area{0.0};      ///< of shapes, in scene units squared

  Vec3 origin{0.0f}, edge_u{0.0f}, edge_v{0.0f};  ///< rectangle: corner and perpendicular edges
  Vec3 normal{0.0f};                              ///< rectangle: unit, edge_u x edge_v
  Vec3d plane_normal{0.0};                        ///< rectangle: the same before rounding
  Vec3 center{0.0f};                              ///< sphere, point, spot
  float radius{0.0f};                             ///< sphere
  std::vector<Vec3> vertices;                     ///< mesh: three per triangle
  DiscreteDistribution triangle_areas;            ///< mesh
  NormalBounds normal_bounds;                     ///< mesh
  /// Mesh of many triangles: its own ray scene, which finds all crossings of a ray; owned by the
  /// Scene. nullptr: few triangles, all are tried.
  const RayScene* crossings{nullptr};
  Environment environment;  ///< environment
  Vec3d axis{0.0};          ///< spot, directional: unit, in which the light travels
  /// Spot: 1 - cos of the half angles of the undimmed part and of the whole cone. Not the cosines,
  /// which have no digits left for narrow cones.
  double inner_depth{0.0}, outer_depth{0.0};
  Vec3 bounds_min{0.0f}, bounds_max{0.0f};  ///< box around the shape; unused at infinity

  /// Whether the light has no density over directions. Estimators then add its radiance apart from
  /// everything they sample (`sample_delta`), with one ray.
  bool is_delta() const noexcept {
    return type == LightType::Point || type == LightType::Spot || type == LightType::Directional;
  }

  /// Radiance that arrives along a ray of unit direction `wi` that ends at this light's emitting
  /// side [W/(m^2 sr)].
  Rgb radiance_along(const Vec3& wi) const noexcept {
    return type == LightType::Environment ? environment.radiance(wi) : radiance;
  }

  /// Whether the side that faces against direction `w` emits.
  /// @param geometric_normal  of the point hit, any length
  bool emits_against(const Vec3& w, const Vec3& geometric_normal) const noexcept {
    return two_sided || dot(w, geometric_normal) < 0.0f;
  }
};

/// The one direction towards a delta light.
struct DeltaSample {
  Vec3 wi{0.0f};         ///< unit
  float distance{0.0f};  ///< a ray that meets nothing nearer sees the light; may be infinite
  Rgb irradiance{0.0f};  ///< on a surface that faces wi, without occlusion [W/m^2]
};

/// @param normal  geometric normal on the side of the viewer
/// @return nullopt where the light is not above the horizon, is at `from` itself, or `from` is
///         outside a spot light's cone
std::optional<DeltaSample> sample_delta(const Light& light, const Vec3& from,
                                        const Vec3& normal) noexcept;

/// Directions about an axis.
struct DirectionCone {
  Vec3 axis{0.0f, 0.0f, 1.0f};  ///< unit
  float one_minus_cos{3.0f};    ///< of the half angle; above 2: every direction
};

/// The directions that can meet a sphere, a little wider than the rounding of a direction.
DirectionCone cone_around(const Vec3d& to_middle, double radius) noexcept;

struct LightSample {
  Vec3 wi{0.0f};      ///< unit, towards the light
  float pdf_w{0.0f};  ///< per steradian, summed over all points of this light along wi
};

/// A light as seen from one point: the density h_l(w) over directions, which ignores occluders and
/// other lights. Set up once per point and light; sampling and evaluation are then cheap.
class LightProposal {
 public:
  LightProposal() = default;

  /// @param light     not a delta light
  /// @param from      origin of the rays, scene space
  /// @param normal    geometric normal on the side of the viewer
  /// @param keep_all  also sets up lights that can not contribute, where they have a density at all
  /// @return false where the light can not contribute: wholly below the horizon, seen edge-on or
  /// from behind, black. The decision depends on the point alone, so leaving the light out does not
  /// bias anything.
  bool set_up(const Light& light, LightSampling sampling, const Vec3& from, const Vec3& normal,
              bool keep_all = false) noexcept;

  const Light& light() const noexcept { return *light_; }

  /// Draws an environment by another density from now on; directions outside of it may still bring
  /// light. After set_up.
  /// @param density  of this light's environment; must outlive the proposal
  void compensate(const CompensatedDensity& density) noexcept { compensated_ = &density; }

  std::optional<LightSample> sample(const Variates& variates) const noexcept;

  /// Density of `sample` for a unit direction; positive exactly where the ray from the point meets
  /// the light's surface.
  float pdf_w(const Vec3& wi) const noexcept;

  /// `sample` for the variates of lanes [at, at + count), into the same lanes. Where there is no
  /// direction, wi is 0.
  void sample(const VariateBlock& variates, std::size_t count, std::size_t at, VectorBlock& wi,
              Block<float>& pdf) const noexcept;

  /// `pdf_w` of the directions in lanes [0, count).
  void pdf_w(const VectorBlock& wi, std::size_t count, Block<float>& pdf) const noexcept;

  /// Whether `sample` reads `Variates::choice`.
  bool uses_choice() const noexcept { return mode_ == Mode::Mesh; }

  /// Whether a ray that met something else, or nothing, missed the light by no more than the
  /// rounding of directions and vertices: it passes the outline within that, on the emitting side,
  /// and nothing nearer stops it. So do rays to points next to the outline, and to all points of a
  /// light that is smaller than the rounding. Never for lights that are neither rectangle nor
  /// sphere.
  /// @param wi             unit
  /// @param free_distance  to what the ray met; infinite where it met nothing
  bool grazes(const Vec3& wi, float free_distance) const noexcept;

  /// A cone outside of which the density is 0; a little wider than the rounding of directions.
  DirectionCone directions() const noexcept;

 private:
  struct Rectangle;
  Rectangle rectangle() const noexcept;
  enum class Mode : std::uint8_t {
    RectangleArea,
    RectangleAngle,
    RectangleCosine,
    SphereCone,
    SphereInside,
    Mesh,
    Environment,
  };

  bool grazes_rectangle(const Vec3d& wi, double free_distance) const noexcept;
  bool grazes_sphere(const Vec3d& wi, double free_distance) const noexcept;
  bool set_up_rectangle(LightSampling sampling, const Vec3& normal, bool keep_all) noexcept;
  void set_up_cosines(const Vec3& normal) noexcept;
  bool set_up_sphere(bool keep_all) noexcept;
  bool set_up_mesh(const Vec3& normal, bool keep_all) noexcept;
  bool is_rectangle() const noexcept {
    return mode_ == Mode::RectangleArea || mode_ == Mode::RectangleAngle ||
           mode_ == Mode::RectangleCosine;
  }
  LightSample sample_rectangle_angle(double u, double v) const noexcept;
  LightSample sample_rectangle_cosine(const Vec2& u) const noexcept;
  double cosine_warp(const Vec3& wi) const noexcept;
  float mesh_pdf_w(const Vec3& wi) const noexcept;

  const Light* light_{nullptr};
  Vec3 from_{0.0f};
  Mode mode_{Mode::RectangleArea};

  // Rectangle. Area: density of w is t^2/(A |cos|) = t^3/(A height) with t the distance along w.
  Vec3 to_origin_{0.0f};  // origin - from
  float height_{0};       // dot(normal, to_origin_): signed distance of the plane
  float inv_length2_u_{0}, inv_length2_v_{0};
  float inv_area_height_{0};  // 1/(area |height|)
  // Rectangle by solid angle, in double: angles differ from sums of right angles by the solid angle
  // only.
  Vec3d axis_x_{0.0}, axis_y_{0.0}, axis_z_{0.0};
  double x0_{0}, x1_{0}, y0_{0}, y1_{0}, z0_{0};
  double b0_{0}, b1_{0}, k_{0}, solid_angle_{0};
  float pdf_constant_{0};  // 1/solid angle, of the rectangle or the sphere's cone
  // Rectangle by cosines: bilinear density over the square of the above at its corners (0, 0),
  // (1, 0), (0, 1), (1, 1); their mean is 1.
  double corner_[4]{};

  // Sphere, and for a mesh the sphere around its box.
  Vec3 axis_{0.0f};  // unit, towards the centre
  float one_minus_cos_{0};

  const CompensatedDensity* compensated_{nullptr};  // of an environment
};

}  // namespace penumbra
