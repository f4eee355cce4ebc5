#include "scenes/core/json_schema_explain.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <utility>

#include "scenes/core/suggest.h"

namespace penumbra {

using nlohmann::json;

namespace {

bool has_type(const json& value, const std::string& type) {
  if (type == "integer") return value.is_number_integer();
  if (type == "number") return value.is_number();
  if (type == "string") return value.is_string();
  if (type == "boolean") return value.is_boolean();
  if (type == "array") return value.is_array();
  if (type == "object") return value.is_object();
  return value.is_null();
}

std::vector<std::string> types_of(const json& schema) {
  const auto found = schema.find("type");
  if (found == schema.end()) return {};
  if (found->is_array()) return found->get<std::vector<std::string>>();
  return {found->get<std::string>()};
}

bool accepts_type(const std::vector<std::string>& types, const json& value) {
  return types.empty() || std::any_of(types.begin(), types.end(), [&](const std::string& type) {
           return has_type(value, type);
         });
}

/// "number", "number or array", "integer, string or array".
std::string alternatives(const std::vector<std::string>& words) {
  std::string result;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) result += i + 1 == words.size() ? " or " : ", ";
    result += words[i];
  }
  return result;
}

std::string expected(const std::string& what, const json& found) {
  return "expected " + what + ", found " + describe_value(found);
}

/// A string without quotes, anything else as JSON.
std::string plain(const json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::string counted(const json& count, const std::string& noun) {
  return count.dump() + " " + noun + (count == 1 ? "" : "s");
}

/// "in [0, 1]", "of at least 1", "less than 180": the bounds of a number.
std::string bounds_text(const json& schema) {
  const bool low_open = schema.contains("exclusiveMinimum");
  const bool high_open = schema.contains("exclusiveMaximum");
  const json low = low_open ? schema["exclusiveMinimum"] : schema.value("minimum", json());
  const json high = high_open ? schema["exclusiveMaximum"] : schema.value("maximum", json());
  if (!low.is_null() && !high.is_null()) {
    return std::string("in ") + (low_open ? "(" : "[") + low.dump() + ", " + high.dump() +
           (high_open ? ")" : "]");
  }
  if (!low.is_null()) return (low_open ? "greater than " : "of at least ") + low.dump();
  return (high_open ? "less than " : "of at most ") + high.dump();
}

std::optional<std::string> number_fault(const json& schema, const json& value) {
  const double number = value.get<double>();
  const auto breaks = [&](const char* keyword, auto is_wrong) {
    const auto found = schema.find(keyword);
    return found != schema.end() && is_wrong(number, found->template get<double>());
  };
  const std::string noun =
      types_of(schema) == std::vector<std::string>{"integer"} ? "an integer " : "a number ";
  if (breaks("minimum", std::less<>()) || breaks("maximum", std::greater<>()) ||
      breaks("exclusiveMinimum", std::less_equal<>()) ||
      breaks("exclusiveMaximum", std::greater_equal<>())) {
    return "expected " + noun + bounds_text(schema) + ", found " + value.dump();
  }
  if (breaks("multipleOf", [](double n, double divisor) { return std::fmod(n, divisor) != 0.0; })) {
    return "expected a multiple of " + schema["multipleOf"].dump() + ", found " + value.dump();
  }
  return std::nullopt;
}

std::optional<std::string> string_fault(const json& schema, const json& value) {
  const std::string& text = value.get_ref<const std::string&>();
  if (text.size() < schema.value("minLength", std::size_t{0})) {
    return text.empty() ? "must not be empty"
                        : expected("at least " + counted(schema["minLength"], "character"), value);
  }
  const auto pattern = schema.find("pattern");
  if (pattern == schema.end() || std::regex_search(text, std::regex(pattern->get<std::string>()))) {
    return std::nullopt;
  }
  return expected(schema.value("description", "text like " + pattern->get<std::string>()), value);
}

std::optional<std::string> array_fault(const json& schema, const json& value) {
  const json size = value.size();
  const json low = schema.value("minItems", json(0));
  const json high = schema.value("maxItems", size);
  if (size < low || size > high) {
    const std::string found = ", found " + size.dump();
    if (low == high) return "expected " + counted(low, "item") + found;
    if (size < low) return "expected at least " + counted(low, "item") + found;
    return "expected at most " + counted(high, "item") + found;
  }
  if (schema.value("uniqueItems", false)) {
    for (auto item = value.begin(); item != value.end(); ++item) {
      if (std::find(value.begin(), item, *item) != item) return plain(*item) + " is listed twice";
    }
  }
  return std::nullopt;
}

/// What a value breaks of a schema's own keywords, keys of objects and alternatives apart.
std::optional<std::string> value_fault(const json& schema, const json& value) {
  if (const auto found = schema.find("const"); found != schema.end() && *found != value) {
    return expected(found->is_string() ? found->dump() : plain(*found), value);
  }
  if (const auto found = schema.find("enum"); found != schema.end()) {
    if (std::find(found->begin(), found->end(), value) == found->end()) {
      std::vector<std::string> allowed;
      for (const json& item : *found) allowed.push_back(plain(item));
      return unknown_name("value", plain(value), allowed);
    }
  }
  if (value.is_number()) return number_fault(schema, value);
  if (value.is_string()) return string_fault(schema, value);
  if (value.is_array()) return array_fault(schema, value);
  if (value.is_object() && value.size() < schema.value("minProperties", std::size_t{0})) {
    return "expected at least " + counted(schema["minProperties"], "entry") + ", found none";
  }
  return std::nullopt;
}

/// A key that has a constant in every branch of an alternative.
std::string find_discriminator(const std::vector<const json*>& branches) {
  const auto is_constant_in = [](const std::string& key, const json& branch) {
    const auto properties = branch.find("properties");
    return properties != branch.end() && properties->contains(key) &&
           (*properties)[key].contains("const");
  };
  const auto first = branches.front()->find("properties");
  if (first == branches.front()->end()) return {};
  for (const auto& [key, unused] : first->items()) {
    if (std::all_of(branches.begin(), branches.end(), [&, &name = key](const json* branch) {
          return is_constant_in(name, *branch);
        })) {
      return key;
    }
  }
  return {};
}

}  // namespace

SchemaExplainer::SchemaExplainer(const json& schema, const LocatedJson& document)
    : schema_(schema), document_(document) {}

const json& SchemaExplainer::resolve(const json& schema) const {
  const json* current = &schema;
  while (current->is_object() && current->contains("$ref")) {
    const std::string reference = (*current)["$ref"].get<std::string>();
    current = &schema_.at(json::json_pointer(reference.substr(1)));  // "#/definitions/..."
  }
  return *current;
}

SchemaExplainer::Choice SchemaExplainer::choose(const json& branches, const json& value) const {
  Choice choice;
  std::vector<const json*> resolved;
  for (const json& branch : branches) resolved.push_back(&resolve(branch));
  choice.discriminator = find_discriminator(resolved);
  for (const json* branch : resolved) {
    const std::vector<std::string> types = types_of(*branch);
    choice.types.insert(choice.types.end(), types.begin(), types.end());
    bool fits = accepts_type(types, value);
    if (!choice.discriminator.empty()) {
      const json& constant = (*branch)["properties"][choice.discriminator]["const"];
      choice.names.push_back(plain(constant));
      fits =
          fits && value.contains(choice.discriminator) && value[choice.discriminator] == constant;
    }
    if (fits && choice.branch == nullptr) choice.branch = branch;
  }
  return choice;
}

void SchemaExplainer::collect(const json& schema, const json& value, Schemas& result) const {
  const json& resolved = resolve(schema);
  if (!resolved.is_object()) return;
  result.push_back(&resolved);
  for (const char* keyword : {"oneOf", "anyOf"}) {
    if (!resolved.contains(keyword)) continue;
    const Choice choice = choose(resolved[keyword], value);
    if (choice.branch != nullptr) collect(*choice.branch, value, result);
  }
  if (resolved.contains("allOf")) {
    for (const json& part : resolved["allOf"]) collect(part, value, result);
  }
}

SchemaExplainer::Schemas SchemaExplainer::descend(const Schemas& schemas, const std::string& token,
                                                  const json& value) const {
  Schemas result;
  for (const json* schema : schemas) {
    const auto properties = schema->find("properties");
    if (properties != schema->end() && properties->contains(token)) {
      collect((*properties)[token], value, result);
    } else if (schema->contains("additionalProperties")) {
      collect((*schema)["additionalProperties"], value, result);
    } else if (schema->contains("items")) {
      collect((*schema)["items"], value, result);
    }
  }
  return result;
}

void SchemaExplainer::explain(const std::string& pointer, DiagnosticList& diagnostics) const {
  const json* value = &document_.root();
  Schemas schemas;
  collect(schema_, *value, schemas);
  for (const std::string& token : split_pointer(pointer)) {
    value = value->is_array() ? &value->at(std::stoul(token)) : &value->at(token);
    schemas = descend(schemas, token, *value);
  }
  for (const json* schema : schemas) {
    const std::vector<std::string> types = types_of(*schema);
    if (!accepts_type(types, *value)) {
      diagnostics.add(document_.value_at(pointer), pointer, expected(alternatives(types), *value));
      return;
    }
    if (const auto fault = value_fault(*schema, *value)) {
      diagnostics.add(document_.value_at(pointer), pointer, *fault);
    }
    if (value->is_object()) explain_keys(*schema, *value, pointer, diagnostics);
    for (const char* keyword : {"oneOf", "anyOf"}) {
      if (schema->contains(keyword)) {
        explain_choice((*schema)[keyword], *value, pointer, diagnostics);
      }
    }
  }
}

void SchemaExplainer::explain_choice(const json& branches, const json& value,
                                     const std::string& pointer,
                                     DiagnosticList& diagnostics) const {
  const Choice choice = choose(branches, value);
  if (choice.branch != nullptr) return;
  const std::string& key = choice.discriminator;
  if (key.empty() || !value.is_object()) {
    diagnostics.add(document_.value_at(pointer), pointer,
                    expected(alternatives(choice.types), value));
  } else if (!value.contains(key)) {
    diagnostics.add(document_.value_at(pointer), pointer,
                    "missing key \"" + key + "\" (" + allowed_names(choice.names) + ")");
  } else {
    const std::string place = child_pointer(pointer, key);
    diagnostics.add(document_.value_at(place), place,
                    value[key].is_string() ? unknown_name(key, plain(value[key]), choice.names)
                                           : expected("string", value[key]));
  }
}

void SchemaExplainer::explain_keys(const json& schema, const json& value,
                                   const std::string& pointer, DiagnosticList& diagnostics) const {
  for (const json& key : schema.value("required", json::array())) {
    if (value.contains(key.get<std::string>())) continue;
    diagnostics.add(document_.value_at(pointer), pointer,
                    "missing key \"" + key.get<std::string>() + "\"");
  }
  if (schema.value("additionalProperties", json(true)) != json(false)) return;
  const json properties = schema.value("properties", json::object());
  std::vector<std::string> allowed;
  for (const auto& [key, unused] : properties.items()) {
    if (!key.starts_with('$')) allowed.push_back(key);
  }
  for (const auto& [key, unused] : value.items()) {
    if (properties.contains(key)) continue;
    const std::string place = child_pointer(pointer, key);
    diagnostics.add(document_.key_at(place), place, unknown_name("key", key, allowed));
  }
}

}  // namespace penumbra
