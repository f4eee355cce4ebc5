#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Aligned text tables. Lengths are of code points; line ends inside fields become blanks.
namespace penumbra {

/// Widest line of a terminal [code points].
inline constexpr std::size_t kTerminalWidth = 119;

struct GridColumn {
  std::string title;
  bool is_text{false};  ///< to the left, numbers to the right
};

/// Fields by line and column, without the titles.
struct TextGrid {
  std::vector<GridColumn> columns;
  std::vector<std::vector<std::string>> lines;
};

/// A pipe table.
std::string markdown_grid(const TextGrid& grid);

/// Lines of at most kTerminalWidth. Where they would be longer, the widest of the first columns
/// are narrowed, their fields shortened in the middle with '~'.
/// @param names  how many columns may be shortened, all of text, at the front
std::string terminal_grid(const TextGrid& grid, std::size_t names);

/// List items.
std::string markdown_notes(std::span<const std::string> notes);

/// One note after another, wrapped.
std::string terminal_notes(std::span<const std::string> notes);

/// Text broken into lines of at most `width` bytes, at blanks or inside a word that is too long;
/// ends with a line end.
std::string wrapped(const std::string& text, std::size_t width);

}  // namespace penumbra
