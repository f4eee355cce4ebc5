#include "estimators/params.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "scenes/core/error.h"
#include "scenes/core/suggest.h"

namespace penumbra {

namespace {

/// Shortest text that reads back as the same number.
std::string number_text(double value) {
  std::array<char, 32> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  PN_CHECK(error == std::errc(), "a double needs at most 24 characters");
  return {buffer.data(), end};
}

std::string type_name(const ParamValue& value) {
  constexpr std::array<const char*, 4> kNames{"boolean", "integer", "number", "string"};
  return kNames[value.index()];
}

std::string found_text(const ParamValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return "string \"" + *text + "\"";
  return type_name(value) + " " + to_string(value);
}

/// "in [1, 8]", "of at least 1", "of at most 8"; empty where every number is allowed.
std::string range_text(const ParamSpec& spec) {
  const bool bounded_below = std::isfinite(spec.min);
  const bool bounded_above = std::isfinite(spec.max);
  if (bounded_below && bounded_above) {
    return "in [" + number_text(spec.min) + ", " + number_text(spec.max) + "]";
  }
  if (bounded_below) return "of at least " + number_text(spec.min);
  if (bounded_above) return "of at most " + number_text(spec.max);
  return {};
}

std::string check_number(const ParamSpec& spec, double number, const ParamValue& value) {
  if (std::isfinite(number) && number >= spec.min && number <= spec.max) return {};
  const std::string range = range_text(spec);
  const bool is_integer = std::holds_alternative<std::int64_t>(spec.default_value);
  return std::string("expected ") +
         (is_integer              ? "an integer"
          : std::isfinite(number) ? "a number"
                                  : "a finite number") +
         (range.empty() ? "" : " " + range) + ", found " + to_string(value);
}

}  // namespace

std::string to_string(const ParamValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return std::to_string(*integer);
  if (const auto* real = std::get_if<double>(&value)) return number_text(*real);
  return std::get<std::string>(value);
}

const ParamValue& ParamSet::at(std::string_view name) const {
  const auto found = values_.find(name);
  PN_CHECK(found != values_.end(), "the estimator's table has no parameter of this name");
  return found->second;
}

bool ParamSet::boolean(std::string_view name) const {
  const auto* value = std::get_if<bool>(&at(name));
  PN_CHECK(value != nullptr, "the parameter is not a boolean");
  return *value;
}

std::int64_t ParamSet::integer(std::string_view name) const {
  const auto* value = std::get_if<std::int64_t>(&at(name));
  PN_CHECK(value != nullptr, "the parameter is not an integer");
  return *value;
}

double ParamSet::real(std::string_view name) const {
  const auto* value = std::get_if<double>(&at(name));
  PN_CHECK(value != nullptr, "the parameter is not a real number");
  return *value;
}

const std::string& ParamSet::text(std::string_view name) const {
  const auto* value = std::get_if<std::string>(&at(name));
  PN_CHECK(value != nullptr, "the parameter is not a string");
  return *value;
}

std::string ParamSet::differences(std::span<const ParamSpec> specs) const {
  std::string result;
  for (const ParamSpec& spec : specs) {
    const ParamValue& value = at(spec.name);
    if (value == spec.default_value) continue;
    if (!result.empty()) result += ',';
    result += spec.name + "=" + to_string(value);
  }
  return result;
}

std::string check_param(const ParamSpec& spec, const ParamValue& value) {
  const bool wants_real = std::holds_alternative<double>(spec.default_value);
  const bool widens = wants_real && std::holds_alternative<std::int64_t>(value);
  if (value.index() != spec.default_value.index() && !widens) {
    return "expected " + type_name(spec.default_value) + ", found " + found_text(value);
  }
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    return check_number(spec, static_cast<double>(*integer), value);
  }
  if (const auto* real = std::get_if<double>(&value)) return check_number(spec, *real, value);
  if (const auto* text = std::get_if<std::string>(&value)) {
    if (std::find(spec.choices.begin(), spec.choices.end(), *text) == spec.choices.end()) {
      return unknown_name("value", *text, spec.choices);
    }
  }
  return {};
}

ParamSet resolve_params(std::span<const ParamSpec> specs, const ParamSet::Map& given,
                        std::vector<ParamProblem>& problems) {
  ParamSet::Map values;
  std::vector<std::string> names;
  for (const ParamSpec& spec : specs) {
    values[spec.name] = spec.default_value;
    names.push_back(spec.name);
  }
  for (const auto& [name, value] : given) {
    const auto spec = std::find_if(specs.begin(), specs.end(),
                                   [&, &key = name](const ParamSpec& s) { return s.name == key; });
    if (spec == specs.end()) {
      problems.push_back({name, unknown_name("parameter", name, names)});
    } else if (std::string message = check_param(*spec, value); !message.empty()) {
      problems.push_back({name, std::move(message)});
    } else if (const auto* integer = std::get_if<std::int64_t>(&value);
               integer != nullptr && std::holds_alternative<double>(spec->default_value)) {
      values[name] = static_cast<double>(*integer);
    } else {
      values[name] = value;
    }
  }
  return ParamSet(std::move(values));
}

}  // namespace penumbra
