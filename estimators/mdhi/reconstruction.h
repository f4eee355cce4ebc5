#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scenes/core/vec.h"

/// The anisotropic reconstruction of MDHI over one chart.
namespace penumbra::mdhi {

/// Divides a unit square among the samples in it: a place takes the value of the sample that is
/// nearest in the sample's own metric, which reaches far where the function is flat.
///
/// Metric of sample i: from its 5 nearest neighbours (fewer where there are fewer samples) the
/// least-squares gradient; G, the mean of grad grad^T over i and its neighbours, is the structure
/// tensor; with its unit eigenvectors a, b and eigenvalues l_a >= l_b
///   M_i = r a a^T + 1/r b b^T,  r = min(4, sqrt((l_a + e)/(l_b + e))),  e = (1e-3 mean value)^2.
/// Below 3 neighbours, and where the mean value is 0, M_i is the identity. Neighbours on one line
/// determine no gradient, which is then taken as 0.
/// Source: Hachisuka et al. 2008, section on reconstruction; the constants are this project's.
class AnisotropicCells {
 public:
  /// Takes the memory for this many samples.
  explicit AnisotropicCells(std::size_t max_samples);

  /// Shares of the square, on the centres of a grid of 16 x 16 cells, or more for 4 cells per
  /// sample; their sum is 1.
  /// @param positions  [sample], in [0, 1)^2, at least one
  /// @param values     [sample], finite, >= 0
  /// @param shares     [sample], written
  void shares(std::span<const Vec2> positions, std::span<const double> values,
              std::span<double> shares) noexcept;

 private:
  static constexpr std::size_t kNeighbours = 5;
  using Neighbours = std::array<std::uint32_t, kNeighbours>;

  /// Symmetric 2 x 2 matrix.
  struct Tensor {
    double xx, xy, yy;
  };

  void find_neighbours(std::span<const Vec2> positions, std::size_t count) noexcept;
  void fit_gradients(std::span<const Vec2> positions, std::span<const double> values,
                     std::size_t count) noexcept;
  std::size_t nearest(std::span<const Vec2> positions, double x, double y) const noexcept;
  Tensor metric(std::size_t sample, std::size_t count, double floor) const noexcept;

  std::vector<Neighbours> neighbours_;            // [sample]
  std::vector<std::array<double, 2>> gradients_;  // [sample]
  std::vector<Tensor> metrics_;                   // [sample]
};

}  // namespace penumbra::mdhi
