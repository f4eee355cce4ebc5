#include "harness/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "harness/atomic_file.h"
#include "harness/picture_canvas.h"
#include "harness/picture_layout.h"
#include "harness/tone_map.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr Rgb8 kFrame{160, 160, 160};
constexpr int kSmallestHeight = 160;    // of a drawn panel [px]
constexpr int kMaxEnlargedWidth = 640;  // of a drawn map [px]

/// Whole factor that makes single pixels of a small picture visible.
int enlargement(int width, int height, int max_width) {
  const int wanted = (kSmallestHeight + height - 1) / height;
  return std::clamp(wanted, 1, std::max(1, max_width / width));
}

/// Gives every error the path; RunError of lower layers knows none.
template <class Action>
auto with_path(const std::filesystem::path& path, Action&& action) {
  try {
    return action();
  } catch (const RunError& error) {
    throw RunError(fmt::format("cannot draw {}: {}", path.string(), error.what()));
  }
}

void check_picture(bool well_formed) {
  if (!well_formed) throw RunError("the image is empty, or size and pixels disagree");
}

/// The panel's pixels at the size in which it is drawn.
template <class Picture>
Picture fit(const Picture& picture, int width, int height) {
  return width >= picture.width ? upscale_nearest(picture, width / picture.width)
                                : downscale_box(picture, width, height);
}

std::vector<Rgb8> panel_colors(const Panel& panel, const Layout& layout, const StripStyle& style) {
  if (const auto* image = std::get_if<Image>(&panel.content)) {
    return colors_of(fit(*image, layout.panel_width, layout.panel_height), style.exposure_stops);
  }
  return colors_of(
      fit(std::get<ScalarImage>(panel.content), layout.panel_width, layout.panel_height),
      style.scale);
}

/// The common size of all panels; throws RunError without path.
std::pair<int, int> check_panels(std::span<const Panel> panels, const StripStyle& style) {
  if (panels.empty()) throw RunError("no panels");
  if (style.columns < 0 || style.max_panel_width < 1) {
    throw RunError(
        fmt::format("{} columns of panels up to {} px wide", style.columns, style.max_panel_width));
  }
  const auto size_of = [](const Panel& panel) {
    return std::visit([](const auto& p) { return std::pair(p.width, p.height); }, panel.content);
  };
  for (const Panel& panel : panels) {
    check_picture(std::visit([](const auto& p) { return is_well_formed(p); }, panel.content));
    if (size_of(panel) != size_of(panels.front())) {
      throw RunError(fmt::format("panels \"{}\" and \"{}\" differ in size", panels.front().caption,
                                 panel.caption));
    }
  }
  return size_of(panels.front());
}

void check_scale(const ColorScale& scale) {
  const std::string fault = scale_fault(scale);
  if (!fault.empty()) throw RunError(fault);
}

/// A finished picture and where its panels are.
struct Drawing {
  std::string png;
  std::vector<PixelRect> places;
};

Drawing draw(std::span<const Panel> panels, const std::string& title, const StripStyle& style,
             const Layout& layout, const Findings& findings) {
  Canvas canvas(layout.width(), layout.height());
  Drawing drawing;
  for (const Panel& panel : panels) {
    const PixelRect place = layout.panel(static_cast<int>(drawing.places.size()));
    canvas.paint(place, panel_colors(panel, layout, style));
    canvas.outline(place, kFrame);
    if (!panel.caption.empty()) {
      canvas.text(panel.caption, place.x + 0.5 * place.width,
                  place.y + place.height + 0.55 * layout.caption_height, layout.font, place.width,
                  Anchor::Center);
    }
    drawing.places.push_back(place);
  }
  draw_surroundings(canvas, layout, title, findings, style.scale);
  drawing.png = canvas.bytes();
  return drawing;
}

/// @param font_of  font size from the size of a drawn panel, before clamping
template <class FontOf>
Drawing draw_strip(std::span<const Panel> panels, const std::string& title, const StripStyle& style,
                   FontOf&& font_of) {
  const auto [width, height] = check_panels(panels, style);
  const Findings findings = find_out(panels, style.scale);
  if (findings.has_map) check_scale(style.scale);
  const int n_panels = static_cast<int>(panels.size());
  Layout layout;
  layout.columns = std::min(style.columns > 0 ? style.columns : 4, n_panels);
  layout.rows = (n_panels + layout.columns - 1) / layout.columns;
  if (width <= style.max_panel_width) {
    const int factor = enlargement(width, height, style.max_panel_width);
    layout.panel_width = width * factor;
    layout.panel_height = height * factor;
  } else {
    layout.panel_width = style.max_panel_width;
    layout.panel_height = std::max(1, static_cast<int>(std::lround(static_cast<double>(height) *
                                                                   style.max_panel_width / width)));
  }
  layout.font = std::clamp(font_of(layout.panel_width, layout.panel_height), 10.0, 28.0);
  const bool has_captions =
      std::any_of(panels.begin(), panels.end(), [](const Panel& p) { return !p.caption.empty(); });
  place_texts(layout, !title.empty(), has_captions, findings, style.scale);
  return draw(panels, title, style, layout, findings);
}

}  // namespace

void write_png_rgb(const std::filesystem::path& path, const Image& image, float exposure_stops) {
  const std::string png = with_path(path, [&] {
    check_picture(is_well_formed(image));
    Canvas canvas(image.width, image.height);
    canvas.paint({0, 0, image.width, image.height}, colors_of(image, exposure_stops));
    return canvas.bytes();
  });
  write_file_atomically(path, png);
}

PixelRect write_png_map(const std::filesystem::path& path, const ScalarImage& map,
                        const MapStyle& style) {
  const Drawing drawing = with_path(path, [&] {
    const Panel panel{"", map};
    StripStyle strip;
    strip.max_panel_width = std::max(map.width, kMaxEnlargedWidth);
    strip.scale = style.scale;
    return draw_strip({&panel, 1}, style.title, strip,
                      [](int, int height) { return static_cast<double>(height) / 40.0; });
  });
  write_file_atomically(path, drawing.png);
  return drawing.places.front();
}

std::vector<PixelRect> write_png_strip(const std::filesystem::path& path,
                                       std::span<const Panel> panels, const std::string& title,
                                       const StripStyle& style) {
  const Drawing drawing = with_path(path, [&] {
    // A strip is several panels wide and will be looked at smaller than a single picture.
    return draw_strip(panels, title, style, [](int width, int height) {
      return std::max(static_cast<double>(width) / 26.0, static_cast<double>(height) / 40.0);
    });
  });
  write_file_atomically(path, drawing.png);
  return drawing.places;
}

}  // namespace penumbra
