#include "harness/config_overrides.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "harness/config_values.h"
#include "scenes/core/suggest.h"

namespace penumbra {

using nlohmann::json;

namespace {

/// Thrown and caught in this file only.
struct PathFault {
  std::string pointer;
  std::string message;
};

/// The label, or else the name, of each element that has one; empty for the others.
std::vector<std::string> element_names(const json& array) {
  std::vector<std::string> names;
  for (const json& element : array) {
    std::string name;
    for (const char* key : {"name", "label"}) {
      if (element.is_object() && element.contains(key) && element[key].is_string()) {
        name = element[key].get<std::string>();
      }
    }
    names.push_back(std::move(name));
  }
  return names;
}

/// Takes the first key off a path: all up to a dot.
std::string take_key(std::string_view& path) {
  const std::size_t dot = path.find('.');
  std::string key(path.substr(0, dot));
  path = dot == std::string_view::npos ? std::string_view() : path.substr(dot + 1);
  return key;
}

/// Takes the name or index of an element off a path. Names may hold dots, so the longest that fits
/// is taken.
std::size_t take_element(const json& array, const std::string& pointer, std::string_view& path) {
  const std::vector<std::string> names = element_names(array);
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string& name = names[i];
    const bool fits = !name.empty() && path.starts_with(name) &&
                      (path.size() == name.size() || path[name.size()] == '.');
    if (fits && (!best || name.size() > names[*best].size())) best = i;
  }
  if (best) {
    path.remove_prefix(std::min(path.size(), names[*best].size() + 1));
    return *best;
  }
  const std::string token = take_key(path);
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), index);
  if (error != std::errc() || end != token.data() + token.size()) {
    std::vector<std::string> known = names;
    std::erase(known, std::string());
    throw PathFault{pointer, unknown_name("element", token, known)};
  }
  if (index >= array.size()) {
    throw PathFault{pointer, "element " + token + " does not exist; there are " +
                                 std::to_string(array.size()) + ", counted from 0"};
  }
  return index;
}

/// The JSON pointer that a path means in this document.
std::string resolve_path(const json& root, std::string_view path) {
  const json missing;
  const json* value = &root;
  std::string pointer;
  do {
    if (value->is_array()) {
      const std::size_t index = take_element(*value, pointer, path);
      pointer = child_pointer(pointer, index);
      value = &(*value)[index];
    } else if (value->is_object() || value->is_null()) {
      const std::string key = take_key(path);
      if (key.empty()) throw PathFault{pointer, "the path has an empty key"};
      pointer = child_pointer(pointer, key);
      value = value->contains(key) ? &(*value)[key] : &missing;
    } else {
      throw PathFault{pointer, "has no keys; it is " + describe_value(*value)};
    }
  } while (!path.empty());
  return pointer;
}

}  // namespace

void apply_overrides(const std::vector<std::string>& overrides, LocatedJson& document,
                     DiagnosticList& faults) {
  for (const std::string& text : overrides) {
    const std::string source = "--set " + text;
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) {
      faults.add({source, 0, 0}, "", "expected key.path=value");
      continue;
    }
    // The resolved config could not state it.
    if (!is_utf8(text)) {
      faults.add({source, 0, 0}, "", "is not UTF-8");
      continue;
    }
    const std::string value_text = text.substr(equals + 1);
    json value = json::parse(value_text, nullptr, false);
    if (value.is_discarded()) value = value_text;
    try {
      const std::string pointer =
          resolve_path(document.root(), std::string_view(text).substr(0, equals));
      document.override_value(pointer, std::move(value), source);
    } catch (const PathFault& fault) {
      faults.add({source, 0, 0}, fault.pointer, fault.message);
    }
  }
}

}  // namespace penumbra
