#include "harness/text_grid.h"

#include <algorithm>

namespace penumbra {
namespace {

constexpr std::size_t kShortestName = 6;

/// Length in code points.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::vector<std::size_t> widths_of(const TextGrid& grid) {
  std::vector<std::size_t> widths;
  for (const GridColumn& column : grid.columns) widths.push_back(width_of(column.title));
  for (const auto& line : grid.lines) {
    for (std::size_t c = 0; c < line.size(); ++c)
      widths[c] = std::max(widths[c], width_of(line[c]));
  }
  return widths;
}

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

/// Narrows the widest of the name columns until the line fits.
void fit_names(std::vector<std::size_t>& widths, std::size_t names) {
  std::size_t total = widths.size() - 1;
  for (const std::size_t width : widths) total += width;
  const auto end = widths.begin() + static_cast<std::ptrdiff_t>(names);
  for (; total > kTerminalWidth; --total) {
    const auto widest = std::max_element(widths.begin(), end);
    if (widest == end || *widest <= kShortestName) return;
    --*widest;
  }
}

std::string escaped(std::string text) {
  for (std::size_t i = 0; (i = text.find('|', i)) != std::string::npos; i += 2)
    text.insert(i, "\\");
  return text;
}

std::string without_line_ends(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

std::vector<std::string> titles_of(const TextGrid& grid) {
  std::vector<std::string> titles;
  for (const GridColumn& column : grid.columns) titles.push_back(column.title);
  return titles;
}

}  // namespace

std::string markdown_grid(const TextGrid& grid) {
  TextGrid clean = grid;
  for (auto& line : clean.lines) {
    for (std::string& field : line) field = escaped(without_line_ends(field));
  }
  const std::vector<std::size_t> widths = widths_of(clean);
  std::string text;
  const auto add_line = [&](const std::vector<std::string>& line) {
    text += "|";
    for (std::size_t c = 0; c < line.size(); ++c) {
      text += " " + padded(line[c], widths[c], clean.columns[c].is_text) + " |";
    }
    text += "\n";
  };
  add_line(titles_of(clean));
  text += "|";
  for (std::size_t c = 0; c < widths.size(); ++c) {
    const std::string dashes(widths[c], '-');
    text += clean.columns[c].is_text ? ":" + dashes + "-|" : "-" + dashes + ":|";
  }
  text += "\n";
  for (const auto& line : clean.lines) add_line(line);
  return text;
}

std::string terminal_grid(const TextGrid& grid, std::size_t names) {
  std::vector<std::size_t> widths = widths_of(grid);
  fit_names(widths, names);
  std::string text;
  const auto add_line = [&](const std::vector<std::string>& line) {
    std::string out;
    for (std::size_t c = 0; c < line.size(); ++c) {
      const std::string field = c < names ? shortened(line[c], widths[c]) : line[c];
      out +=
          (c > 0 ? " " : "") + padded(without_line_ends(field), widths[c], grid.columns[c].is_text);
    }
    out.erase(out.find_last_not_of(' ') + 1);
    text += out + "\n";
  };
  add_line(titles_of(grid));
  for (const auto& line : grid.lines) add_line(line);
  return text;
}

std::string markdown_notes(std::span<const std::string> notes) {
  std::string text;
  for (const std::string& note : notes) text += "- " + escaped(without_line_ends(note)) + "\n";
  return text;
}

std::string terminal_notes(std::span<const std::string> notes) {
  std::string text;
  for (const std::string& note : notes) text += wrapped(without_line_ends(note), kTerminalWidth);
  return text;
}

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

}  // namespace penumbra
