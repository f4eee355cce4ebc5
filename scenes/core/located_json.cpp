#include "scenes/core/located_json.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <utility>

namespace penumbra {

using nlohmann::json;

std::string child_pointer(std::string_view parent, std::string_view key) {
  std::string result(parent);
  result += '/';
  for (const char c : key) {
    if (c == '~') {
      result += "~0";
    } else if (c == '/') {
      result += "~1";
    } else {
      result += c;
    }
  }
  return result;
}

std::string child_pointer(std::string_view parent, std::size_t index) {
  return std::string(parent) + '/' + std::to_string(index);
}

std::vector<std::string> split_pointer(std::string_view pointer) {
  std::vector<std::string> tokens;
  for (std::size_t i = 0; i < pointer.size(); ++i) {
    if (pointer[i] == '/') {
      tokens.emplace_back();
    } else if (pointer[i] == '~' && i + 1 < pointer.size()) {
      tokens.back() += pointer[++i] == '1' ? '/' : '~';
    } else {
      tokens.back() += pointer[i];
    }
  }
  return tokens;
}

std::string describe_value(const json& value) {
  constexpr std::size_t kMaxText = 60;
  switch (value.type()) {
    case json::value_t::object:
      return "object";
    case json::value_t::array:
      return "array of " + std::to_string(value.size()) + (value.size() == 1 ? " item" : " items");
    case json::value_t::string:
      break;
    case json::value_t::number_float:
    case json::value_t::number_integer:
    case json::value_t::number_unsigned:
      return "number " + value.dump();
    default:
      return value.dump();
  }
  const std::string& text = value.get_ref<const std::string&>();
  const bool cut = text.size() > kMaxText;
  return "string \"" + (cut ? text.substr(0, kMaxText) + "..." : text) + "\"";
}

LocatedJson::LocatedJson() : root_(std::make_unique<json>()) {}
LocatedJson::LocatedJson(LocatedJson&&) noexcept = default;
LocatedJson& LocatedJson::operator=(LocatedJson&&) noexcept = default;
LocatedJson::~LocatedJson() = default;

Location LocatedJson::location(std::uint32_t offset) const {
  const auto next = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
  const std::uint32_t line_start = *(next - 1);
  return {source_, static_cast<int>(next - line_starts_.begin()),
          static_cast<int>(offset - line_start) + 1};
}

const LocatedJson::Node* LocatedJson::child(const Node& parent, const std::string& token) const {
  const Node* const begin = nodes_.data() + parent.first_child;
  const Node* const end = begin + parent.child_count;
  if (begin == end) return nullptr;
  if (begin->key != kNoKey) {
    const Node* found =
        std::find_if(begin, end, [&](const Node& node) { return keys_[node.key] == token; });
    return found == end ? nullptr : found;
  }
  std::uint32_t index = 0;
  const auto [rest, error] = std::from_chars(token.data(), token.data() + token.size(), index);
  const bool is_index = error == std::errc() && rest == token.data() + token.size();
  return is_index && index < parent.child_count ? begin + index : nullptr;
}

const LocatedJson::Node& LocatedJson::nearest_node(std::string_view pointer) const {
  const Node* node = &nodes_.back();
  for (const std::string& token : split_pointer(pointer)) {
    const Node* const next = child(*node, token);
    if (next == nullptr) break;
    node = next;
  }
  return *node;
}

const Location* LocatedJson::override_at(std::string_view pointer) const {
  for (;;) {
    if (const auto found = overrides_.find(pointer); found != overrides_.end()) {
      return &found->second;
    }
    const auto slash = pointer.rfind('/');
    if (slash == std::string_view::npos) return nullptr;
    pointer = pointer.substr(0, slash);
  }
}

Location LocatedJson::value_at(std::string_view pointer) const {
  if (const Location* const overridden = override_at(pointer)) return *overridden;
  return location(nearest_node(pointer).value_offset);
}

Location LocatedJson::key_at(std::string_view pointer) const {
  if (const Location* const overridden = override_at(pointer)) return *overridden;
  return location(nearest_node(pointer).key_offset);
}

void LocatedJson::override_value(const std::string& pointer, json value, std::string source) {
  // What an earlier override said about places below this one is gone with its values.
  const std::string below = pointer + "/";
  std::erase_if(overrides_, [&](const auto& entry) { return entry.first.starts_with(below); });
  json* target = root_.get();
  std::string reached;
  for (const std::string& token : split_pointer(pointer)) {
    const Location* const from = override_at(reached);
    reached = child_pointer(reached, token);
    if (target->is_array()) {
      target = &target->at(std::stoul(token));
      continue;
    }
    if (!target->contains(token) && from == nullptr) overrides_[reached] = {source, 0, 0};
    target = &(*target)[token];
  }
  *target = std::move(value);
  overrides_[pointer] = {std::move(source), 0, 0};
}

}  // namespace penumbra
