#include "harness/table_json.h"

#include <nlohmann/json.hpp>

namespace penumbra {
namespace {

using Json = nlohmann::ordered_json;

Json value_of(const Column<EfficiencyRow>& column, const EfficiencyRow& row) {
  const std::string text = column.text(row);
  if (!column.numeric) return text;
  if (text.empty()) return nullptr;
  const Json number = Json::parse(text, nullptr, false);
  return number.is_number() ? number : Json(text);
}

Json optional_text(const std::optional<std::string>& text) { return text ? Json(*text) : Json(); }

}  // namespace

std::string to_json(std::span<const EfficiencyRow> rows, const TableOptions& options) {
  Json json;
  json["format"] = "penumbra-efficiency";
  json["version"] = kEfficiencyJsonVersion;
  json["baseline"] = options.baseline;
  json["tuned_baseline"] = optional_text(options.tuned_baseline);
  json["confidence"] = options.confidence;
  json["primary_time"] = options.primary == PrimaryTime::Cpu ? "cpu" : "wall";
  json["relmse_epsilon"] = options.relmse_epsilon;
  json["columns"] = Json::array();
  for (const auto& column : efficiency_table_columns()) {
    const Json unit = column.unit.empty() ? Json() : Json(column.unit);
    json["columns"].push_back({{"name", column.name}, {"unit", unit}});
  }
  json["rows"] = Json::array();
  for (const EfficiencyRow& row : rows) {
    Json& object = json["rows"].emplace_back(Json::object());
    for (const auto& column : efficiency_table_columns()) {
      object[std::string(column.name)] = value_of(column, row);
    }
  }
  // Names come from configs, which are valid UTF-8; whatever else is found stays readable.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace penumbra
