#include "harness/color_bar.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "harness/picture_canvas.h"

namespace penumbra {
namespace {

constexpr Rgb8 kLine{96, 96, 96};

// All in units of the font size.
constexpr double kBarWidth = 1.3;
constexpr double kTickLength = 0.35;
constexpr double kGap = 0.3;
constexpr double kLabelHeight = 1.5;
constexpr double kTickDistance = 2.4;
constexpr double kArrow = 0.9;

int pixels(double units, double font) { return static_cast<int>(std::lround(units * font)); }

int tick_count(int height, double font) {
  return std::clamp(static_cast<int>(height / (kTickDistance * font)), 2, 11);
}

/// The distance of 1, 2 or 5 times a power of ten that is at least `distance`.
double round_up(double distance) {
  const double power = std::pow(10.0, std::floor(std::log10(distance)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= distance * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

std::string superscript(int exponent) {
  constexpr std::string_view kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string result = exponent < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(exponent))) {
    result += kDigits[static_cast<std::size_t>(digit - '0')];
  }
  return result;
}

/// @param step  distance of the ticks, which says how many decimals tell them apart
/// @param size  the largest |value| among the ticks, which says whether a power of ten is split off
std::string tick_text(double value, double step, double size) {
  const bool is_plain = size < 1e5 && size >= 1e-3;
  const int exponent = is_plain ? 0 : static_cast<int>(std::floor(std::log10(size) + 1e-9));
  const double unit = std::pow(10.0, exponent);
  const int decimals =
      std::clamp(static_cast<int>(std::ceil(-std::log10(step / unit) - 1e-6)), 0, 12);
  if (std::abs(value) < 0.5 * step) return "0";
  std::string text = fmt::format("{:.{}f}", std::abs(value) / unit, decimals);
  if (!is_plain) text += "×10" + superscript(exponent);
  return (value < 0.0 ? "−" : "") + text;
}

double widest_number(Canvas& canvas, const ColorScale& scale, double font, int height) {
  double widest = 0.0;
  for (const Tick& tick : make_ticks(static_cast<double>(scale.min), static_cast<double>(scale.max),
                                     tick_count(height, font))) {
    widest = std::max(widest, canvas.text_width(tick.text, font));
  }
  return widest;
}

/// The gradient; `bar` leaves out the arrows.
void draw_gradient(Canvas& canvas, const PixelRect& bar, ColorMap map) {
  for (int y = 0; y < bar.height; ++y) {
    const double t = 1.0 - (static_cast<double>(y) + 0.5) / static_cast<double>(bar.height);
    canvas.fill({bar.x, bar.y + y, bar.width, 1}, map_color(map, t));
  }
  canvas.outline(bar, kLine);
}

}  // namespace

std::vector<Tick> make_ticks(double min, double max, int max_count) {
  double step = round_up((max - min) / static_cast<double>(std::max(max_count, 2)));
  const auto first = [&] { return std::ceil(min / step - 1e-6); };
  const auto last = [&] { return std::floor(max / step + 1e-6); };
  while (last() - first() + 1.0 > static_cast<double>(max_count)) step = round_up(step * 1.5);
  const double size = std::max(std::abs(first()), std::abs(last())) * step;
  std::vector<Tick> ticks;
  for (double i = first(); i <= last(); i += 1.0) {
    ticks.push_back({i * step, tick_text(i * step, step, size)});
  }
  return ticks;
}

void add_exceeded(const ScalarImage& map, const ColorScale& scale, Exceeded& exceeded) {
  for (const float value : map.pixels) {
    if (!std::isfinite(value)) continue;
    exceeded.below = exceeded.below || value < scale.min;
    exceeded.above = exceeded.above || value > scale.max;
  }
}

int color_bar_width(Canvas& canvas, const ColorScale& scale, double font, int height) {
  const double numbers = widest_number(canvas, scale, font, height);
  const double label = scale.label.empty() ? 0.0 : (kGap + kLabelHeight) * font;
  return static_cast<int>(std::ceil((kBarWidth + kTickLength + kGap) * font + numbers + label));
}

void draw_color_bar(Canvas& canvas, const PixelRect& area, const ColorScale& scale, double font,
                    const Exceeded& exceeded) {
  const int arrow = pixels(kArrow, font);
  const int top = exceeded.above ? arrow : 0;
  const int bottom = exceeded.below ? arrow : 0;
  const PixelRect bar{area.x, area.y + top, pixels(kBarWidth, font), area.height - top - bottom};
  draw_gradient(canvas, bar, scale.map);
  const double left = bar.x;
  const double right = bar.x + bar.width;
  const double middle = 0.5 * (left + right);
  const double bar_end = bar.y + bar.height;
  if (exceeded.above) {
    canvas.triangle({left, bar.y - 2.0, right, bar.y - 2.0, middle, double(area.y)},
                    map_color(scale.map, 1.0));
  }
  if (exceeded.below) {
    canvas.triangle({left, bar_end + 2.0, right, bar_end + 2.0, middle, bar_end + arrow},
                    map_color(scale.map, 0.0));
  }

  const double min = static_cast<double>(scale.min);
  const double max = static_cast<double>(scale.max);
  const int tick_length = pixels(kTickLength, font);
  const double text_x = right + (kTickLength + kGap) * font;
  for (const Tick& tick : make_ticks(min, max, tick_count(bar.height, font))) {
    const double y = bar_end - (tick.value - min) / (max - min) * bar.height;
    const int line_y = std::clamp(static_cast<int>(y), bar.y, bar.y + bar.height - 1);
    canvas.fill({bar.x + bar.width, line_y, tick_length, 1}, kLine);
    canvas.text(tick.text, text_x, y, font, area.width, Anchor::Left);
  }
  if (!scale.label.empty()) {
    canvas.text_upwards(scale.label, area.x + area.width - 0.5 * kLabelHeight * font,
                        area.y + 0.5 * area.height, font, area.height);
  }
}

}  // namespace penumbra
