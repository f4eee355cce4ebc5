#include "harness/image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

bool is_finite(float value) { return std::isfinite(value); }
bool is_finite(const Rgb& value) {
  return std::isfinite(value.x) && std::isfinite(value.y) && std::isfinite(value.z);
}

// Sums over pixels are kept in double: a 4K image has too many pixels for float.
double to_double(float value) { return static_cast<double>(value); }
Vec3d to_double(const Rgb& value) { return Vec3d(value); }
void store(double value, float& pixel) { pixel = static_cast<float>(value); }
void store(const Vec3d& value, Rgb& pixel) {
  pixel =
      Rgb(static_cast<float>(value.x), static_cast<float>(value.y), static_cast<float>(value.z));
}

template <class Picture>
Picture sized_like(const Picture&, int width, int height) {
  Picture result{width, height, {}};
  result.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  return result;
}

template <class Picture>
bool well_formed(const Picture& image) {
  return image.width >= 1 && image.height >= 1 &&
         image.pixels.size() ==
             static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
}

template <class Picture>
std::size_t count_bad(const Picture& image) {
  return static_cast<std::size_t>(std::count_if(image.pixels.begin(), image.pixels.end(),
                                                [](const auto& p) { return !is_finite(p); }));
}

template <class Picture>
Picture crop_picture(const Picture& image, const PixelRect& rect) {
  PN_CHECK(well_formed(image), "crop of an image whose size and pixels disagree");
  const bool inside = rect.x >= 0 && rect.y >= 0 && rect.width >= 1 && rect.height >= 1 &&
                      rect.width <= image.width - rect.x && rect.height <= image.height - rect.y;
  if (!inside) {
    throw InputError(
        fmt::format("crop {} x {} at ({}, {}) is empty or leaves the image, which is {} x {}",
                    rect.width, rect.height, rect.x, rect.y, image.width, image.height));
  }
  Picture result = sized_like(image, rect.width, rect.height);
  for (int y = 0; y < rect.height; ++y) {
    for (int x = 0; x < rect.width; ++x) result.at(x, y) = image.at(rect.x + x, rect.y + y);
  }
  return result;
}

template <class Picture>
Picture upscale_picture(const Picture& image, int factor) {
  PN_CHECK(well_formed(image) && factor >= 1, "upscaling needs pixels and a factor of at least 1");
  Picture result = sized_like(image, image.width * factor, image.height * factor);
  for (int y = 0; y < result.height; ++y) {
    for (int x = 0; x < result.width; ++x) result.at(x, y) = image.at(x / factor, y / factor);
  }
  return result;
}

/// The source pixels that one result pixel covers along one axis.
struct Coverage {
  int first;                    // of the covered source pixels
  std::vector<double> weights;  // covered share of each; sums to 1; no weight is 0
};

std::vector<Coverage> box_coverage(int source_size, int result_size) {
  std::vector<Coverage> result;
  result.reserve(static_cast<std::size_t>(result_size));
  for (int i = 0; i < result_size; ++i) {
    // In units of 1 / result_size source pixels every boundary is an integer, hence no rounding and
    // no stray zero weights, through which a NaN outside of the box would leak in.
    const auto source = static_cast<long long>(source_size);
    const auto step = static_cast<long long>(result_size);
    const long long begin = i * source;
    const long long end = begin + source;
    Coverage c{static_cast<int>(begin / step), {}};
    for (long long pixel = c.first; pixel * step < end; ++pixel) {
      const long long covered = std::min(end, (pixel + 1) * step) - std::max(begin, pixel * step);
      c.weights.push_back(static_cast<double>(covered) / static_cast<double>(source));
    }
    result.push_back(std::move(c));
  }
  return result;
}

template <class Picture>
Picture downscale_picture(const Picture& image, int width, int height) {
  PN_CHECK(well_formed(image), "downscaling of an image whose size and pixels disagree");
  PN_CHECK(width >= 1 && height >= 1 && width <= image.width && height <= image.height,
           "downscaling must not enlarge");
  const std::vector<Coverage> columns = box_coverage(image.width, width);
  const std::vector<Coverage> rows = box_coverage(image.height, height);
  Picture result = sized_like(image, width, height);
  for (int y = 0; y < height; ++y) {
    const Coverage& row = rows[static_cast<std::size_t>(y)];
    for (int x = 0; x < width; ++x) {
      const Coverage& column = columns[static_cast<std::size_t>(x)];
      decltype(to_double(image.pixels.front())) sum(0.0);
      for (int j = 0; j < static_cast<int>(row.weights.size()); ++j) {
        for (int i = 0; i < static_cast<int>(column.weights.size()); ++i) {
          sum += to_double(image.at(column.first + i, row.first + j)) *
                 (row.weights[static_cast<std::size_t>(j)] *
                  column.weights[static_cast<std::size_t>(i)]);
        }
      }
      store(sum, result.at(x, y));
    }
  }
  return result;
}

}  // namespace

Image make_image(int width, int height, Rgb value) {
  PN_CHECK(width >= 1 && height >= 1, "an image is at least 1 x 1");
  Image result = sized_like(Image{}, width, height);
  std::fill(result.pixels.begin(), result.pixels.end(), value);
  return result;
}

ScalarImage make_scalar_image(int width, int height, float value) {
  PN_CHECK(width >= 1 && height >= 1, "an image is at least 1 x 1");
  ScalarImage result = sized_like(ScalarImage{}, width, height);
  std::fill(result.pixels.begin(), result.pixels.end(), value);
  return result;
}

bool is_well_formed(const Image& image) { return well_formed(image); }
bool is_well_formed(const ScalarImage& image) { return well_formed(image); }

std::size_t count_nonfinite(const Image& image) { return count_bad(image); }
std::size_t count_nonfinite(const ScalarImage& image) { return count_bad(image); }

Image crop(const Image& image, const PixelRect& rect) { return crop_picture(image, rect); }
ScalarImage crop(const ScalarImage& image, const PixelRect& rect) {
  return crop_picture(image, rect);
}

Image upscale_nearest(const Image& image, int factor) { return upscale_picture(image, factor); }
ScalarImage upscale_nearest(const ScalarImage& image, int factor) {
  return upscale_picture(image, factor);
}

Image downscale_box(const Image& image, int width, int height) {
  return downscale_picture(image, width, height);
}
ScalarImage downscale_box(const ScalarImage& image, int width, int height) {
  return downscale_picture(image, width, height);
}

}  // namespace penumbra
