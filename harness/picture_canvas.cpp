#include "harness/picture_canvas.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr double kSubscriptSize = 0.72;
constexpr double kSubscriptDrop = 0.18;  // of the font size
constexpr double kCapitalHeight = 0.73;  // of the font size, DejaVu Sans
constexpr double kSmallestShrink = 0.70;
constexpr double kSmallestSize = 9.0;  // no line is shrunk below this [px]
constexpr Rgb8 kInk{32, 32, 32};

/// A piece of a line in one size.
struct Run {
  std::string text;
  bool lowered;
};

std::vector<Run> split_runs(std::string_view text) {
  std::vector<Run> runs;
  while (!text.empty()) {
    const std::size_t open = text.find("_{");
    if (open != 0) runs.push_back({std::string(text.substr(0, open)), false});
    if (open == std::string_view::npos) break;
    text.remove_prefix(open + 2);
    const std::size_t close = text.find('}');
    runs.push_back({std::string(text.substr(0, close)), true});
    text.remove_prefix(close == std::string_view::npos ? text.size() : close + 1);
  }
  return runs;
}

double run_size(const Run& run, double size) { return run.lowered ? size * kSubscriptSize : size; }

double advance(cairo_t* context, const Run& run, double size) {
  cairo_set_font_size(context, run_size(run, size));
  cairo_text_extents_t extents;
  cairo_text_extents(context, run.text.c_str(), &extents);
  return extents.x_advance;
}

double line_width(cairo_t* context, std::string_view text, double size) {
  double width = 0.0;
  for (const Run& run : split_runs(text)) width += advance(context, run, size);
  return width;
}

/// Cuts whole characters off the end until the line fits with an ellipsis.
std::string shorten(cairo_t* context, std::string text, double size, double max_width) {
  const std::string ellipsis = "…";
  while (!text.empty() && line_width(context, text + ellipsis, size) > max_width) {
    do {
      const bool is_continuation = (static_cast<unsigned char>(text.back()) & 0xC0u) == 0x80u;
      text.pop_back();
      if (!is_continuation) break;
    } while (!text.empty());
  }
  return text + ellipsis;
}

void set_color(cairo_t* context, Rgb8 color) {
  cairo_set_source_rgb(context, static_cast<double>(color.r) / 255.0,
                       static_cast<double>(color.g) / 255.0, static_cast<double>(color.b) / 255.0);
}

cairo_status_t append_bytes(void* target, const unsigned char* bytes, unsigned int count) {
  static_cast<std::string*>(target)->append(reinterpret_cast<const char*>(bytes), count);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

void Canvas::Free::operator()(_cairo* context) const noexcept { cairo_destroy(context); }
void Canvas::Free::operator()(_cairo_surface* surface) const noexcept {
  cairo_surface_destroy(surface);
}

std::optional<PictureFormat> picture_format(const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  if (extension == ".png") return PictureFormat::Png;
  if (extension == ".svg") return PictureFormat::Svg;
  if (extension == ".pdf") return PictureFormat::Pdf;
  return std::nullopt;
}

namespace {

cairo_surface_t* make_surface(PictureFormat format, std::string& written, int width, int height) {
  switch (format) {
    case PictureFormat::Svg:
      return cairo_svg_surface_create_for_stream(append_bytes, &written, width, height);
    case PictureFormat::Pdf:
      return cairo_pdf_surface_create_for_stream(append_bytes, &written, width, height);
    case PictureFormat::Png:
      break;
  }
  return cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
}

}  // namespace

Canvas::Canvas(int width, int height, PictureFormat format)
    : width_(width),
      height_(height),
      format_(format),
      surface_(make_surface(format, written_, width, height)),
      context_(cairo_create(surface_.get())) {
  const cairo_status_t status = cairo_surface_status(surface_.get());
  if (width < 1 || height < 1 || status != CAIRO_STATUS_SUCCESS) {
    throw RunError(fmt::format("picture of {} x {} pixels: {}", width, height,
                               cairo_status_to_string(status)));
  }
  cairo_t* context = context_.get();
  cairo_set_source_rgb(context, 1.0, 1.0, 1.0);
  cairo_paint(context);
  cairo_select_font_face(context, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  // Grey antialiasing: the colour fringes of LCD text are wrong in a file.
  cairo_font_options_t* options = cairo_font_options_create();
  cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_SLIGHT);
  cairo_set_font_options(context, options);
  cairo_font_options_destroy(options);
}

Canvas::~Canvas() = default;

void Canvas::paint(const PixelRect& area, std::span<const Rgb8> colors) {
  PN_CHECK(area.x >= 0 && area.y >= 0 && area.x + area.width <= width_ &&
               area.y + area.height <= height_,
           "painting outside of the sheet");
  PN_CHECK(
      colors.size() == static_cast<std::size_t>(area.width) * static_cast<std::size_t>(area.height),
      "as many colours as pixels");
  const std::unique_ptr<cairo_surface_t, Free> pixels(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, area.width, area.height));
  unsigned char* const data = cairo_image_surface_get_data(pixels.get());
  const int stride = cairo_image_surface_get_stride(pixels.get());
  for (int y = 0; y < area.height; ++y) {
    unsigned char* const row = data + static_cast<std::ptrdiff_t>(y) * stride;
    for (int x = 0; x < area.width; ++x) {
      const Rgb8& c = colors[pixel_index(area.width, x, y)];
      const std::uint32_t packed = (std::uint32_t{c.r} << 16) | (std::uint32_t{c.g} << 8) | c.b;
      std::memcpy(row + static_cast<std::ptrdiff_t>(x) * 4, &packed, sizeof packed);
    }
  }
  cairo_surface_mark_dirty(pixels.get());
  cairo_t* context = context_.get();
  cairo_set_source_surface(context, pixels.get(), area.x, area.y);
  cairo_pattern_set_filter(cairo_get_source(context), CAIRO_FILTER_NEAREST);
  cairo_rectangle(context, area.x, area.y, area.width, area.height);
  cairo_fill(context);
}

void Canvas::fill(const PixelRect& area, Rgb8 color) {
  cairo_t* context = context_.get();
  set_color(context, color);
  cairo_rectangle(context, area.x, area.y, area.width, area.height);
  cairo_fill(context);
}

void Canvas::outline(const PixelRect& area, Rgb8 color) {
  fill({area.x - 1, area.y - 1, area.width + 2, 1}, color);
  fill({area.x - 1, area.y + area.height, area.width + 2, 1}, color);
  fill({area.x - 1, area.y, 1, area.height}, color);
  fill({area.x + area.width, area.y, 1, area.height}, color);
}

void Canvas::triangle(const double (&points)[6], Rgb8 color) {
  cairo_t* context = context_.get();
  set_color(context, color);
  cairo_move_to(context, points[0], points[1]);
  cairo_line_to(context, points[2], points[3]);
  cairo_line_to(context, points[4], points[5]);
  cairo_close_path(context);
  cairo_fill(context);
}

/// Draws in the current coordinate system; its origin is the anchor, y = 0 the middle of the
/// capitals.
void Canvas::show_fitted(std::string_view text, double size, double max_width, Anchor anchor) {
  cairo_t* context = context_.get();
  std::string line(text);
  const double full_width = line_width(context, line, size);
  if (full_width > max_width) {
    const double smallest = std::max(kSmallestShrink * size, std::min(size, kSmallestSize));
    size = std::max(smallest, size * max_width / full_width);
    if (line_width(context, line, size) > max_width * 1.01) {
      line = shorten(context, line, size, max_width);
    }
  }
  const double width = line_width(context, line, size);
  double x = anchor == Anchor::Left ? 0.0 : anchor == Anchor::Center ? -0.5 * width : -width;
  set_color(context, kInk);
  for (const Run& run : split_runs(line)) {
    const double run_width = advance(context, run, size);
    const double drop = run.lowered ? kSubscriptDrop * size : 0.0;
    cairo_move_to(context, x, 0.5 * kCapitalHeight * size + drop);
    cairo_show_text(context, run.text.c_str());
    x += run_width;
  }
  cairo_new_path(context);
}

void Canvas::text(std::string_view text, double x, double middle_y, double size, double max_width,
                  Anchor anchor) {
  cairo_save(context_.get());
  cairo_translate(context_.get(), x, middle_y);
  show_fitted(text, size, max_width, anchor);
  cairo_restore(context_.get());
}

void Canvas::text_upwards(std::string_view text, double x, double middle_y, double size,
                          double max_length) {
  constexpr double kQuarterTurn = 1.57079632679489662;
  cairo_save(context_.get());
  cairo_translate(context_.get(), x, middle_y);
  cairo_rotate(context_.get(), -kQuarterTurn);
  show_fitted(text, size, max_length, Anchor::Center);
  cairo_restore(context_.get());
}

double Canvas::text_width(std::string_view text, double size) {
  return line_width(context_.get(), text, size);
}

std::string Canvas::bytes() {
  cairo_status_t status = cairo_status(context_.get());
  if (status == CAIRO_STATUS_SUCCESS && format_ == PictureFormat::Png) {
    cairo_surface_flush(surface_.get());
    status = cairo_surface_write_to_png_stream(surface_.get(), append_bytes, &written_);
  } else if (status == CAIRO_STATUS_SUCCESS) {
    cairo_surface_finish(surface_.get());
    status = cairo_surface_status(surface_.get());
  }
  if (status != CAIRO_STATUS_SUCCESS) {
    throw RunError(fmt::format("picture: {}", cairo_status_to_string(status)));
  }
  return std::move(written_);
}

}  // namespace penumbra
