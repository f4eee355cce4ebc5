#include "tests/fuzz/json_mutator.h"

#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

namespace penumbra {
namespace {

using nlohmann::ordered_json;

/// Deeper documents are left alone: copying and writing them recurses.
constexpr int kMaxDepth = 200;

bool is_shallow(std::string_view text) {
  int depth = 0;
  for (const char c : text) {
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (depth > kMaxDepth) return false;
  }
  return true;
}

class JsonMutator {
 public:
  JsonMutator(ordered_json& root, const std::vector<std::string>& words, std::uint32_t seed)
      : root_(root), words_(words), random_(seed) {}

  void change() {
    std::vector<ordered_json*> nodes;
    gather(root_, 0, nodes);
    ordered_json& node = *nodes[below(nodes.size())];
    switch (below(8)) {
      case 0:
        if (node.is_structured()) return remove_child(node);
        [[fallthrough]];
      case 1:
        if (node.is_structured()) return add_child(node);
        [[fallthrough]];
      case 2:
        node = value();
        return;
      case 3: {
        const ordered_json copy = *nodes[below(nodes.size())];
        node = copy;
        return;
      }
      case 4:
        if (node.is_array() && !node.empty()) {
          const ordered_json copy = node[below(node.size())];
          for (std::size_t i = 1 + below(8); i-- > 0;) node.push_back(copy);
          return;
        }
        [[fallthrough]];
      default:
        alter(node);
    }
  }

 private:
  std::size_t below(std::size_t bound) { return random_() % bound; }

  void gather(ordered_json& node, int depth, std::vector<ordered_json*>& nodes) {
    nodes.push_back(&node);
    if (depth < 40 && node.is_structured()) {
      for (ordered_json& child : node) gather(child, depth + 1, nodes);
    }
  }

  void remove_child(ordered_json& node) {
    if (node.empty()) return;
    const std::size_t index = below(node.size());
    if (node.is_array()) {
      node.erase(index);
    } else {
      node.erase(std::next(node.begin(), static_cast<std::ptrdiff_t>(index)));
    }
  }

  void add_child(ordered_json& node) {
    if (node.is_array()) {
      node.push_back(value());
    } else {
      node[word()] = value();
    }
  }

  /// Something of the node's own type.
  void alter(ordered_json& node) {
    if (node.is_number()) {
      node = number(node);
    } else if (node.is_string()) {
      node = word();
    } else if (node.is_boolean()) {
      node = !node.get<bool>();
    } else if (node.is_structured()) {
      add_child(node);
    } else {
      node = value();
    }
  }

  const std::string& word() { return words_[below(words_.size())]; }

  ordered_json value() {
    switch (below(7)) {
      case 0:
        return nullptr;
      case 1:
        return below(2) == 0;
      case 2:
        return word();
      case 3:
        return ordered_json::array();
      case 4:
        return ordered_json::object();
      case 5:
        return ordered_json::array({number(0), number(0), number(0)});
      default:
        return number(0);
    }
  }

  ordered_json number(const ordered_json& old) {
    static constexpr std::array<double, 20> kReals{
        0.0,  -0.0,  1.0,    -1.0,       0.5,
        1e-4, 1e-30, 1e-46,  1e-300,     5e-324,
        1e4,  1e6,   1e30,   -1e30,      3.5e38,
        1e39, 1e300, -1e308, 1.0 + 1e-7, std::numeric_limits<double>::max()};
    static constexpr std::array<std::uint64_t, 8> kWholes{
        1u << 14,         1u << 20,   (1ull << 31) - 1, 1ull << 31,
        (1ull << 32) - 1, 1ull << 53, (1ull << 63) - 1, ~0ull};
    switch (below(5)) {
      case 0:
        return kWholes[below(kWholes.size())];
      case 1:
        return static_cast<std::int64_t>(below(12)) - 2;
      case 2:
        return old.get<double>() * 2.0;
      case 3:
        return -old.get<double>();
      default:
        return kReals[below(kReals.size())];
    }
  }

  ordered_json& root_;
  const std::vector<std::string>& words_;
  std::mt19937 random_;
};

}  // namespace

std::optional<std::string> mutate_json(std::string_view text, const std::vector<std::string>& words,
                                       std::uint32_t seed) {
  if (!is_shallow(text)) return std::nullopt;
  ordered_json root = ordered_json::parse(text, nullptr, false, true);
  if (root.is_discarded()) return std::nullopt;
  JsonMutator mutator(root, words, seed);
  for (std::uint32_t changes = 1 + seed % 4; changes-- > 0;) mutator.change();
  return root.dump(seed % 2 == 0 ? 1 : -1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace penumbra
