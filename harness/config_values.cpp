#include "harness/config_values.h"

#include <cmath>

namespace penumbra {

using nlohmann::json;

bool is_utf8(const std::string& text) {
  try {
    json(text).dump();
    return true;
  } catch (const json::type_error&) {
    return false;
  }
}

nlohmann::ordered_json number_to_json(double value) {
  if (std::isfinite(value)) return value;
  if (std::isnan(value)) return "nan";
  return value > 0.0 ? "inf" : "-inf";
}

std::optional<ParamValue> param_from_json(const json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (holds<std::int64_t>(value)) return value.get<std::int64_t>();
  if (value.is_number()) return value.get<double>();
  if (value.is_string()) return value.get<std::string>();
  return std::nullopt;
}

json param_to_json(const ParamValue& value) {
  return std::visit([](const auto& held) { return json(held); }, value);
}

}  // namespace penumbra
