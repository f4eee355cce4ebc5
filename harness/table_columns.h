#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "harness/csv.h"
#include "scenes/core/error.h"

/// Tables whose rows are structs: one list of columns serves header, writers and reader. A type of
/// a member needs `csv_text` and `parse_csv`, found beside csv.h's or beside the type.
namespace penumbra {

template <class T>
struct IsNumber : std::is_arithmetic<T> {};
template <class T>
struct IsNumber<std::optional<T>> : IsNumber<T> {};

template <class Row>
struct Column {
  std::string_view name;
  std::string (*text)(const Row&);
  bool (*parse)(std::string_view, Row&);
  bool numeric{false};      ///< a number, or nothing; otherwise text
  std::string_view unit{};  ///< empty: none
  bool required{true};      ///< otherwise absent from files of older versions
};

template <class Row, class T>
Row row_of_member(T Row::*);
template <class Row, class T>
T type_of_member(T Row::*);

template <auto member, class Row = decltype(row_of_member(member))>
constexpr Column<Row> column(std::string_view name, std::string_view unit = {}) {
  return {name,
          [](const Row& row) { return std::string(csv_text(row.*member)); },
          [](std::string_view text, Row& row) { return parse_csv(text, row.*member); },
          IsNumber<decltype(type_of_member(member))>::value,
          unit,
          true};
}

template <auto member, class Row = decltype(row_of_member(member))>
constexpr Column<Row> later_column(std::string_view name, std::string_view unit = {}) {
  Column<Row> result = column<member>(name, unit);
  result.required = false;
  return result;
}

/// A column of a struct inside the row.
template <auto outer, auto member, class Row = decltype(row_of_member(outer))>
constexpr Column<Row> inner_column(std::string_view name, std::string_view unit = {}) {
  return {name,
          [](const Row& row) { return std::string(csv_text(row.*outer.*member)); },
          [](std::string_view text, Row& row) { return parse_csv(text, row.*outer.*member); },
          IsNumber<decltype(type_of_member(member))>::value,
          unit,
          true};
}

template <class Columns>
CsvRecord names_of(const Columns& columns) {
  CsvRecord names;
  for (const auto& c : columns) names.emplace_back(c.name);
  return names;
}

template <class Columns, class Row>
CsvRecord record_of(const Columns& columns, const Row& row) {
  CsvRecord record;
  for (const auto& c : columns) record.push_back(c.text(row));
  return record;
}

/// The whole of a CSV file.
template <class Columns, class Rows>
std::string csv_of(const Columns& columns, const Rows& rows) {
  std::string text = csv_line(names_of(columns));
  for (const auto& row : rows) text += csv_line(record_of(columns, row));
  return text;
}

/// @return place of each column in the file, none for one that older versions did not write
/// @throws InputError listing missing and unknown ones
template <class Columns>
std::vector<std::optional<std::size_t>> places_of(const Columns& columns, const CsvTable& table,
                                                  const std::filesystem::path& file) {
  std::set<std::string_view> unknown(table.header.begin(), table.header.end());
  std::vector<std::string_view> missing;
  std::vector<std::optional<std::size_t>> places;
  for (const auto& c : columns) {
    unknown.erase(c.name);
    const std::optional<std::size_t> place = table.column(c.name);
    if (!place && c.required) missing.push_back(c.name);
    places.push_back(place);
  }
  if (missing.empty() && unknown.empty()) return places;
  throw InputError(fmt::format("{}:1: missing columns: \"{}\"; unknown columns: \"{}\"",
                               file.string(), fmt::join(missing, ","), fmt::join(unknown, ",")));
}

/// @throws InputError naming file, row and column of a value that cannot be read, and as places_of
template <class Row, class Columns>
std::vector<Row> rows_of(const Columns& columns, const CsvTable& table,
                         const std::filesystem::path& file) {
  std::vector<Row> rows;
  if (table.header.empty()) return rows;
  const std::vector<std::optional<std::size_t>> places = places_of(columns, table, file);
  for (const CsvRecord& record : table.rows) {
    Row& row = rows.emplace_back();
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (!places[i]) continue;
      const std::string& text = record[*places[i]];
      if (columns[i].parse(text, row)) continue;
      throw InputError(fmt::format("{}: row {}: column {}: \"{}\" is not a value of it",
                                   file.string(), rows.size(), columns[i].name, text));
    }
  }
  return rows;
}

/// Reads a table that is always written as a whole.
/// @throws InputError as read_csv and rows_of, and when the last line is incomplete
template <class Row, class Columns>
std::vector<Row> read_whole_table(const Columns& columns, const std::filesystem::path& file) {
  const CsvTable table = read_csv(file);
  if (table.torn_tail) {
    throw InputError(
        fmt::format("{}: the last line is incomplete; make the report again", file.string()));
  }
  return rows_of<Row>(columns, table, file);
}

}  // namespace penumbra
