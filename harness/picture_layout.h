#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "harness/color_bar.h"
#include "harness/picture.h"

namespace penumbra {

class Canvas;

/// What the pixels of all panels say that the colours alone may hide.
struct Findings {
  std::size_t n_nonfinite = 0;
  std::size_t n_pixels = 0;
  bool has_map = false;
  Exceeded exceeded;
};

/// @param scale  of the map panels
Findings find_out(std::span<const Panel> panels, const ColorScale& scale);

/// Sizes and places of everything in a strip [px]. A single map is a strip of one panel.
struct Layout {
  double font = 10.0;
  int panel_width = 0;
  int panel_height = 0;
  int columns = 1;
  int rows = 1;
  int pad = 0;           // around everything and between panels
  int title_height = 0;  // 0 without title
  int caption_height = 0;
  int note_height = 0;
  int bar_width = 0;  // 0 without colour bar
  int bar_height = 0;

  /// Width of all columns of panels [px].
  int grid_width() const { return columns * panel_width + (columns - 1) * pad; }
  /// Height of a panel with its caption [px].
  int row_height() const { return panel_height + caption_height; }
  /// Lower end of the last row of panels, without its captions.
  int grid_bottom() const {
    return pad + title_height + rows * row_height() + (rows - 1) * pad - caption_height;
  }
  /// Size of the whole picture [px].
  int width() const { return pad + grid_width() + (bar_width > 0 ? pad + bar_width : 0) + pad; }
  int height() const { return grid_bottom() + caption_height + note_height + pad; }
  /// Place of panel `i`, row by row.
  PixelRect panel(int i) const {
    return {pad + i % columns * (panel_width + pad),
            pad + title_height + i / columns * (row_height() + pad), panel_width, panel_height};
  }
};

/// Reserves room for the texts and the colour bar; panel size, columns, rows and font are already
/// set.
void place_texts(Layout& layout, bool has_title, bool has_captions, const Findings& findings,
                 const ColorScale& scale);

/// Draws everything but the panels and their captions: title, colour bar, note on non-finite
/// pixels.
void draw_surroundings(Canvas& canvas, const Layout& layout, const std::string& title,
                       const Findings& findings, const ColorScale& scale);

}  // namespace penumbra
