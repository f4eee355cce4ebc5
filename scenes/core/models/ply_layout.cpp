#include "scenes/core/models/ply_layout.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <utility>

#include "scenes/core/models/mesh_tools.h"
#include "scenes/core/models/statement_lines.h"

namespace penumbra {
namespace {

struct NamedType {
  std::string_view name, other_name;
  PlyType type;
};
constexpr std::array<NamedType, 8> kTypes{{{"char", "int8", {1, false, true}},
                                           {"uchar", "uint8", {1, false, false}},
                                           {"short", "int16", {2, false, true}},
                                           {"ushort", "uint16", {2, false, false}},
                                           {"int", "int32", {4, false, true}},
                                           {"uint", "uint32", {4, false, false}},
                                           {"float", "float32", {4, true, true}},
                                           {"double", "float64", {8, true, true}}}};

/// A face with more corners is taken for a wrong count.
constexpr std::uint64_t kMaxCorners = 1u << 20;

/// Hands out the lines of a text.
class Lines {
 public:
  Lines(const std::filesystem::path& file, std::string_view bytes) : file_(file), rest_(bytes) {}

  std::string_view next(const std::string& expected) {
    if (rest_.empty()) fault("the file ends where " + expected + " is expected");
    ++line_;
    const std::size_t end = rest_.find('\n');
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  std::string_view rest() const { return rest_; }
  [[noreturn]] void fault(const std::string& message) const {
    model_error(file_, std::max(line_, 1), message);
  }

 private:
  const std::filesystem::path& file_;
  std::string_view rest_;
  int line_{0};
};

PlyType read_type(const Lines& lines, std::string_view word) {
  for (const NamedType& known : kTypes) {
    if (word == known.name || word == known.other_name) return known.type;
  }
  lines.fault("unknown type \"" + std::string(word) +
              "\", expected char, uchar, short, ushort, int, uint, float or double");
}

PlyProperty read_property(const Lines& lines, std::string_view rest) {
  PlyProperty property;
  std::string_view word = take_word(rest);
  if (word == "list") {
    property.is_list = true;
    property.count_type = read_type(lines, take_word(rest));
    if (property.count_type.is_float) lines.fault("the count of a list must be an integer");
    word = take_word(rest);
  }
  property.type = read_type(lines, word);
  property.name = std::string(take_word(rest));
  if (property.name.empty()) lines.fault("a property without a name");
  return property;
}

PlyElement read_element(const Lines& lines, std::string_view rest) {
  PlyElement element;
  element.name = std::string(take_word(rest));
  const std::string_view count = take_word(rest);
  const auto [end, error] =
      std::from_chars(count.data(), count.data() + count.size(), element.count);
  if (error != std::errc() || end != count.data() + count.size()) {
    lines.fault("expected a number of elements, found \"" + std::string(count) + "\"");
  }
  if (element.count >= (1ull << 31)) {
    lines.fault(std::to_string(element.count) + " elements, at most 2^31 - 1 are supported");
  }
  return element;
}

PlyFormat read_format(const Lines& lines, std::string_view rest) {
  const std::string_view format = take_word(rest);
  if (format == "ascii") return PlyFormat::Ascii;
  if (format == "binary_little_endian") return PlyFormat::LittleEndian;
  if (format == "binary_big_endian") return PlyFormat::BigEndian;
  lines.fault("unknown format \"" + std::string(format) +
              "\", expected ascii, binary_little_endian or binary_big_endian");
}

PlyLayout read_header(Lines& lines) {
  PlyLayout layout;
  if (lines.next("\"ply\"") != "ply") lines.fault("not a PLY file: expected \"ply\"");
  bool has_format = false;
  while (true) {
    std::string_view rest = lines.next("\"end_header\"");
    const std::string_view word = take_word(rest);
    if (word == "end_header") break;
    if (word == "format") {
      // Readers differ in which of two they follow.
      if (has_format) lines.fault("a second \"format\" in the header");
      layout.format = read_format(lines, rest);
      has_format = true;
    } else if (word == "element") {
      layout.elements.push_back(read_element(lines, rest));
    } else if (word == "property") {
      if (layout.elements.empty()) lines.fault("a property before the first element");
      layout.elements.back().properties.push_back(read_property(lines, rest));
    } else if (word != "comment" && word != "obj_info") {
      lines.fault("unknown word \"" + std::string(word) +
                  "\" in the header, expected format, comment, element, property or end_header");
    }
  }
  if (!has_format) lines.fault("the header has no \"format\"");
  return layout;
}

void check_header(const PlyLayout& layout, const Lines& lines) {
  for (std::size_t i = 0; i < layout.elements.size(); ++i) {
    const PlyElement& element = layout.elements[i];
    if (layout.find(element.name) != &element) {
      lines.fault("element \"" + element.name + "\" is declared twice");
    }
    if (element.properties.empty()) {
      lines.fault("element \"" + element.name + "\" has no properties");
    }
    for (const PlyProperty& property : element.properties) {
      if (element.find(property.name) != &property) {
        lines.fault("property \"" + property.name + "\" of element \"" + element.name +
                    "\" is declared twice");
      }
    }
  }
  const PlyElement* const vertex = layout.find("vertex");
  if (vertex == nullptr) lines.fault("there is no element \"vertex\"");
  for (const char* axis : {"x", "y", "z"}) {
    const PlyProperty* const property = vertex->find(axis);
    if (property == nullptr || property->is_list) {
      lines.fault("element \"vertex\" needs a number \"" + std::string(axis) + "\"");
    }
  }
  const PlyElement* const face = layout.find("face");
  if (face == nullptr || face->count == 0) lines.fault("there are no faces");
  const auto corner_lists =
      std::count_if(face->properties.begin(), face->properties.end(), is_corner_list);
  if (corner_lists != 1) lines.fault("element \"face\" needs one list \"vertex_indices\"");
}

/// What a walk through the body needs to know.
struct Body {
  PlyLayout& layout;
  std::uint64_t vertices;
};

/// One value of a binary body.
double binary_value(const char* bytes, const PlyType& type, PlyFormat format) {
  std::array<char, 8> raw{};
  for (std::size_t i = 0; i < raw.size() && i < type.bytes; ++i) {
    raw[i] = bytes[format == PlyFormat::BigEndian ? type.bytes - 1 - i : i];
  }
  const auto as = [&](auto value) {
    std::memcpy(&value, raw.data(), sizeof(value));
    return static_cast<double>(value);
  };
  if (type.is_float) return type.bytes == 4 ? as(float{}) : as(double{});
  switch (type.bytes) {
    case 1:
      return type.is_signed ? as(std::int8_t{}) : as(std::uint8_t{});
    case 2:
      return type.is_signed ? as(std::int16_t{}) : as(std::uint16_t{});
    default:
      return type.is_signed ? as(std::int32_t{}) : as(std::uint32_t{});
  }
}

/// Walks through one element's instances; `place` is used in messages.
class BinaryWalk {
 public:
  BinaryWalk(const std::filesystem::path& file, std::string_view bytes, Body body)
      : file_(file), bytes_(bytes), body_(body) {}

  void element(const PlyElement& element) {
    std::uint64_t stride = 0;
    bool has_lists = false;
    for (const PlyProperty& property : element.properties) {
      has_lists |= property.is_list;
      stride += property.is_list ? property.count_type.bytes : property.type.bytes;
    }
    if (element.count > bytes_.size() / stride) {
      model_error(file_, "element \"" + element.name + "\": the header promises " +
                             std::to_string(element.count) + " of at least " +
                             std::to_string(stride) + " bytes, " + std::to_string(bytes_.size()) +
                             " bytes are left");
    }
    if (!has_lists) {
      bytes_.remove_prefix(element.count * stride);
      return;
    }
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& property : element.properties) read(element, i, property);
    }
  }

 private:
  [[noreturn]] void fault(const PlyElement& element, std::uint64_t i, const std::string& what) {
    model_error(file_, element.name + " " + std::to_string(i) + ": " + what);
  }

  void read(const PlyElement& element, std::uint64_t i, const PlyProperty& property) {
    std::uint64_t count = 1;
    if (property.is_list) {
      if (bytes_.size() < property.count_type.bytes) fault(element, i, "the file ends in it");
      const double found = binary_value(bytes_.data(), property.count_type, body_.layout.format);
      if (found < 0 || found > static_cast<double>(kMaxCorners)) {
        fault(element, i, "a list of " + std::to_string(found) + " values");
      }
      count = static_cast<std::uint64_t>(found);
      bytes_.remove_prefix(property.count_type.bytes);
    }
    if (bytes_.size() < count * property.type.bytes) fault(element, i, "the file ends in it");
    if (element.name == "face" && is_corner_list(property)) {
      if (count < 3) fault(element, i, "has " + std::to_string(count) + " corners, expected 3");
      for (std::uint64_t k = 0; k < count; ++k) {
        const double index = binary_value(bytes_.data() + k * property.type.bytes, property.type,
                                          body_.layout.format);
        if (index >= 0 && index < static_cast<double>(body_.vertices)) continue;
        fault(element, i,
              "vertex " + std::to_string(static_cast<long long>(index)) +
                  " does not exist; there are " + std::to_string(body_.vertices));
      }
      body_.layout.corners += count;
    }
    bytes_.remove_prefix(count * property.type.bytes);
  }

  const std::filesystem::path& file_;
  std::string_view bytes_;
  Body body_;
};

/// The same for a text: every instance has a line of its own.
void walk_text(Lines& lines, const PlyElement& element, Body body) {
  const auto number = [&](std::string_view& rest) {
    const std::string_view word = take_word(rest);
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
      lines.fault("element \"" + element.name + "\": expected a finite number, found \"" +
                  std::string(word) + "\"");
    }
    return value;
  };
  for (std::uint64_t i = 0; i < element.count; ++i) {
    std::string_view rest = lines.next("element \"" + element.name + "\"");
    for (const PlyProperty& property : element.properties) {
      if (!property.is_list) {
        number(rest);
        continue;
      }
      const double found = number(rest);
      if (!(found >= 0 && found <= static_cast<double>(kMaxCorners)) ||
          found != std::floor(found)) {
        lines.fault("a list of " + std::to_string(found) + " values");
      }
      const auto count = static_cast<std::uint64_t>(found);
      const bool is_face = element.name == "face" && is_corner_list(property);
      if (is_face && count < 3) lines.fault("a face needs at least 3 corners");
      for (std::uint64_t k = 0; k < count; ++k) {
        const double value = number(rest);
        if (!is_face || (value >= 0 && value < static_cast<double>(body.vertices) &&
                         value == std::floor(value))) {
          continue;
        }
        lines.fault("vertex " + std::to_string(static_cast<long long>(value)) +
                    " does not exist; there are " + std::to_string(body.vertices));
      }
      if (is_face) body.layout.corners += count;
    }
    if (!take_word(rest).empty()) {
      lines.fault("element \"" + element.name + "\": more values than the header declares");
    }
  }
}

}  // namespace

const PlyProperty* PlyElement::find(std::string_view property) const {
  const auto found = std::find_if(properties.begin(), properties.end(),
                                  [&](const PlyProperty& p) { return p.name == property; });
  return found != properties.end() ? &*found : nullptr;
}

const PlyElement* PlyLayout::find(std::string_view element) const {
  const auto found = std::find_if(elements.begin(), elements.end(),
                                  [&](const PlyElement& e) { return e.name == element; });
  return found != elements.end() ? &*found : nullptr;
}

bool is_corner_list(const PlyProperty& property) {
  return property.is_list && !property.type.is_float &&
         (property.name == "vertex_indices" || property.name == "vertex_index");
}

PlyLayout check_ply(const std::filesystem::path& file, std::string_view bytes) {
  Lines lines(file, bytes);
  PlyLayout layout = read_header(lines);
  check_header(layout, lines);
  const Body body{layout, layout.find("vertex")->count};
  if (layout.format == PlyFormat::Ascii) {
    for (const PlyElement& element : layout.elements) walk_text(lines, element, body);
  } else {
    BinaryWalk walk(file, lines.rest(), body);
    for (const PlyElement& element : layout.elements) walk.element(element);
  }
  return layout;
}

}  // namespace penumbra
