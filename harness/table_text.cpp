#include "harness/table_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "harness/metrics.h"

namespace penumbra {
namespace {

constexpr double kPixelWarning = 200;
constexpr std::size_t kTerminalWidth = 119;
constexpr std::size_t kShortestName = 6;
constexpr std::string_view kPublishedTitle = "published ratio";

using Grid = std::vector<std::vector<std::string>>;  // [line][column], line 0 the titles

/// Three significant digits, without the padding of the exponent.
std::string number(double value) {
  const double size = std::abs(value);
  if (!std::isfinite(value) || value == 0) return fmt::format("{:g}", value);
  if (size < 1e-3 || size >= 99950) {
    const std::string text = fmt::format("{:.2e}", value);
    const std::size_t e = text.find('e');
    return text.substr(0, e + 1) + std::to_string(std::stoi(text.substr(e + 1)));
  }
  if (size >= 99.95) return fmt::format("{:.0f}", value);
  const int digits = 2 - static_cast<int>(std::floor(std::log10(size) + 1e-12));
  return fmt::format("{:.{}f}", value, std::max(digits, 0));
}

std::string number(const std::optional<double>& value) { return value ? number(*value) : "-"; }

std::string seconds(const std::optional<double>& value) {
  if (!value) return "-";
  if (*value >= 1) return number(*value) + " s";
  return *value >= 1e-3 ? number(*value * 1e3) + " ms" : number(*value * 1e6) + " us";
}

std::string ratio_number(double value) {
  return value >= 0.0995 && value < 99.995 ? fmt::format("{:.2f}", value) : number(value);
}

std::string interval(const std::optional<double>& value, const std::optional<double>& lo,
                     const std::optional<double>& hi) {
  if (!value) return "-";
  const bool exact = lo == value && hi == value;  // of a baseline to itself
  if (!lo || !hi || exact) return ratio_number(*value);
  return fmt::format("{} [{}, {}]", ratio_number(*value), ratio_number(*lo), ratio_number(*hi));
}

std::string srl_text(const EfficiencyRow& row) {
  if (row.srl_adaptive == 0) return std::to_string(row.srl);
  return fmt::format("{}-{}", row.srl_initial, row.srl_adaptive);
}

bool noisy_reference(const EfficiencyRow& row) {
  return row.reference_share.value_or(0) > kShareToWarn;
}

bool few_pixels(const EfficiencyRow& row) {
  return row.p_eff.has_value() && *row.p_eff < kPixelWarning;
}

bool has_published(std::span<const EfficiencyRow> rows) {
  return std::any_of(rows.begin(), rows.end(),
                     [](const EfficiencyRow& row) { return row.ratio_published.has_value(); });
}

std::string error_text(const EfficiencyRow& row) {
  return number(row.err) + (noisy_reference(row) ? "r" : "") + (few_pixels(row) ? "p" : "");
}

std::string eff_text(const EfficiencyRow& row, const TableOptions& options) {
  return number(options.primary == PrimaryTime::Cpu ? row.eff_cpu : row.eff);
}

std::string percent(const std::optional<double>& value) {
  return value ? fmt::format("{:+.2f} %", 100 * *value) : "-";
}

std::string share(const std::optional<double>& value) {
  return value ? number(100 * *value) + " %" : "-";
}

std::string shown_verdict(Verdict verdict) {
  if (verdict == Verdict::ReferenceLimited) return "ref-limited";
  return std::string(verdict_text(verdict));
}

/// Parameters are shown only where they tell cells of one label apart.
std::string label_text(const EfficiencyRow& row, std::span<const EfficiencyRow> rows) {
  const bool swept = std::any_of(rows.begin(), rows.end(), [&](const EfficiencyRow& other) {
    return other.label == row.label && other.params != row.params;
  });
  return swept && !row.params.empty() ? row.label + " " + row.params : row.label;
}

std::string population_text(const EfficiencyRow& row) {
  return row.population ? std::to_string(*row.population) : "-";
}

/// Length in code points.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::vector<std::size_t> widths_of(const Grid& grid) {
  std::vector<std::size_t> widths(grid[0].size(), 0);
  for (const auto& line : grid) {
    for (std::size_t c = 0; c < line.size(); ++c)
      widths[c] = std::max(widths[c], width_of(line[c]));
  }
  return widths;
}

/// Text columns to the left, numbers to the right.
std::string padded(const std::string& text, std::size_t width, bool is_text) {
  const std::string blanks(width - std::min(width, width_of(text)), ' ');
  return is_text ? text + blanks : blanks + text;
}

/// Keeps both ends, where names differ. Bytes of one code point stay together.
std::string shortened(const std::string& text, std::size_t width) {
  if (width_of(text) <= width) return text;
  std::vector<std::string> points;
  for (const char c : text) {
    if ((c & 0xC0) != 0x80) points.emplace_back();
    points.back() += c;
  }
  const std::size_t tail = (width - 1) / 2;
  const std::size_t head = width - 1 - tail;
  std::string result;
  for (std::size_t i = 0; i < head; ++i) result += points[i];
  result += '~';
  for (std::size_t i = points.size() - tail; i < points.size(); ++i) result += points[i];
  return result;
}

/// What scenes with shapes of type "model" are made of.
void add_geometry_notes(std::span<const EfficiencyRow> rows, std::vector<std::string>& notes) {
  std::set<std::string> said;
  for (const EfficiencyRow& row : rows) {
    if (row.geometry != "generated" && row.geometry != "models") continue;
    if (!said.insert(row.scene).second) continue;
    notes.push_back(row.scene + (row.geometry == "models"
                                     ? ": with the real model from PENUMBRA_MODELS."
                                     : ": with geometry generated in place of the real model."));
  }
}

std::vector<std::string> footnotes(std::span<const EfficiencyRow> rows,
                                   const TableOptions& options) {
  std::vector<std::string> notes;
  const std::string_view time = options.primary == PrimaryTime::Cpu ? "CPU" : "wall";
  notes.push_back(fmt::format(
      "Eff: 1/(T x MSE) in {} time. Ratio: over that of \"{}\" in the same blocks; in brackets its "
      "{:g} % interval (block jackknife of the ratio of means, t).",
      time, options.baseline, 100 * options.confidence));
  notes.push_back(
      fmt::format("MSE is debiased; relMSE divides by reference^2 + {:g} mean(reference)^2.",
                  options.relmse_epsilon));
  if (std::any_of(rows.begin(), rows.end(), noisy_reference)) {
    notes.push_back("r: the reference's own variance is more than 5 % of this MSE.");
  }
  if (std::any_of(rows.begin(), rows.end(), few_pixels)) {
    notes.push_back("p: fewer than 200 effective pixels decide this MSE; trust relMSE.");
  }
  if (!options.published_source.empty() && has_published(rows)) {
    notes.push_back("Published ratio: " + options.published_source);
  }
  add_geometry_notes(rows, notes);
  for (const EfficiencyRow& row : rows) {
    if (row.note.empty()) continue;
    notes.push_back(fmt::format("{}, {} ({}, SRL {}): {}.", row.scene, label_text(row, rows),
                                row.sampler, srl_text(row), row.note));
  }
  return notes;
}

std::string escaped(std::string text) {
  for (std::size_t i = 0; (i = text.find('|', i)) != std::string::npos; i += 2)
    text.insert(i, "\\");
  return text;
}

struct TableContext {
  std::span<const EfficiencyRow> rows;
  const TableOptions& options;
};

/// A column for people.
struct ShownColumn {
  std::string_view title;
  bool is_text;
  bool in_terminal;
  std::string (*text)(const EfficiencyRow&, const TableContext&);
};

// clang-format off
constexpr std::array<ShownColumn, 19> kShownColumns{{
    {"Scene", true, true, [](const auto& r, const auto&) { return r.scene; }},
    {"Label", true, true, [](const auto& r, const auto& c) { return label_text(r, c.rows); }},
    {"Sampler", true, true, [](const auto& r, const auto&) { return r.sampler; }},
    {"Budget", false, false, [](const auto& r, const auto&) { return seconds(r.budget_s); }},
    {"SPP", false, true, [](const auto& r, const auto&) { return std::to_string(r.spp); }},
    {"SRL", false, true, [](const auto& r, const auto&) { return srl_text(r); }},
    {"Pop", false, true, [](const auto& r, const auto&) { return population_text(r); }},
    {"Blocks", false, false, [](const auto& r, const auto&) { return std::to_string(r.n_blocks); }},
    {"T_cpu", false, true, [](const auto& r, const auto&) { return seconds(r.time_cpu_s); }},
    {"MSE", false, true, [](const auto& r, const auto&) { return error_text(r); }},
    {"Ref share", false, false, [](const auto& r, const auto&) { return share(r.reference_share); }},
    {"relMSE", false, true, [](const auto& r, const auto&) { return number(r.relmse); }},
    {"Eff", false, true, [](const auto& r, const auto& c) { return eff_text(r, c.options); }},
    {"Ratio", false, true, [](const auto& r, const auto&) {
       return interval(r.ratio, r.ratio_lo, r.ratio_hi); }},
    {kPublishedTitle, false, true, [](const auto& r, const auto&) {
       return interval(r.ratio_published, {}, {}); }},
    {"Ratio to tuned", false, false, [](const auto& r, const auto&) {
       return interval(r.ratio_tuned, r.ratio_tuned_lo, r.ratio_tuned_hi); }},
    {"Bias", false, false, [](const auto& r, const auto&) { return percent(r.bias_rel); }},
    {"Bias p", false, false, [](const auto& r, const auto&) { return number(r.bias_p); }},
    {"Verdict", true, true, [](const auto& r, const auto&) { return shown_verdict(r.verdict); }},
}};
// clang-format on

/// The columns that are shown: that of published ratios only where there are any.
std::vector<ShownColumn> columns_of(const TableContext& context, bool terminal) {
  std::vector<ShownColumn> columns;
  for (const ShownColumn& c : kShownColumns) {
    if (terminal && !c.in_terminal) continue;
    if (c.title == kPublishedTitle && !has_published(context.rows)) continue;
    columns.push_back(c);
  }
  return columns;
}

Grid grid_of(const TableContext& context, const std::vector<ShownColumn>& columns) {
  Grid grid(1);
  for (const ShownColumn& c : columns) grid[0].emplace_back(c.title);
  for (const EfficiencyRow& row : context.rows) {
    auto& line = grid.emplace_back();
    for (const ShownColumn& c : columns) line.push_back(c.text(row, context));
  }
  return grid;
}

/// Narrows the widest of the name columns until the line fits.
void fit_names(std::vector<std::size_t>& widths, const std::vector<ShownColumn>& columns) {
  std::size_t total = widths.size() - 1;
  for (const std::size_t width : widths) total += width;
  for (; total > kTerminalWidth; --total) {
    std::size_t widest = 0;  // the first three columns are names
    for (std::size_t c = 1; c < 3; ++c) {
      if (columns[c].is_text && widths[c] > widths[widest]) widest = c;
    }
    if (widths[widest] <= kShortestName) return;
    --widths[widest];
  }
}

std::string without_line_ends(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t width) {
  std::string result;
  std::size_t start = 0;
  while (text.size() - start > width) {
    std::size_t end = text.rfind(' ', start + width);
    if (end == std::string::npos || end <= start) end = start + width;
    result += text.substr(start, end - start) + "\n";
    start = text[end] == ' ' ? end + 1 : end;
  }
  return result + text.substr(start) + "\n";
}

std::string to_csv(std::span<const EfficiencyRow> rows) {
  std::string text = csv_line(efficiency_columns());
  for (const EfficiencyRow& row : rows) text += csv_line(efficiency_record(row));
  return text;
}

std::string to_markdown(std::span<const EfficiencyRow> rows, const TableOptions& options) {
  const TableContext context{rows, options};
  const std::vector<ShownColumn> columns = columns_of(context, false);
  Grid grid = grid_of(context, columns);
  for (auto& line : grid) {
    for (std::string& field : line) field = escaped(without_line_ends(field));
  }
  const std::vector<std::size_t> widths = widths_of(grid);
  std::string text;
  for (std::size_t l = 0; l < grid.size(); ++l) {
    text += "|";
    for (std::size_t c = 0; c < columns.size(); ++c) {
      text += " " + padded(grid[l][c], widths[c], columns[c].is_text) + " |";
    }
    text += "\n";
    if (l > 0) continue;
    text += "|";
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const std::string dashes(widths[c], '-');
      text += columns[c].is_text ? ":" + dashes + "-|" : "-" + dashes + ":|";
    }
    text += "\n";
  }
  text += "\n";
  for (const std::string& note : footnotes(rows, options)) {
    text += "- " + escaped(without_line_ends(note)) + "\n";
  }
  return text;
}

std::string to_terminal(std::span<const EfficiencyRow> rows, const TableOptions& options) {
  const TableContext context{rows, options};
  const std::vector<ShownColumn> columns = columns_of(context, true);
  const Grid grid = grid_of(context, columns);
  std::vector<std::size_t> widths = widths_of(grid);
  fit_names(widths, columns);
  std::string text;
  for (const auto& line : grid) {
    std::string out;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const std::string field = c < 3 ? shortened(line[c], widths[c]) : line[c];
      out += (c > 0 ? " " : "") + padded(field, widths[c], columns[c].is_text);
    }
    out.erase(out.find_last_not_of(' ') + 1);
    text += out + "\n";
  }
  for (const std::string& note : footnotes(rows, options)) {
    text += wrapped(without_line_ends(note), kTerminalWidth);
  }
  return text;
}

}  // namespace penumbra
