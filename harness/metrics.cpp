#include "harness/metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr int kChannels = 3;

bool is_finite(const Rgb& c) {
  return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z);
}

double channel(const Rgb& c, int i) { return static_cast<double>(c[i]); }

/// Running sums over pixels and channels, before the division by their number.
struct Sums {
  double product{0};           // (x-A)(x-B)
  double squared{0};           // (x-rbar)^2
  double relative_product{0};  // (x-A)(x-B) / (rbar^2 + eps)
  double relative_absolute{0};
  double signed_error{0};
};

/// What is kept of a pixel.
struct PixelErrors {
  double squared{0};           // (x-rbar)^2, mean over channels
  double relative_squared{0};  // (x-rbar)^2 / (rbar^2 + eps), likewise
  double relative_product{0};  // (x-A)(x-B) / (rbar^2 + eps), likewise
};

/// Adds one pixel.
PixelErrors add_pixel(const Rgb& x, const Rgb& a, const Rgb& b, double relmse_offset,
                      double mape_offset, Sums& sums) {
  PixelErrors pixel;
  for (int c = 0; c < kChannels; ++c) {
    const double value = channel(x, c);
    const double half_a = channel(a, c);
    const double half_b = channel(b, c);
    const double mean = 0.5 * (half_a + half_b);
    const double product = (value - half_a) * (value - half_b);
    const double error = value - mean;
    const double scale = mean * mean + relmse_offset;
    sums.product += product;
    sums.relative_product += product / scale;
    sums.relative_absolute += std::abs(error) / (std::abs(mean) + mape_offset);
    sums.signed_error += error;
    sums.squared += error * error;
    pixel.squared += error * error / kChannels;
    pixel.relative_squared += error * error / scale / kChannels;
    pixel.relative_product += product / scale / kChannels;
  }
  return pixel;
}

/// Mean of the relative products without the worst pixels; of pixels that err alike the first ones
/// are the worst.
double trimmed_mean(std::span<const PixelErrors> pixels) {
  const auto trimmed =
      static_cast<std::size_t>(kTrimmedShare * static_cast<double>(pixels.size()) + 1e-9);
  std::vector<std::size_t> order(pixels.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto kept = order.begin() + static_cast<std::ptrdiff_t>(trimmed);
  std::nth_element(order.begin(), kept, order.end(), [&](std::size_t i, std::size_t j) {
    if (pixels[i].relative_squared != pixels[j].relative_squared) {
      return pixels[i].relative_squared > pixels[j].relative_squared;
    }
    return i < j;
  });
  std::vector<bool> left_out(pixels.size(), false);
  for (auto i = order.begin(); i != kept; ++i) left_out[*i] = true;
  // In image order, so that the sum does not depend on how the library selects.
  double sum = 0;
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    if (!left_out[p]) sum += pixels[p].relative_product;
  }
  return sum / static_cast<double>(pixels.size() - trimmed);
}

std::optional<double> share_of_reference(double variance, double mse) {
  if (!std::isfinite(mse)) return std::numeric_limits<double>::quiet_NaN();
  if (mse <= 0) return std::nullopt;
  return variance / mse;
}

constexpr std::string_view kRelmseEpsilon = "relmse_epsilon (config, 0.01) x mean(r)^2";

constexpr std::array<MetricInfo, 9> kMetrics{{
    {"mse", "MSE", "(W/(m^2 sr))^2", "mean((x-A)(x-B)), A and B the halves of the reference", "",
     true, false, [](const ImageMetrics& m) -> std::optional<double> { return m.mse; }},
    {"mse_naive", "MSE, reference noise included", "(W/(m^2 sr))^2", "mean((x-r)^2), r = (A+B)/2",
     "", true, true, [](const ImageMetrics& m) -> std::optional<double> { return m.mse_naive; }},
    {"rmse", "RMSE", "W/(m^2 sr)", "sqrt(mse)", "", true, false,
     [](const ImageMetrics& m) { return m.rmse; }},
    {"relmse", "relMSE", "1", "mean((x-A)(x-B) / (r^2 + eps))", kRelmseEpsilon, true, false,
     [](const ImageMetrics& m) { return m.relmse; }},
    {"relmse_trim", "relMSE, 1 % of the pixels trimmed", "1",
     "relmse without the 1 % of pixels of largest (x-r)^2 / (r^2 + eps)", kRelmseEpsilon, true,
     true, [](const ImageMetrics& m) { return m.relmse_trim; }},
    {"mape", "MAPE", "1", "mean(|x-r| / (|r| + eps)), not debiased", "0.01 x |mean(r)|", true, true,
     [](const ImageMetrics& m) { return m.mape; }},
    {"mean_error", "Mean error", "W/(m^2 sr)", "mean(x-r)", "", true, true,
     [](const ImageMetrics& m) -> std::optional<double> { return m.mean_error; }},
    {"p_eff", "Effective pixels", "pixels",
     "3 (sum e_p^2)^2 / sum e_p^4 - 2, e_p^2 = mean_c (x-r)^2", "", false, true,
     [](const ImageMetrics& m) { return m.p_eff; }},
    {"reference_share", "Reference share", "1", "mean((A-B)^2) / 4 / mse", "", true, true,
     [](const ImageMetrics& m) { return m.reference_share; }},
}};

}  // namespace

ReferenceNoise reference_noise(const ReferenceHalves& reference) {
  PN_CHECK(!reference.a.empty() && reference.a.size() == reference.b.size(),
           "reference halves must have one non-zero length");
  double sum = 0;
  double squared = 0;
  double mean_squared = 0;
  double fourth = 0;
  ReferenceNoise noise;
  for (std::size_t p = 0; p < reference.a.size(); ++p) {
    const Rgb& a = reference.a[p];
    const Rgb& b = reference.b[p];
    double pixel_squared = 0;
    double pixel_difference = 0;
    for (int c = 0; c < kChannels; ++c) {
      const double difference = channel(a, c) - channel(b, c);
      sum += 0.5 * (channel(a, c) + channel(b, c));
      pixel_squared += difference * difference / kChannels;
      pixel_difference += difference / kChannels;
    }
    squared += pixel_squared;
    fourth += pixel_squared * pixel_squared;
    mean_squared += 0.25 * pixel_difference * pixel_difference;
    if (!is_finite(a) || !is_finite(b)) ++noise.nonfinite;
  }
  const double pixels = static_cast<double>(reference.a.size());
  noise.mean = sum / (pixels * kChannels);
  noise.mean_se = std::sqrt(mean_squared) / pixels;
  noise.variance = 0.25 * squared / pixels;
  noise.floor = std::sqrt(fourth / 12.0) / pixels;
  return noise;
}

ImageMetrics image_metrics(std::span<const Rgb> image, const ReferenceHalves& reference,
                           double relmse_epsilon) {
  PN_CHECK(image.size() == reference.a.size(), "image and reference must have the same length");
  PN_CHECK(relmse_epsilon > 0, "the epsilon of relMSE must be positive");
  ImageMetrics metrics;
  metrics.reference = reference_noise(reference);
  const double mean = metrics.reference.mean;
  // A black reference has no relative errors; its quotients are formed with 1 and not used.
  const double relmse_offset = mean != 0 ? relmse_epsilon * mean * mean : 1.0;
  const double mape_offset = mean != 0 ? kMapeEpsilon * std::abs(mean) : 1.0;
  Sums sums;
  std::vector<PixelErrors> pixels(image.size());
  std::vector<double> squared_errors(image.size());
  for (std::size_t p = 0; p < image.size(); ++p) {
    pixels[p] =
        add_pixel(image[p], reference.a[p], reference.b[p], relmse_offset, mape_offset, sums);
    squared_errors[p] = pixels[p].squared;
    if (!is_finite(image[p])) ++metrics.nonfinite;
  }
  const double values = static_cast<double>(image.size()) * kChannels;
  metrics.mse = sums.product / values;
  metrics.mse_naive = sums.squared / values;
  metrics.mean_error = sums.signed_error / values;
  if (!(metrics.mse < 0)) metrics.rmse = std::sqrt(metrics.mse);
  if (mean != 0) {
    metrics.relmse = sums.relative_product / values;
    metrics.mape = sums.relative_absolute / values;
    // NaN has no order.
    metrics.relmse_trim = std::isfinite(sums.relative_product)
                              ? trimmed_mean(pixels)
                              : std::numeric_limits<double>::quiet_NaN();
  }
  // Naive, not debiased, squared errors: they are squares of one Gaussian per pixel, which is what
  // the factor 3 rests on; a product (x-A)(x-B) can be negative and has another fourth moment.
  // Reference noise in proportion to the render's cancels in the quotient.
  metrics.p_eff = effective_pixels(squared_errors, 1.0);
  metrics.reference_share = share_of_reference(metrics.reference.variance, metrics.mse);
  return metrics;
}

std::optional<double> effective_pixels(std::span<const double> variances,
                                       double degrees_of_freedom) {
  PN_CHECK(degrees_of_freedom > 0, "a variance estimate has at least one degree of freedom");
  double sum = 0;
  double sum_of_squares = 0;
  for (const double v : variances) {
    sum += v;
    sum_of_squares += v * v;
  }
  if (sum == 0) return std::nullopt;
  const double fourth = sum_of_squares * degrees_of_freedom / (degrees_of_freedom + 2.0);
  return sum * sum / fourth - 2.0 / degrees_of_freedom;
}

std::span<const MetricInfo> metric_table() { return kMetrics; }

const MetricInfo* find_metric(std::string_view name) {
  for (const MetricInfo& metric : kMetrics) {
    if (metric.name == name) return &metric;
  }
  return nullptr;
}

}  // namespace penumbra
