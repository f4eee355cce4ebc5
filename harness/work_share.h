#pragma once

#include <cstddef>
#include <string>

/// Work that several processes do together, each a part of it.
namespace penumbra {

/// Of things that are numbered from 0, those whose number leaves the remainder `index`.
struct WorkShare {
  int index{0};  ///< 0 to count - 1
  int count{1};  ///< of parts; 1: everything

  bool has(std::size_t number) const {
    return number % static_cast<std::size_t>(count) == static_cast<std::size_t>(index);
  }
  bool is_all() const { return count == 1; }

  /// One of `parts` parts of this part.
  WorkShare part(int number, int parts) const { return {index + count * number, count * parts}; }

  friend bool operator==(const WorkShare&, const WorkShare&) = default;
};

/// Of "2/3" the second of three parts.
/// @throws InputError naming the text and what is allowed
WorkShare parse_shard(const std::string& text);

}  // namespace penumbra
