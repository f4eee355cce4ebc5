#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "scenes/core/diagnostics.h"

/// JSON that remembers where each value stood in its file, so that every later check can name the
/// place.
namespace penumbra {

/// JSON pointer of a member of the object at `parent`; '~' and '/' of the key are escaped (RFC
/// 6901).
std::string child_pointer(std::string_view parent, std::string_view key);

/// JSON pointer of an element of the array at `parent`.
std::string child_pointer(std::string_view parent, std::size_t index);

/// The unescaped tokens of a JSON pointer, from the root.
std::vector<std::string> split_pointer(std::string_view pointer);

/// A value as messages show it: `string "abc"`, `number 1.5`, `array of 3 items`; long strings are
/// cut.
std::string describe_value(const nlohmann::json& value);

/// A parsed JSON document with the place of every key and value. Line and block comments are
/// allowed.
class LocatedJson {
 public:
  /// @throws InputError where the file cannot be read, is not JSON, or has a key twice in one
  /// object
  static LocatedJson parse_file(const std::filesystem::path& file);

  /// @param source  name of the text in messages
  static LocatedJson parse_text(std::string_view text, std::string source);

  LocatedJson(LocatedJson&&) noexcept;
  LocatedJson& operator=(LocatedJson&&) noexcept;
  ~LocatedJson();

  const nlohmann::json& root() const { return *root_; }

  /// Name of the document in messages: the path as given.
  const std::string& source() const { return source_; }

  /// Where the value at the pointer begins; of its nearest existing ancestor where there is no such
  /// value.
  Location value_at(std::string_view pointer) const;

  /// Where the key of the value at the pointer begins; as `value_at` for array elements and the
  /// root.
  Location key_at(std::string_view pointer) const;

  /// Puts `value` at the pointer, making missing objects on the way; its places then read `source`.
  /// Every token but the last must name an object, an existing array element, or nothing yet.
  void override_value(const std::string& pointer, nlohmann::json value, std::string source);

 private:
  /// Places of one value; the children of a container are contiguous in `nodes_`, in the order of
  /// the file.
  struct Node {
    std::uint32_t value_offset{0};  ///< [byte]
    std::uint32_t key_offset{0};    ///< [byte]; equal to value_offset where there is no key
    std::uint32_t key{kNoKey};      ///< index into `keys_`
    std::uint32_t first_child{0};
    std::uint32_t child_count{0};
  };
  static constexpr std::uint32_t kNoKey = 0xffffffffu;
  class Builder;

  LocatedJson();
  const Node& nearest_node(std::string_view pointer) const;
  const Node* child(const Node& parent, const std::string& token) const;
  const Location* override_at(std::string_view pointer) const;
  Location location(std::uint32_t offset) const;

  std::string source_;
  std::unique_ptr<nlohmann::json> root_;
  std::vector<Node> nodes_;  ///< the root is the last
  std::vector<std::string> keys_;
  std::vector<std::uint32_t> line_starts_;  ///< [byte]
  std::map<std::string, Location, std::less<>> overrides_;
};

}  // namespace penumbra
