#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "harness/color_map.h"
#include "harness/image.h"

/// PNG pictures for reports. Every writer replaces the file as a whole, draws NaN and infinity in
/// magenta and throws RunError with path and reason. Text is UTF-8; "_{...}" is lowered, as in
/// "α_{BRDF}".
namespace penumbra {

/// Writes a rendered image pixel by pixel, without any frame or text: exposure, clipping at white,
/// sRGB.
/// @param image           linear RGB
/// @param exposure_stops  brighter by a factor of 2 to this power
void write_png_rgb(const std::filesystem::path& path, const Image& image,
                   float exposure_stops = 0.0f);

struct MapStyle {
  std::string title;  ///< above the map; may be empty
  ColorScale scale;
};

/// Writes a false-colour map with title and colour bar; a note below counts non-finite pixels, if
/// any. Every pixel of the map is one pixel of the picture, or a square of them when the map is
/// less than 160 pixels high.
/// @return where in the picture the map was drawn
PixelRect write_png_map(const std::filesystem::path& path, const ScalarImage& map,
                        const MapStyle& style);

/// One picture of a strip.
struct Panel {
  std::string caption;  ///< below the picture; may be empty
  std::variant<Image, ScalarImage> content;
};

struct StripStyle {
  int columns = 0;              ///< panels per row; 0: up to four
  int max_panel_width = 480;    ///< wider panels are shrunk with a box filter, in linear light [px]
  float exposure_stops = 0.0f;  ///< of the RGB panels
  /// Of all map panels; they share one colour bar, absent without map panels. Shrinking averages
  /// noise away: where that matters, make the scale from maps that went through `downscale_box`
  /// already.
  ColorScale scale;
};

/// Writes pictures and maps of one size side by side, in rows, with a caption under each.
/// @param panels  at least one
/// @param title   above all; may be empty
/// @return where in the picture each panel was drawn, in the order of `panels`
std::vector<PixelRect> write_png_strip(const std::filesystem::path& path,
                                       std::span<const Panel> panels, const std::string& title,
                                       const StripStyle& style = {});

}  // namespace penumbra
