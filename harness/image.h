#pragma once

#include <cstddef>
#include <vector>

#include "scenes/core/vec.h"

/// Pixel arrays in memory. Row-major, the first row is the top one; `pixels[y * width + x]`.
namespace penumbra {

/// A rectangle of pixels; (x, y) is its top left corner, y grows downwards.
struct PixelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  friend bool operator==(const PixelRect&, const PixelRect&) = default;
};

/// Position of pixel (x, y) in a row-major array of rows of `width` pixels.
inline std::size_t pixel_index(int width, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(x);
}

/// Linear RGB, Rec. 709 primaries.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<Rgb> pixels;  ///< row-major, width * height

  /// @param x, y  in [0, width) and [0, height)
  const Rgb& at(int x, int y) const { return pixels[pixel_index(width, x, y)]; }
  Rgb& at(int x, int y) { return pixels[pixel_index(width, x, y)]; }
};

/// One number per pixel: a mixture weight, a variance, a signed error.
struct ScalarImage {
  int width = 0;
  int height = 0;
  std::vector<float> pixels;  ///< row-major, width * height

  /// @param x, y  in [0, width) and [0, height)
  float at(int x, int y) const { return pixels[pixel_index(width, x, y)]; }
  float& at(int x, int y) { return pixels[pixel_index(width, x, y)]; }
};

/// An image of one colour.
/// @param width, height  at least 1
Image make_image(int width, int height, Rgb value = Rgb(0.0f, 0.0f, 0.0f));
ScalarImage make_scalar_image(int width, int height, float value = 0.0f);

/// Whether the size is at least 1 x 1 and `pixels` has width * height entries.
bool is_well_formed(const Image& image);
bool is_well_formed(const ScalarImage& image);

/// Number of pixels with a NaN or an infinity in any channel.
std::size_t count_nonfinite(const Image& image);
std::size_t count_nonfinite(const ScalarImage& image);

/// Cuts out a rectangle.
/// Errors: InputError when `rect` is empty or not wholly inside the image.
Image crop(const Image& image, const PixelRect& rect);
ScalarImage crop(const ScalarImage& image, const PixelRect& rect);

/// Repeats every pixel `factor` x `factor` times, so that single pixels can be seen.
/// @param factor  at least 1
Image upscale_nearest(const Image& image, int factor);
ScalarImage upscale_nearest(const ScalarImage& image, int factor);

/// Shrinks with a box filter: each result pixel is the area-weighted mean of the source pixels it
/// covers, so the mean of the image is kept. A non-finite source pixel makes every result pixel
/// that it touches non-finite.
/// @param width, height  size of the result, from 1 to the size of the image
Image downscale_box(const Image& image, int width, int height);
ScalarImage downscale_box(const ScalarImage& image, int width, int height);

}  // namespace penumbra
