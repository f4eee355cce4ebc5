// The matrix as one picture: a row per case, a column per estimator, a block per step of the sweep.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "harness/atomic_file.h"
#include "harness/picture_canvas.h"
#include "harness/stability/matrix.h"
#include "harness/stability/stability.h"
#include "harness/text_grid.h"
#include "scenes/core/error.h"

namespace penumbra::stability {
namespace {

/// Told apart by lightness alone, so that no colour vision and no printer loses them.
constexpr std::array<Rgb8, 4> kColors{
    {{218, 229, 236}, {240, 180, 60}, {44, 98, 178}, {20, 20, 20}}};
constexpr Rgb8 kLine{150, 150, 150};
constexpr Rgb8 kStripe{246, 246, 246};

// All in pixels.
constexpr int kPad = 24;
constexpr int kNameWidth = 430;
constexpr int kCellWidth = 92;
constexpr int kCellGap = 10;
constexpr int kRowHeight = 38;
constexpr int kBlockHeight = 24;
constexpr int kTitleHeight = 74;
constexpr int kHeadHeight = 44;
constexpr int kLegendLine = 22;
constexpr int kSwatch = 26;
constexpr double kFont = 15;
constexpr double kSmall = 12;
constexpr double kCharWidth = 6.7;  // of the legend, on average
constexpr int kLeastWidth = 1200;

struct LegendEntry {
  Verdict verdict;
  std::vector<std::string> lines;
};

std::vector<std::string> lines_of(const std::string& text, std::size_t chars) {
  std::vector<std::string> lines;
  std::string rest = wrapped(text, chars);
  for (std::size_t end; (end = rest.find('\n')) != std::string::npos; rest.erase(0, end + 1)) {
    lines.push_back(rest.substr(0, end));
  }
  return lines;
}

std::vector<LegendEntry> legend(std::size_t chars) {
  std::vector<LegendEntry> entries;
  for (const auto& [verdict, rule] : rules_in_words()) {
    entries.push_back({verdict, lines_of(std::string(to_string(verdict)) + ": " + rule, chars)});
  }
  return entries;
}

std::vector<std::string> footnotes(std::size_t chars) {
  return lines_of(bias_rule_in_words() +
                      " * declares a bias. sa: lights sampled by solid angle instead of area. "
                      "literal: pmc_hi as the paper reads literally. No blocks: the case does not "
                      "apply.",
                  chars);
}

class MatrixSheet {
 public:
  explicit MatrixSheet(const StabilityResult& result)
      : result_(result),
        matrix_(matrix_of(result)),
        width_(std::max(kLeastWidth,
                        2 * kPad + kNameWidth +
                            static_cast<int>(result.methods.size()) * (kCellWidth + kCellGap))),
        legend_(legend(chars())),
        footnotes_(footnotes(chars())),
        canvas_(width_, height()) {}

  std::string png() {
    draw_titles();
    for (std::size_t c = 0; c < matrix_.size(); ++c) draw_row(c);
    draw_legend();
    return canvas_.bytes();
  }

 private:
  int rows_top() const { return kPad + kTitleHeight + kHeadHeight; }
  int rows_bottom() const { return rows_top() + static_cast<int>(matrix_.size()) * kRowHeight; }
  std::size_t chars() const {
    return static_cast<std::size_t>((width_ - 2 * kPad - kSwatch) / kCharWidth);
  }
  int height() const {
    int lines = static_cast<int>(footnotes_.size());
    for (const LegendEntry& entry : legend_) lines += static_cast<int>(entry.lines.size());
    return rows_bottom() + kPad + lines * kLegendLine + kPad;
  }
  static int cell_x(std::size_t method) {
    return kPad + kNameWidth + static_cast<int>(method) * (kCellWidth + kCellGap);
  }

  void draw_titles() {
    canvas_.text("Where each estimator stops being stable", kPad, kPad + 12, 24, width_ - 2 * kPad,
                 Anchor::Left);
    canvas_.text(
        "One row per stiffness, one column per estimator. Blocks are the steps of a sweep: "
        "harmless "
        "at the left, extreme at the right of each cell.",
        kPad, kPad + 46, kFont, width_ - 2 * kPad, Anchor::Left);
    const int y = kPad + kTitleHeight + kHeadHeight / 2;
    canvas_.text("swept from (left) to (right)", kPad + kNameWidth - 16, y, kSmall, kNameWidth,
                 Anchor::Right);
    for (std::size_t m = 0; m < result_.methods.size(); ++m) {
      const std::string& method = result_.methods[m];
      canvas_.text(method + (declares_bias(result_, method) ? "*" : ""),
                   cell_x(m) + 0.5 * kCellWidth, y, kFont, kCellWidth + kCellGap - 4,
                   Anchor::Center);
    }
  }

  void draw_row(std::size_t index) {
    const int top = rows_top() + static_cast<int>(index) * kRowHeight;
    if (index % 2 == 0) canvas_.fill({kPad - 6, top, width_ - 2 * kPad + 12, kRowHeight}, kStripe);
    const StabilityCase& c = case_named(result_.cases[index]);
    const double middle = top + 0.5 * kRowHeight;
    canvas_.text(c.name, kPad, middle, kFont, 140, Anchor::Left);
    canvas_.text(fmt::format("{}: {} → {}", c.parameter, value_text(c.values.front()),
                             value_text(c.values.back())),
                 kPad + kNameWidth - 16, middle, kSmall, kNameWidth - 170, Anchor::Right);
    for (std::size_t m = 0; m < matrix_[index].size(); ++m) {
      draw_cell(matrix_[index][m],
                {cell_x(m), top + (kRowHeight - kBlockHeight) / 2, kCellWidth, kBlockHeight});
    }
  }

  void draw_cell(const MatrixCell& cell, const PixelRect& area) {
    const auto count = static_cast<int>(cell.steps.size());
    for (int i = 0; i < count; ++i) {
      const int from = area.x + i * area.width / count;
      const int to = area.x + (i + 1) * area.width / count;
      const Verdict verdict = cell.steps[static_cast<std::size_t>(i)]->verdict;
      canvas_.fill({from, area.y, to - from - 1, area.height},
                   kColors[static_cast<std::size_t>(verdict)]);
    }
    if (count > 0) canvas_.outline({area.x, area.y, area.width - 1, area.height}, kLine);
  }

  void draw_legend() {
    int y = rows_bottom() + kPad;
    for (const LegendEntry& entry : legend_) {
      const PixelRect swatch{kPad, y + 3, kSwatch, kLegendLine - 6};
      canvas_.fill(swatch, kColors[static_cast<std::size_t>(entry.verdict)]);
      canvas_.outline(swatch, kLine);
      for (const std::string& line : entry.lines) draw_line(line, y, kPad + kSwatch + 10);
    }
    for (const std::string& line : footnotes_) draw_line(line, y, kPad);
  }

  void draw_line(const std::string& line, int& y, int x) {
    canvas_.text(line, x, y + 0.5 * kLegendLine, kSmall + 1, width_ - kPad - x, Anchor::Left);
    y += kLegendLine;
  }

  const StabilityResult& result_;
  std::vector<std::vector<MatrixCell>> matrix_;
  int width_;
  std::vector<LegendEntry> legend_;
  std::vector<std::string> footnotes_;
  Canvas canvas_;
};

}  // namespace

void write_matrix_picture(const std::filesystem::path& file, const StabilityResult& result) {
  write_file_atomically(file, MatrixSheet(result).png());
}

}  // namespace penumbra::stability
