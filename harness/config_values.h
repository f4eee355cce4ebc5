#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "estimators/params.h"

/// Reading of JSON values that may be of the wrong type, which the schema has then reported.
namespace penumbra {

template <typename T>
bool holds(const nlohmann::json& value) {
  if constexpr (std::is_same_v<T, bool>) {
    return value.is_boolean();
  } else if constexpr (std::is_integral_v<T>) {
    return value.is_number_unsigned()
               ? std::in_range<T>(value.get<std::uint64_t>())
               : value.is_number_integer() && std::in_range<T>(value.get<std::int64_t>());
  } else if constexpr (std::is_floating_point_v<T>) {
    return value.is_number();
  } else {
    return value.is_string();
  }
}

/// Sets `result` to the member `key` where there is one of its type.
template <typename T>
void take(const nlohmann::json& object, const char* key, T& result) {
  if (!object.is_object()) return;
  const auto found = object.find(key);
  if (found != object.end() && holds<T>(*found)) result = found->template get<T>();
}

/// The member `key` where it is an array of exactly N integers.
template <std::size_t N>
std::optional<std::array<int, N>> take_integers(const nlohmann::json& object, const char* key) {
  if (!object.is_object() || !object.contains(key)) return std::nullopt;
  const nlohmann::json& value = object[key];
  if (!value.is_array() || value.size() != N) return std::nullopt;
  for (const nlohmann::json& item : value) {
    if (!holds<int>(item)) return std::nullopt;
  }
  return value.get<std::array<int, N>>();
}

/// The member `key`, or an empty array where it is none.
inline const nlohmann::json& array_member(const nlohmann::json& object, const char* key) {
  static const nlohmann::json kEmpty = nlohmann::json::array();
  if (!object.is_object() || !object.contains(key) || !object[key].is_array()) return kEmpty;
  return object[key];
}

/// The member `key`, or an empty object where it is none.
inline const nlohmann::json& object_member(const nlohmann::json& object, const char* key) {
  static const nlohmann::json kEmpty = nlohmann::json::object();
  if (!object.is_object() || !object.contains(key) || !object[key].is_object()) return kEmpty;
  return object[key];
}

/// Whether a text can stand in JSON.
bool is_utf8(const std::string& text);

/// The number, or "nan", "inf" or "-inf": JSON has none that is not finite, and a null would not
/// say which one it was.
nlohmann::ordered_json number_to_json(double value);

/// A scalar as the value of a parameter; nullopt for null, arrays and objects.
std::optional<ParamValue> param_from_json(const nlohmann::json& value);

nlohmann::json param_to_json(const ParamValue& value);

}  // namespace penumbra
