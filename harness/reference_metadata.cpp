#include "harness/reference_metadata.h"

#include <fmt/format.h>

#include <charconv>
#include <limits>
#include <nlohmann/json.hpp>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

using nlohmann::json;

[[noreturn]] void fail(const ExrFile& exr, const char* key, const std::string& what) {
  throw ReferenceError(
      fmt::format("{}: not a reference: metadata \"{}\" {}", exr.path.string(), key, what));
}

bool is_count(const json& value) {
  return value.is_number_unsigned() &&
         value.get<std::uint64_t>() <= std::uint64_t{std::numeric_limits<int>::max()};
}

bool is_entry(const json& entry) {
  return entry.is_object() && entry.contains("estimator") && entry["estimator"].is_string() &&
         entry.contains("passes") && is_count(entry["passes"]) &&
         (!entry.contains("tile") || is_count(entry["tile"]));
}

}  // namespace

const std::string& reference_text(const ExrFile& exr, const char* key) {
  const auto found = exr.metadata.find(key);
  if (found == exr.metadata.end()) fail(exr, key, "is missing");
  return found->second;
}

int reference_count(const ExrFile& exr, const char* key) {
  const std::string& text = reference_text(exr, key);
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 1) {
    fail(exr, key, fmt::format("is \"{}\"; expected a whole number from 1 on", text));
  }
  return value;
}

json reference_lineage(const ExrFile& exr) {
  const json lineage = json::parse(reference_text(exr, "lineage"), nullptr, false);
  bool sound = lineage.is_array();
  for (const json& entry : lineage) sound = sound && is_entry(entry);
  if (!sound) {
    fail(exr, "lineage",
         "is not the list of what was rendered; expected JSON objects with \"estimator\" and "
         "\"passes\"");
  }
  return lineage;
}

}  // namespace penumbra
