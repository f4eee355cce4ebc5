#include "harness/picture_layout.h"

#include <fmt/format.h>

#include <cmath>
#include <variant>

#include "harness/picture_canvas.h"

namespace penumbra {
namespace {

constexpr double kTitleSize = 1.25;  // of the font size

int whole(double value) { return static_cast<int>(std::ceil(value)); }

}  // namespace

Findings find_out(std::span<const Panel> panels, const ColorScale& scale) {
  Findings findings;
  for (const Panel& panel : panels) {
    findings.n_nonfinite +=
        std::visit([](const auto& p) { return count_nonfinite(p); }, panel.content);
    findings.n_pixels += std::visit([](const auto& p) { return p.pixels.size(); }, panel.content);
    if (const auto* map = std::get_if<ScalarImage>(&panel.content)) {
      findings.has_map = true;
      add_exceeded(*map, scale, findings.exceeded);
    }
  }
  return findings;
}

void place_texts(Layout& layout, bool has_title, bool has_captions, const Findings& findings,
                 const ColorScale& scale) {
  layout.pad = whole(0.9 * layout.font);
  layout.title_height = has_title ? whole(2.0 * kTitleSize * layout.font) : 0;
  layout.caption_height = has_captions ? whole(1.9 * layout.font) : 0;
  layout.note_height = findings.n_nonfinite > 0 ? whole(2.2 * layout.font) : 0;
  layout.bar_height = layout.grid_bottom() - layout.panel(0).y;
  Canvas ruler(1, 1);
  if (findings.has_map) {
    layout.bar_width = color_bar_width(ruler, scale, layout.font, layout.bar_height);
  }
}

void draw_surroundings(Canvas& canvas, const Layout& layout, const std::string& title,
                       const Findings& findings, const ColorScale& scale) {
  if (!title.empty()) {
    canvas.text(title, 0.5 * layout.width(), layout.pad + 0.4 * layout.title_height,
                kTitleSize * layout.font, layout.width() - 2 * layout.pad, Anchor::Center);
  }
  if (layout.bar_width > 0) {
    const PixelRect first = layout.panel(0);
    draw_color_bar(canvas,
                   {layout.pad + layout.grid_width() + layout.pad, first.y, layout.bar_width,
                    layout.bar_height},
                   scale, layout.font, findings.exceeded);
  }
  if (findings.n_nonfinite > 0) {
    const int side = whole(layout.font);
    const int y = layout.height() - layout.pad - side;
    canvas.fill({layout.pad, y, side, side}, kNonFiniteColor);
    canvas.text(
        fmt::format("{} of {} pixels NaN or infinite", findings.n_nonfinite, findings.n_pixels),
        layout.pad + 1.6 * side, y + 0.5 * side, layout.font,
        layout.width() - 2 * layout.pad - 1.6 * side, Anchor::Left);
  }
}

}  // namespace penumbra
