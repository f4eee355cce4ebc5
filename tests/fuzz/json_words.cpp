#include "tests/fuzz/json_words.h"

#include <nlohmann/json.hpp>
#include <set>

namespace penumbra {
namespace {

using nlohmann::json;

void gather(const json& schema, std::set<std::string>& words) {
  if (schema.is_array()) {
    for (const json& item : schema) gather(item, words);
  }
  if (!schema.is_object()) return;
  for (const auto& [key, value] : schema.items()) {
    if (key == "properties" && value.is_object()) {
      for (const auto& [name, unused] : value.items()) words.insert(name);
    }
    if (key == "const" && value.is_string()) words.insert(value.get<std::string>());
    if (key == "enum" && value.is_array()) {
      for (const json& text : value) {
        if (text.is_string()) words.insert(text.get<std::string>());
      }
    }
    gather(value, words);
  }
}

}  // namespace

std::vector<std::string> words_of_schema(std::string_view schema,
                                         const std::vector<std::string>& more) {
  std::set<std::string> words(more.begin(), more.end());
  gather(json::parse(schema), words);
  return {words.begin(), words.end()};
}

}  // namespace penumbra
