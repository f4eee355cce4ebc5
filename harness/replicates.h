#pragma once

#include <optional>
#include <span>
#include <vector>

#include "harness/bias_test.h"
#include "harness/image.h"
#include "harness/metrics.h"
#include "harness/run_row.h"

/// What the replicates of a cell, its runs with independent seeds, say beyond their errors:
/// variance and bias apart, where the noise is, and whether the bias is real. Knows numbers only.
/// Source: statistics.md 3.1 and 3.5.
namespace penumbra {

/// A reference as far as the replicates need it.
struct ReplicateReference {
  ReferenceHalves halves;
  bool exact{false};  ///< both halves are the truth itself
  /// Side of the squares [pixels], from the upper left, within which the noise of pixels may be
  /// correlated. 1: pixels are independent, 0: nowhere known to be.
  int correlated_side{1};
};

/// When the bias is tested. The test is Student's with the reference's variance in quadrature,
/// which rests on nearly Gaussian means; of skewed errors the means of small tiles are not. False
/// alarms at a level of 1 %, measured on log-normal noise in images of 48 x 32 pixels: of the whole
/// image 0.8 to 1.6 % with 5 to 8 replicates, 2.4 % with 3, 5.3 % with 2; over all tiles of 16
/// replicates 1.2 % for a skewness of 1.8, 2.0 % for 6.2 and 3.7 % for 33, and up to 33 % where a
/// skewed reference dominates, which is why it may not. On Checkerboard at 96 x 54 pixels and 4
/// estimates each, whose variance is that of 7 pixels, 1 of 60 comparisons of 16 runs of `mis`
/// rejected. So a rejection is to be confirmed with another seed before it is believed.
inline constexpr int kReplicatesForTest = 5;
inline constexpr int kReplicatesForTiles = 16;
/// Largest variance of the reference's mean over the whole image, relative to that of the
/// replicates', with which tiles are tested.
inline constexpr double kReferenceVarianceForTiles = 0.5;

/// Sides of the tiles that are tested beside the whole image [pixels].
inline constexpr int kBiasTileSides[] = {16, 8};

/// What R replicates say.
struct ReplicateSummary {
  int count{0};
  /// Mean over pixels and channels of the variance between replicates: needs no reference, and is
  /// the MSE where there is no bias.
  double variance{0};
  /// Mean over pixels and channels of (mean - A)(mean - B), less variance/R: the squared bias
  /// without the noise of runs and reference. Signed: about 0 where there is no bias.
  double bias2{0};
  std::optional<double> p_eff;  ///< effective_pixels with R-1 degrees of freedom
  Image mean;                   ///< of the replicates
  Image standard_deviation;     ///< of one replicate, per pixel and channel
  /// Against the reference, from kReplicatesForTest replicates on: the whole image and, where
  /// kReplicatesForTiles and kReferenceVarianceForTiles allow, tiles of 16 and of 8 pixels.
  std::optional<BiasTestResult> bias;
};

/// Sums over replicates, one image after the other, in double; Welford's per pixel and channel.
class ReplicateSums {
 public:
  /// @param width, height  of the images [pixels], at least 1
  ReplicateSums(int width, int height);

  /// @param image  row-major, finite
  /// @throws InputError for another number of pixels, or where a tile's mean is not finite
  void add(std::span<const Rgb> image);

  int count() const { return static_cast<int>(tiles_.count()); }

  /// @param reference  of the same size
  /// @throws InputError for fewer than two replicates or another size
  ReplicateSummary summary(const ReplicateReference& reference) const;

 private:
  int width_, height_;
  std::vector<Vec3d> mean_;     // [pixel]
  std::vector<Vec3d> squares_;  // [pixel], sums of squared deviations from the mean
  std::vector<Vec3d> widened_;  // one image, to be reduced to tiles
  TileReplicates tiles_;
};

/// Mean of a reference in each tile, with the variance of that mean.
///
/// A pixel's mean of halves has the variance (A-B)^2/4, one degree of freedom each; over a tile's n
/// pixels their sum divided by n^2 is the variance of the tile's mean, provided that the noise of
/// different pixels is independent. Where it is so only between squares of `correlated_side`, the
/// squares' sums of differences take the place of the pixels'. The degrees of freedom are the
/// effective number of pixels or squares, because a few of them can dominate the sum; one that all
/// depends on a single square has 1. An exact reference has no variance.
/// @param width  of the image [pixels]
std::vector<MeanEstimate> tile_estimates(const ReplicateReference& reference, int width,
                                         std::span<const BiasTile> tiles);

/// Tests the bias of replicates: of the whole image and, with enough of them and a reference that
/// is quiet enough, of all tiles.
/// @param tiles  of `bias_tiles` with kBiasTileSides; width, height of the image [pixels]
/// @return nullopt for fewer than kReplicatesForTest
std::optional<BiasTestResult> test_bias(const TileReplicates& tiles,
                                        const ReplicateReference& reference, int width, int height);

/// Fills the columns of a cell that its replicates decide.
void add_replicates(EfficiencyRow& row, const ReplicateSummary& summary);

}  // namespace penumbra
