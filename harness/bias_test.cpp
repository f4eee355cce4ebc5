#include "harness/bias_test.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

bool same_tiles(std::span<const BiasTile> a, std::span<const BiasTile> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const BiasTile& x, const BiasTile& y) { return x.rect == y.rect; });
}

double mean_of(std::span<const Vec3d> pixels, int width, const PixelRect& rect) {
  double sum = 0;
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      const Vec3d& pixel = pixels[pixel_index(width, x, y)];
      sum += pixel.x + pixel.y + pixel.z;
    }
  }
  return sum / (3.0 * rect.width * rect.height);
}

std::string name_of(const BiasTile& tile) {
  if (tile.side == 0) return "whole image";
  return fmt::format("tile of {} at ({}, {})", tile.side, tile.rect.x, tile.rect.y);
}

MeanEstimate estimate_of(const TileReplicates& replicates, std::size_t tile) {
  Welford values;
  for (std::size_t r = 0; r < replicates.count(); ++r) values.add(replicates.replicate(r)[tile]);
  if (replicates.is_exact()) return {values.mean(), 0, 0};
  const auto n = static_cast<double>(values.count());
  return {values.mean(), values.variance().value() / n, n - 1};
}

// Satterthwaite's degrees of freedom of a sum of two independent variances.
double joint_degrees(double variance_a, double dof_a, double variance_b, double dof_b) {
  const double sum = variance_a + variance_b;
  // As shares, because squares of small variances underflow.
  const double a = variance_a / sum;
  const double b = variance_b / sum;
  return 1.0 / ((dof_a > 0 ? a * a / dof_a : 0) + (dof_b > 0 ? b * b / dof_b : 0));
}

std::optional<RelativeBias> relative_bias(const MeanEstimate& a, const MeanEstimate& b,
                                          const BiasTestOptions& options) {
  if (!(b.mean > 0)) return std::nullopt;
  RelativeBias result;
  const double ratio = a.mean / b.mean;
  result.value = ratio - 1;
  const double from_a = a.variance_of_mean / (b.mean * b.mean);
  const double from_b = ratio * ratio * b.variance_of_mean / (b.mean * b.mean);
  result.standard_error = std::sqrt(from_a + from_b);
  double half_width = 0;
  if (result.standard_error > 0) {
    const double dof = joint_degrees(from_a, a.degrees_of_freedom, from_b, b.degrees_of_freedom);
    half_width = student_t_quantile(1 - options.equivalence_level, dof) * result.standard_error;
  }
  result.interval = {result.value - half_width, result.value + half_width};
  result.shown_small = result.interval.lo > -options.equivalence_margin &&
                       result.interval.hi < options.equivalence_margin;
  return result;
}

void check_options(const BiasTestOptions& o) {
  const auto require = [](bool holds, const char* name, double found, const char* allowed) {
    if (!holds) {
      throw InputError(fmt::format("bias test: {} = {}, allowed is {}", name, found, allowed));
    }
  };
  require(o.level > 0 && o.level < 1, "level", o.level, "more than 0 and less than 1");
  require(o.tolerance >= 0 && std::isfinite(o.tolerance), "tolerance", o.tolerance,
          "0 or more, finite");
  require(o.equivalence_margin > 0, "equivalence_margin", o.equivalence_margin, "more than 0");
  require(o.equivalence_level > 0 && o.equivalence_level < 0.5, "equivalence_level",
          o.equivalence_level, "more than 0 and less than 0.5");
}

void check_replicates(const TileReplicates& side) {
  if (side.is_exact() || side.count() >= 2) return;
  throw InputError(
      fmt::format("bias test: {} replicates, allowed are 2 or more, because one has no variance",
                  side.count()));
}

void check_sides(const TileReplicates& a, const TileReplicates& b) {
  if (a.tiles().empty() || !same_tiles(a.tiles(), b.tiles())) {
    throw InputError(
        fmt::format("bias test: the sides have {} and {} tiles, allowed are equal "
                    "tiles, at least one",
                    a.tiles().size(), b.tiles().size()));
  }
  check_replicates(a);
  check_replicates(b);
  if (a.is_exact() && b.is_exact()) {
    throw InputError("bias test: both sides are exact, allowed is one");
  }
}

}  // namespace

std::vector<BiasTile> bias_tiles(int width, int height, std::span<const int> sides) {
  if (width < 1 || height < 1) {
    throw InputError(
        fmt::format("bias test: an image of {}x{} pixels, allowed is 1x1 or more", width, height));
  }
  std::vector<BiasTile> tiles{{0, {0, 0, width, height}}};
  for (const int side : sides) {
    if (side < 1) {
      throw InputError(fmt::format("bias test: tiles of side {}, allowed is 1 or more", side));
    }
    if (side >= width && side >= height) continue;
    for (int y = 0; y < height; y += side) {
      for (int x = 0; x < width; x += side) {
        tiles.push_back({side, {x, y, std::min(side, width - x), std::min(side, height - y)}});
      }
    }
  }
  return tiles;
}

TileReplicates::TileReplicates(std::vector<BiasTile> tiles) : tiles_(std::move(tiles)) {}

TileReplicates TileReplicates::exact(std::vector<BiasTile> tiles, std::span<const Vec3d> pixels) {
  TileReplicates result(std::move(tiles));
  result.add(pixels);
  result.exact_ = true;
  return result;
}

void TileReplicates::add(std::span<const Vec3d> pixels) {
  const PixelRect whole = tiles_.empty() ? PixelRect{} : tiles_.front().rect;
  const std::size_t expected =
      static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height);
  if (pixels.size() != expected) {
    throw InputError(fmt::format("bias test: a replicate of {} pixels, allowed are {}x{}",
                                 pixels.size(), whole.width, whole.height));
  }
  std::vector<double> values;
  values.reserve(tiles_.size());
  for (const BiasTile& tile : tiles_) values.push_back(mean_of(pixels, whole.width, tile.rect));
  add_values(values);
}

void TileReplicates::add_values(std::span<const double> values) {
  if (exact_) throw InputError("bias test: a second replicate of an exact image, allowed is one");
  if (values.size() != tiles_.size()) {
    throw InputError(
        fmt::format("bias test: a replicate of {} values, allowed is one for each of "
                    "{} tiles",
                    values.size(), tiles_.size()));
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    throw InputError(fmt::format("bias test: replicate {}, {}: mean {}, allowed are finite values",
                                 values_.size(), name_of(tiles_[i]), values[i]));
  }
  values_.emplace_back(values.begin(), values.end());
}

WelchTest welch_test(const MeanEstimate& a, const MeanEstimate& b, double tolerance) {
  WelchTest result;
  result.difference = a.mean - b.mean;
  const double variance = a.variance_of_mean + b.variance_of_mean;
  result.standard_error = std::sqrt(variance);
  const double beyond = std::max(0.0, std::abs(result.difference) - tolerance);
  if (!(variance > 0)) {
    result.t = beyond > 0
                   ? std::copysign(std::numeric_limits<double>::infinity(), result.difference)
                   : 0.0;
    result.p = beyond > 0 ? 0.0 : 1.0;
    return result;
  }
  result.t = std::copysign(beyond / result.standard_error, result.difference);
  result.degrees_of_freedom = joint_degrees(a.variance_of_mean, a.degrees_of_freedom,
                                            b.variance_of_mean, b.degrees_of_freedom);
  result.p = student_t_two_sided_p(result.t, result.degrees_of_freedom);
  return result;
}

BiasTestResult bias_test(const TileReplicates& a, const TileReplicates& b,
                         const BiasTestOptions& options) {
  check_sides(a, b);
  std::vector<MeanEstimate> estimates;
  for (std::size_t i = 0; i < b.tiles().size(); ++i) estimates.push_back(estimate_of(b, i));
  return bias_test(a, estimates, options);
}

BiasTestResult bias_test(const TileReplicates& a, std::span<const MeanEstimate> b,
                         const BiasTestOptions& options) {
  check_options(options);
  check_replicates(a);
  if (b.empty() || b.size() != a.tiles().size()) {
    throw InputError(fmt::format("bias test: {} means for {} tiles, allowed is one for each",
                                 b.size(), a.tiles().size()));
  }
  BiasTestResult result;
  const double tolerance = options.tolerance * std::abs(b[0].mean);
  std::vector<double> p;
  for (std::size_t i = 0; i < a.tiles().size(); ++i) {
    const WelchTest test = welch_test(estimate_of(a, i), b[i], tolerance);
    result.tiles.push_back({a.tiles()[i], test, 1});
    p.push_back(test.p);
    const auto bin = static_cast<std::size_t>(test.p * static_cast<double>(kPValueBins));
    ++result.p_histogram[std::min(bin, kPValueBins - 1)];
  }
  const std::vector<double> adjusted = holm_adjusted(p);
  for (std::size_t i = 0; i < adjusted.size(); ++i) result.tiles[i].adjusted_p = adjusted[i];
  // Certain differences all have p = 0; among equals the largest |t| and then the larger tile.
  const auto less = [](const TileResult& x, const TileResult& y) {
    if (x.test.p != y.test.p) return x.test.p < y.test.p;
    return std::abs(x.test.t) > std::abs(y.test.t);
  };
  result.worst = static_cast<std::size_t>(
      std::min_element(result.tiles.begin(), result.tiles.end(), less) - result.tiles.begin());
  result.smallest_p = result.worst_tile().adjusted_p;
  result.rejected = result.smallest_p <= options.level;
  result.relative_bias = relative_bias(estimate_of(a, 0), b[0], options);
  return result;
}

std::string describe(const BiasTestResult& result) {
  const TileResult& worst = result.worst_tile();
  std::string text = fmt::format(
      "{}: smallest adjusted p {:.2e}, {}: difference {:.3e} (se {:.1e}, t {:.2f})",
      result.rejected ? "rejected" : "not rejected", result.smallest_p, name_of(worst.tile),
      worst.test.difference, worst.test.standard_error, worst.test.t);
  if (!result.relative_bias) return text + "; no relative bias, the image is black";
  const RelativeBias& bias = *result.relative_bias;
  return text + fmt::format("; relative bias {:+.3f} % [{:+.3f}, {:+.3f}], {}", 100 * bias.value,
                            100 * bias.interval.lo, 100 * bias.interval.hi,
                            bias.shown_small ? "shown to be small" : "not shown to be small");
}

}  // namespace penumbra
