// stability.csv and stability.json: one list of columns for both.

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "harness/stability/stability.h"
#include "harness/table_columns.h"

namespace penumbra::stability {
namespace {

using Json = nlohmann::ordered_json;

/// One column of a table that is only written.
struct OutColumn {
  std::string_view name;
  std::string (*text)(const StabilityRow&);
  bool numeric{true};
  std::string_view unit{};
};

template <auto member>
constexpr OutColumn out(std::string_view name, std::string_view unit = {}) {
  using T = decltype(type_of_member(member));
  return {name, [](const StabilityRow& row) { return std::string(csv_text(row.*member)); },
          IsNumber<T>::value, unit};
}

/// A member of the error at one of several numbers of rays; empty where it was not measured.
template <std::size_t level, auto member>
constexpr OutColumn out_level(std::string_view name, std::string_view unit = {}) {
  return {name,
          [](const StabilityRow& row) {
            return row.levels.size() > level ? std::string(csv_text(row.levels[level].*member))
                                             : std::string();
          },
          true, unit};
}

#define PN_OUT(member) out<&StabilityRow::member>(#member)
#define PN_LEVEL(level, suffix)                                        \
  out_level<level, &ErrorLevel::srl>("srl_" suffix),                   \
      out_level<level, &ErrorLevel::estimates>("estimates_" suffix),   \
      out_level<level, &ErrorLevel::rel_mse>("rel_mse_" suffix),       \
      out_level<level, &ErrorLevel::rel_mse_se>("rel_mse_se_" suffix), \
      out_level<level, &ErrorLevel::cpu_s>("cpu_" suffix "_s", "s")

// clang-format off
constexpr std::array kColumns{
    out<&StabilityRow::case_name>("case"), PN_OUT(ids), PN_OUT(parameter), PN_OUT(step),
    PN_OUT(value), PN_OUT(method), PN_OUT(estimator), PN_OUT(params), PN_OUT(declared_bias),
    PN_OUT(srl), PN_OUT(srl_initial), PN_OUT(srl_adaptive), PN_OUT(lights),
    out<&StabilityRow::exact>("exact", "W/(m^2 sr)"),
    OutColumn{"verdict", [](const StabilityRow& r) { return std::string(to_string(r.verdict)); }, false},
    PN_OUT(reason), PN_OUT(estimates), PN_OUT(samples), PN_OUT(rays), PN_OUT(zeros),
    PN_OUT(non_finite), PN_OUT(negative), PN_OUT(uncovered),
    PN_OUT(bias), PN_OUT(bias_lo), PN_OUT(bias_hi), PN_OUT(p), PN_OUT(p_adjusted),
    PN_OUT(confirmed_bias), PN_OUT(confirmed_p), PN_OUT(tolerance),
    PN_OUT(rel_variance), PN_OUT(largest_over_mean), PN_OUT(kurtosis),
    PN_OUT(slope), PN_OUT(slope_lo), PN_OUT(slope_hi),
    out<&StabilityRow::cpu_s>("cpu_s", "s"), out<&StabilityRow::cost>("cost", "s"),
    PN_LEVEL(0, "1"), PN_LEVEL(1, "2"), PN_LEVEL(2, "3"), PN_OUT(replay)};
// clang-format on

#undef PN_OUT
#undef PN_LEVEL

Json value_of(const OutColumn& column, const StabilityRow& row) {
  const std::string text = column.text(row);
  if (!column.numeric) return text;
  if (text.empty()) return nullptr;
  const Json number = Json::parse(text, nullptr, false);
  return number.is_number() ? number : Json(text);
}

Json cases_json(const StabilityResult& result) {
  Json list = Json::array();
  for (const StabilityCase& c : stability_cases()) {
    if (std::find(result.cases.begin(), result.cases.end(), c.name) == result.cases.end()) continue;
    list.push_back({{"name", c.name},
                    {"ids", c.ids},
                    {"summary", c.summary},
                    {"parameter", c.parameter},
                    {"answer", c.answer},
                    {"values", c.values}});
  }
  return list;
}

}  // namespace

std::string to_csv(const StabilityResult& result) {
  std::string text = csv_line(names_of(kColumns));
  for (const StabilityRow& row : result.rows) text += csv_line(record_of(kColumns, row));
  return text;
}

std::string to_json(const StabilityResult& result) {
  Json json;
  json["format"] = "penumbra-stability";
  json["version"] = 1;
  json["quick"] = result.quick;
  json["passed"] = passed(result);
  json["wall_s"] = result.wall_s;
  json["rules"] = Json::object();
  for (const auto& [verdict, text] : rules_in_words()) {
    json["rules"][std::string(to_string(verdict))] = text;
  }
  json["bias_rule"] = bias_rule_in_words();
  json["left_out"] = result.left_out;
  json["cases"] = cases_json(result);
  json["columns"] = Json::array();
  for (const OutColumn& column : kColumns) {
    const Json unit = column.unit.empty() ? Json() : Json(column.unit);
    json["columns"].push_back({{"name", column.name}, {"unit", unit}});
  }
  json["rows"] = Json::array();
  for (const StabilityRow& row : result.rows) {
    Json& object = json["rows"].emplace_back(Json::object());
    for (const OutColumn& column : kColumns) {
      object[std::string(column.name)] = value_of(column, row);
    }
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace penumbra::stability
