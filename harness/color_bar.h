#pragma once

#include <string>
#include <vector>

#include "harness/color_map.h"
#include "harness/image.h"

namespace penumbra {

class Canvas;

/// A number beside the colour bar.
struct Tick {
  double value;
  std::string text;  ///< "0.25", "−3", "2.5×10⁻⁵"; the shortest that tells the ticks apart
};

/// Round numbers (1, 2 or 5 times a power of ten apart) from `min` to `max`.
/// @param min, max   finite, min < max
/// @param max_count  at least 2; as many as fit beside the bar
std::vector<Tick> make_ticks(double min, double max, int max_count);

/// Whether some finite value lies below or above the scale; the bar then ends in an arrow.
struct Exceeded {
  bool below = false;
  bool above = false;
};

/// Adds the values of one map to what is known of the others.
void add_exceeded(const ScalarImage& map, const ColorScale& scale, Exceeded& exceeded);

/// Width that the bar, its numbers and its label take [px].
/// @param font    font size [px]
/// @param height  of the bar [px]
int color_bar_width(Canvas& canvas, const ColorScale& scale, double font, int height);

/// Draws the vertical bar with ticks, numbers and the label reading upwards.
/// @param area  x, y: upper left corner of the bar; height: its length; width: as `color_bar_width`
/// gave it. The
///              numbers at the ends stand out above and below by half their height.
void draw_color_bar(Canvas& canvas, const PixelRect& area, const ColorScale& scale, double font,
                    const Exceeded& exceeded);

}  // namespace penumbra
