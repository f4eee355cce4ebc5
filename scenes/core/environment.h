#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scenes/core/distribution.h"
#include "scenes/core/vec.h"

/// Light from infinitely far away, tabulated over the sphere of directions.
namespace penumbra {

/// Piecewise-constant radiance on a latitude-longitude grid. Row 0 holds the pole +y, columns go
/// around it from +x over +z; a rotation moves the first of them away from +x. Texels are drawn in
/// proportion to their power (luminance x solid angle) and directions uniformly within a texel's
/// solid angle: the density is constant per texel, matches the lookup exactly and has no
/// singularity at the poles.
class Environment {
 public:
  Environment() = default;
  /// @param texels  row-major, rows x columns, finite, >= 0; may be all black
  /// @param rotation_deg  azimuth at which column 0 begins, from +x over +z; finite
  Environment(std::span<const Rgb> texels, std::uint32_t columns, std::uint32_t rows,
              double rotation_deg = 0.0);

  /// Whether there is no grid at all.
  bool empty() const noexcept { return texels_.empty(); }
  /// Whether no texel emits.
  bool black() const noexcept { return black_; }
  /// Whether a texel that emits can be above the horizon of a surface. By the rows alone, so that
  /// true may be said where the answer is no.
  /// @param normal  unit
  bool can_light(const Vec3& normal) const noexcept;
  std::uint32_t columns() const noexcept { return columns_; }
  std::uint32_t rows() const noexcept { return rows_; }

  /// Radiance that arrives from direction w [W/(m^2 sr)].
  /// @param w  unit, world orientation
  Rgb radiance(const Vec3& w) const noexcept;

  /// A direction and its density.
  struct Sample {
    Vec3 w{0.0f};       ///< unit
    float pdf_w{0.0f};  ///< of w as `pdf_w` gives it [1/sr]; 0 where rounding moved w over a border
                        ///< into a black texel
  };

  /// Direction for a point u of the unit square; uniform over the sphere where everything is black.
  Sample sample(const Vec2& u) const noexcept;
  /// Density of `sample` [1/sr]; 0 in black texels.
  float pdf_w(const Vec3& w) const noexcept;

  /// Solid angle of a texel of a row [sr].
  double texel_solid_angle(std::uint32_t row) const noexcept;
  /// Integral of the radiance over the sphere [W/m^2].
  const Vec3d& power() const noexcept { return power_; }
  /// Of texels, densities and cumulative weights.
  std::size_t memory_bytes() const noexcept;

 private:
  friend class CompensatedDensity;

  std::size_t texel(const Vec3& w) const noexcept;
  Vec3 direction(const Vec2& uv) const noexcept;
  void find_lit_rows() noexcept;

  std::uint32_t columns_{0}, rows_{0};
  double rotation_{0};  // azimuth of column 0 [rad], in [0, 2 pi]
  std::vector<Rgb> texels_;
  std::vector<float> pdfs_;           // [texel], per steradian
  PiecewiseConstant2D distribution_;  // over (column, row) coordinates in [0, 1)^2
  Vec3d power_{0.0};
  bool black_{true};
  // Polar angles between which all texels that emit lie.
  double lit_theta_min_{0.0}, lit_theta_max_{0.0};
};

/// A density of an environment for use beside another technique that covers the whole hemisphere:
/// in proportion to the luminance above its mean over the sphere, 0 where it is below. What is dim
/// and even is left to the other technique, and samples go to what is bright. Where nothing is
/// above the mean, it is the environment's own density. Source: Karlik et al. 2019, "MIS
/// compensation: Optimizing sampling techniques in multiple importance sampling".
class CompensatedDensity {
 public:
  /// @param environment  not empty; must outlive the density
  explicit CompensatedDensity(const Environment& environment);

  /// As Environment::sample.
  Environment::Sample sample(const Vec2& u) const noexcept;
  /// Density of `sample` [1/sr].
  float pdf_w(const Vec3& w) const noexcept;

 private:
  const Environment* environment_;
  std::vector<float> pdfs_;  // [texel], per steradian
  PiecewiseConstant2D distribution_;
};

}  // namespace penumbra
