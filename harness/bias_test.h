#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/image.h"
#include "harness/statistics.h"
#include "scenes/core/vec.h"

/// Whether two ways to make the same image have the same mean, judged by independent replicates of
/// tile means. Knows numbers only. Source: statistics.md 3.5.
namespace penumbra {

/// One rectangle of pixels whose mean over pixels and channels is tested.
struct BiasTile {
  int side{0};  ///< side of its scale's tiles [pixels]; 0: the whole image
  PixelRect rect;
};

/// The whole image, then the tiles of each scale row by row; tiles at the right and lower border
/// are smaller where the side does not divide the image.
/// @param width, height  of the image [pixels], at least 1
/// @param sides  of the other scales [pixels], at least 1; a scale whose tile would be the whole
///               image is left out, because it is tested already
/// @throws InputError for a size or a side below 1
std::vector<BiasTile> bias_tiles(int width, int height, std::span<const int> sides);

/// Independent replicates of one method, each reduced to one value per tile.
class TileReplicates {
 public:
  /// @param tiles  of `bias_tiles`; the first one is the whole image
  explicit TileReplicates(std::vector<BiasTile> tiles);

  /// An image without noise, known exactly: one replicate of variance 0.
  /// @throws InputError as `add`
  static TileReplicates exact(std::vector<BiasTile> tiles, std::span<const Vec3d> pixels);

  /// Adds a replicate: per tile the mean over pixels and channels.
  /// @param pixels  row-major, as many as the whole image has
  /// @throws InputError for another number of pixels, or where a tile's mean is not finite
  void add(std::span<const Vec3d> pixels);

  /// Adds a replicate that is reduced already.
  /// @param values  [tile]
  /// @throws InputError for another number of values, or where one is not finite
  void add_values(std::span<const double> values);

  std::span<const BiasTile> tiles() const { return tiles_; }
  /// Values of one replicate, [tile].
  std::span<const double> replicate(std::size_t index) const { return values_[index]; }
  std::size_t count() const { return values_.size(); }
  bool is_exact() const { return exact_; }

 private:
  std::vector<BiasTile> tiles_;
  std::vector<std::vector<double>> values_;  // [replicate][tile]
  bool exact_{false};
};

/// Welch's test of "two means are equal".
struct WelchTest {
  double difference{0};          ///< mean of a - mean of b
  double standard_error{0};      ///< of the difference
  double t{0};                   ///< 0 where nothing differs, infinite where nothing varies but the
                                 ///< means differ
  double degrees_of_freedom{0};  ///< Welch-Satterthwaite; 0 where nothing varies
  double p{1};                   ///< two-sided
};

/// Mean and variance of the mean of one side of a comparison.
struct MeanEstimate {
  double mean{0};
  double variance_of_mean{0};
  double degrees_of_freedom{0};  ///< of the variance; 0 for a mean that is known exactly
};

/// Tests |mean of a - mean of b| <= tolerance by a t statistic of what goes beyond the tolerance.
/// Without any variance the answer is certain: p = 1 within the tolerance, p = 0 outside.
/// @param tolerance  at least 0, in the unit of the means
/// Source: Welch 1947, "The generalization of 'Student's' problem when several different population
/// variances are involved"; Satterthwaite 1946.
WelchTest welch_test(const MeanEstimate& a, const MeanEstimate& b, double tolerance = 0);

struct BiasTestOptions {
  double level{0.01};  ///< family-wise, over all scales and tiles
  /// Differences up to this share of the whole image's mean count as none: float arithmetic in
  /// another order, and tiles too dark to matter.
  double tolerance{0};
  double equivalence_margin{0.005};  ///< of the relative bias of the whole image
  double equivalence_level{0.05};    ///< of each of the two one-sided tests
};

/// One tile's test.
struct TileResult {
  BiasTile tile;
  WelchTest test;
  double adjusted_p{1};  ///< by Holm over all tiles of all scales
};

/// Relative difference of the means of the whole image, mean(a) / mean(b) - 1.
struct RelativeBias {
  double value{0};
  double standard_error{0};  ///< by the delta method
  Interval interval;         ///< of confidence 1 - 2 equivalence_level
  bool shown_small{false};   ///< the interval is inside +-equivalence_margin: both one-sided tests
                             ///< reject a larger bias (TOST). Otherwise it is "not shown".
};

inline constexpr std::size_t kPValueBins = 20;

struct BiasTestResult {
  bool rejected{false};  ///< smallest_adjusted_p <= level
  double smallest_p{1};  ///< over all tiles, adjusted by Holm
  std::size_t worst{0};  ///< index of the tile with the smallest p in `tiles`
  std::vector<TileResult> tiles;
  std::optional<RelativeBias> relative_bias;  ///< empty where the mean of b is not positive
  std::array<std::uint32_t, kPValueBins> p_histogram{};  ///< of unadjusted p, equal bins of [0, 1]

  const TileResult& worst_tile() const { return tiles[worst]; }
};

/// Tests whether `a` and `b` have the same mean in every tile of every scale: Welch's t on
/// replicates, Holm over all tiles and scales.
/// @param a, b  independent of each other, with the same tiles and, unless exact, two replicates or
///              more; not both exact
/// @throws InputError where that is not so, or where an option is out of its range
BiasTestResult bias_test(const TileReplicates& a, const TileReplicates& b,
                         const BiasTestOptions& options = {});

/// The same against means that are known with their uncertainty.
/// @param b  [tile], of a's tiles
/// @throws InputError likewise
BiasTestResult bias_test(const TileReplicates& a, std::span<const MeanEstimate> b,
                         const BiasTestOptions& options = {});

/// One line for a report: the verdict, the smallest p, the worst tile with its difference and t,
/// the relative bias with its interval and whether it is shown to be small.
std::string describe(const BiasTestResult& result);

}  // namespace penumbra
