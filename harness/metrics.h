#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "scenes/core/vec.h"

/// The error of one image against a reference that is stored as two independent halves.
/// Source: statistics.md 3.1. Nothing is clamped: a non-finite pixel makes the sums non-finite.
namespace penumbra {

/// Two independent, unbiased images of the same scene; row-major, same length as the image
/// measured. The reference itself is their mean, rbar.
struct ReferenceHalves {
  std::span<const Rgb> a;
  std::span<const Rgb> b;
};

/// What the two halves say about the reference alone.
struct ReferenceNoise {
  double mean{0};            ///< mean of rbar over pixels and channels [W/(m^2 sr)]
  double mean_se{0};         ///< standard error of `mean`, for pixels that are independent
  double variance{0};        ///< mean((A-B)^2)/4, the mean variance of rbar
  double floor{0};           ///< u_ref, see reference_noise
  std::size_t nonfinite{0};  ///< pixels that are not finite in A or in B
};

/// Mean, noise and the floor u_ref = (1/P) sqrt(sum_p s_A^2 s_B^2) that the reference puts under
/// every debiased MSE. It is common to all replicates and methods, so it does not average out with
/// more blocks.
///
/// s_A^2 s_B^2 of a pixel is taken from its one difference d = A-B: for halves of equal variance
/// s^2, E[d^4] = 12 s^4. Channels count as fully correlated (grey noise), which can only overstate
/// the floor.
/// @param reference  halves of equal, non-zero length
ReferenceNoise reference_noise(const ReferenceHalves& reference);

/// Shares of a reference's variance in a measured error above which it is warned, and
/// above which there is no efficiency. Source: statistics.md 3.1.
inline constexpr double kShareToWarn = 0.05;
inline constexpr double kShareToRefuse = 0.5;

/// Effective pixels (p_eff) below which too few of them decide the MSE.
inline constexpr double kFewPixels = 200;

/// All errors of one image. Means are over pixels and the 3 channels.
struct ImageMetrics {
  double mse{
      0};  ///< debiased: mean of (x-A)(x-B); <= 0 is possible and means: below reference noise
  double mse_naive{0};         ///< mean of (x-rbar)^2 = mse + reference variance
  std::optional<double> rmse;  ///< sqrt(mse); empty when mse < 0
  std::optional<double>
      relmse;  ///< mean of (x-A)(x-B)/(rbar^2 + eps mean(rbar)^2); empty: black reference
  std::optional<double> relmse_trim;  ///< relmse without the kTrimmedShare of worst pixels
  std::optional<double>
      mape;  ///< mean of |x-rbar|/(|rbar| + kMapeEpsilon mean(rbar)), a fraction; empty likewise
  double mean_error{0};         ///< signed mean of x-rbar [W/(m^2 sr)]
  std::optional<double> p_eff;  ///< see effective_pixels; empty when x equals rbar everywhere
  std::optional<double> reference_share;  ///< reference variance / mse; empty when mse <= 0
  ReferenceNoise reference;
  std::size_t nonfinite{0};  ///< pixels of the image with a channel that is not finite
};

/// MAPE's epsilon, relative to the mean of the reference. MAPE is not debiased: |x-rbar| has no
/// two-halves form.
inline constexpr double kMapeEpsilon = 0.01;

/// Share of pixels that relmse_trim leaves out: those of the largest (x-rbar)^2/(rbar^2 + eps
/// mean(rbar)^2), mean over channels. The remaining ones are debiased as ever. Trimming changes
/// what is estimated, by an amount that depends on the method and on its number of samples, so this
/// is for looking at outliers and decides nothing.
inline constexpr double kTrimmedShare = 0.01;

/// Measures one image. relMSE and MAPE share rbar and the epsilon over all methods, zero-reference
/// pixels are kept; their denominator contains the reference's own noise, so they are debiased in
/// the numerator only.
/// @param image           row-major, same length as both halves
/// @param relmse_epsilon  > 0, relative to mean(rbar)^2
ImageMetrics image_metrics(std::span<const Rgb> image, const ReferenceHalves& reference,
                           double relmse_epsilon);

/// The number of pixels that really decide an MSE, P_eff = (sum s_p^2)^2 / sum s_p^4, so that the
/// relative standard deviation of the MSE is sqrt(2 / P_eff).
///
/// The true variances s_p^2 are known only through estimates v_p with nu degrees of freedom. For
/// Gaussian errors E[v^2] = s^4 (nu+2)/nu, hence with Q = nu/(nu+2) sum v^2 an unbiased estimate of
/// sum s^4 is Q, of (sum s^2)^2 it is (sum v)^2 - (2/nu) Q, and their quotient is returned. One
/// render has nu = 1, v_p = e_p^2: this is the factor 3 of E[e^4] = 3 s^4. Errors with heavier
/// tails than a Gaussian lower the result, as they should: they do widen the spread of the MSE.
/// Never below 1 for nu = 1; may exceed the pixel count by chance.
/// @param variances           v_p >= 0 per pixel, mean over channels
/// @param degrees_of_freedom  1 for the squared errors of one render, R-1 for variances of R
/// replicates
/// @return empty when all variances are 0
/// Source: statistics.md 3.1.
std::optional<double> effective_pixels(std::span<const double> variances,
                                       double degrees_of_freedom);

/// One metric of an image: everything that prints a metric takes its names from here.
struct MetricInfo {
  std::string_view name;   ///< column of measurements.csv (rmse, a root of mse, has none)
  std::string_view label;  ///< of a plot's axis
  std::string_view unit;   ///< "1" when it has none
  std::string_view formula;
  std::string_view epsilon;    ///< that the formula adds to a denominator; empty: none
  bool lower_is_better{true};  ///< of the absolute value, where the metric is signed
  bool diagnostic{false};      ///< explains an error; decides no efficiency, verdict or gate
  std::optional<double> (*value)(const ImageMetrics&){nullptr};
};

/// All metrics, in the order in which they are listed; what `penumbra list metrics` prints.
std::span<const MetricInfo> metric_table();

/// @return nullptr when there is none of that name
const MetricInfo* find_metric(std::string_view name);

}  // namespace penumbra
