#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "harness/image.h"
#include "harness/tone_map.h"

struct _cairo;
struct _cairo_surface;

namespace penumbra {

enum class PictureFormat { Png, Svg, Pdf };

/// By the end of a file's name. @return nothing for any other
std::optional<PictureFormat> picture_format(const std::filesystem::path& file);

/// Which point of a text its position means.
enum class Anchor { Left, Center, Right };

/// A white sheet to draw on, and its file. Coordinates in pixels, y downwards; in SVG and PDF a
/// pixel is a point, texts and lines stay vectors, and painted pixels stay pixels. Text is DejaVu
/// Sans, UTF-8; "_{...}" lowers and shrinks what is in the braces. One thread at a time.
class Canvas {
 public:
  /// @param width, height  at least 1
  /// Errors: RunError when Cairo cannot make a sheet of this size (32767 pixels per side).
  Canvas(int width, int height, PictureFormat format = PictureFormat::Png);
  ~Canvas();

  /// Sets a block of pixels exactly.
  /// @param area    lies inside the sheet
  /// @param colors  row-major, area.width * area.height
  void paint(const PixelRect& area, std::span<const Rgb8> colors);

  /// Fills a rectangle with whole pixels, without antialiasing.
  void fill(const PixelRect& area, Rgb8 color);

  /// Draws a line one pixel wide around the outside of a rectangle; no pixel inside it changes.
  void outline(const PixelRect& area, Rgb8 color);

  /// Fills a triangle.
  /// @param points  x0, y0, x1, y1, x2, y2
  void triangle(const double (&points)[6], Rgb8 color);

  /// Writes one line; when it is too long it becomes up to 30 % smaller, then loses its end to an
  /// ellipsis.
  /// @param x, middle_y  the anchor; the line is centred on `middle_y` by the height of its
  /// capitals
  /// @param size         font size [px]
  /// @param max_width    [px]
  void text(std::string_view text, double x, double middle_y, double size, double max_width,
            Anchor anchor);

  /// The same, reading upwards: `x` is the middle of the line, `middle_y` the middle of its length.
  void text_upwards(std::string_view text, double x, double middle_y, double size,
                    double max_length);

  /// Width of a line [px].
  double text_width(std::string_view text, double size);

  /// The finished sheet as a file; nothing can be drawn after that.
  /// Errors: RunError with Cairo's reason, such as text that is not UTF-8.
  std::string bytes();

 private:
  struct Free {
    void operator()(_cairo* context) const noexcept;
    void operator()(_cairo_surface* surface) const noexcept;
  };
  void show_fitted(std::string_view text, double size, double max_width, Anchor anchor);

  int width_, height_;
  PictureFormat format_;
  std::string written_;  ///< by SVG and PDF surfaces; outlives them
  std::unique_ptr<_cairo_surface, Free> surface_;
  std::unique_ptr<_cairo, Free> context_;
};

}  // namespace penumbra
