#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "harness/table_columns.h"

/// Tables whose rows are structs, as JSON: names, order and units are those of the CSV file.
namespace penumbra {

/// An empty number is null. JSON has no NaN: a number that is not finite is a string, as in CSV.
template <class Row>
nlohmann::ordered_json json_value(const Column<Row>& column, const Row& row) {
  const std::string text = column.text(row);
  if (!column.numeric) return text;
  if (text.empty()) return nullptr;
  const auto number = nlohmann::ordered_json::parse(text, nullptr, false);
  return number.is_number() ? number : nlohmann::ordered_json(text);
}

/// [{"name", "unit"}], the unit null where there is none.
template <class Columns>
nlohmann::ordered_json json_columns(const Columns& columns) {
  auto result = nlohmann::ordered_json::array();
  for (const auto& column : columns) {
    const nlohmann::ordered_json unit =
        column.unit.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(column.unit);
    result.push_back({{"name", column.name}, {"unit", unit}});
  }
  return result;
}

/// [{column: value}]
template <class Columns, class Rows>
nlohmann::ordered_json json_rows(const Columns& columns, const Rows& rows) {
  auto result = nlohmann::ordered_json::array();
  for (const auto& row : rows) {
    auto& object = result.emplace_back(nlohmann::ordered_json::object());
    for (const auto& column : columns) {
      object[std::string(column.name)] = json_value(column, row);
    }
  }
  return result;
}

}  // namespace penumbra
