#include "harness/table_json.h"

#include "harness/column_json.h"

namespace penumbra {
namespace {

using Json = nlohmann::ordered_json;

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
  json["columns"] = json_columns(efficiency_table_columns());
  json["rows"] = json_rows(efficiency_table_columns(), rows);
  // Names come from configs, which are valid UTF-8; whatever else is found stays readable.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace penumbra
