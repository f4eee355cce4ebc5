#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "scenes/core/error.h"
#include "scenes/core/file_bytes.h"
#include "scenes/core/located_json.h"

/// The parsing half of LocatedJson; located_json.cpp looks places up.
namespace penumbra {

using nlohmann::json;

namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Deeper documents are refused: validation recurses, and no file of this project needs more than
/// ten.
constexpr std::size_t kMaxDepth = 100;

/// First byte at or after `at` that can begin a token: skips blanks, comments and separators.
std::size_t skip_to_token(std::string_view text, std::size_t at) {
  while (at < text.size()) {
    if (std::strchr(" \t\r\n,:", text[at]) != nullptr && text[at] != '\0') {
      ++at;
    } else if (text.substr(at, 2) == "//") {
      at = std::min(text.find('\n', at), text.size());
    } else if (text.substr(at, 2) == "/*") {
      const std::size_t close = text.find("*/", at + 2);
      at = close == std::string_view::npos ? text.size() : close + 2;
    } else {
      break;
    }
  }
  return at;
}

/// One past the last byte of the scalar or bracket that begins at `at`.
std::size_t token_end(std::string_view text, std::size_t at) {
  if (text[at] == '"') {
    for (++at; text[at] != '"'; ++at) {
      if (text[at] == '\\') ++at;
    }
    return at + 1;
  }
  if (std::strchr("{}[]", text[at]) != nullptr) return at + 1;
  return std::min(text.find_first_of(" \t\r\n,:{}[]/", at), text.size());
}

/// nlohmann's message without its error number and its own line and column.
std::string plain_message(std::string message) {
  if (const auto bracket = message.find("] ");
      message.starts_with("[json.") && bracket != std::string::npos) {
    message.erase(0, bracket + 2);
  }
  if (const auto column = message.find("column "); message.starts_with("parse error at")) {
    const auto colon = message.find(": ", column);
    if (colon != std::string::npos) message.erase(0, colon + 2);
  }
  if (message.starts_with("syntax error while parsing")) {
    if (const auto dash = message.find(" - "); dash != std::string::npos)
      message.erase(0, dash + 3);
  }
  // The last token adds nothing to a place that is named, and may hold a whole line.
  if (const auto last = message.find("; last read: "); last != std::string::npos) {
    const auto expected = message.find("; expected ", last);
    message.erase(last, expected == std::string::npos ? expected : expected - last);
  }
  return message;
}

}  // namespace

/// Builds the DOM and the table of places in one pass of nlohmann's SAX parser. The parser does not
/// tell where a token began, and has read one byte too far after a number; so the builder walks the
/// text itself, one token per event.
class LocatedJson::Builder final : public nlohmann::json_sax<json> {
 public:
  Builder(LocatedJson& document, std::string_view text) : document_(document), text_(text) {
    if (text.starts_with(kByteOrderMark)) cursor_ = kByteOrderMark.size();
  }

  bool null() override { return scalar(nullptr); }
  bool boolean(bool value) override { return scalar(value); }
  bool number_integer(number_integer_t value) override { return scalar(value); }
  bool number_unsigned(number_unsigned_t value) override { return scalar(value); }
  bool number_float(number_float_t value, const string_t&) override { return scalar(value); }
  bool string(string_t& value) override { return scalar(std::move(value)); }
  bool binary(json::binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(json::object()); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(json::array()); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    const std::uint32_t offset = take_token();
    Frame& frame = stack_.back();
    const std::string pointer = child_pointer(frame.pointer, name);
    if (frame.value->contains(name)) report_duplicate(frame, name, offset);
    slot_ = &(*frame.value)[name];
    pending_ = Node{offset, offset, static_cast<std::uint32_t>(document_.keys_.size()), 0, 0};
    document_.keys_.push_back(std::move(name));
    return true;
  }

  bool parse_error(std::size_t position, const std::string& last_token,
                   const nlohmann::detail::exception& error) override {
    // `position` is where reading stopped; the user looks for the beginning of the token that does
    // not fit.
    std::size_t offset = position > 0 && position <= text_.size() ? position - 1 : text_.size();
    if (position >= last_token.size() && position <= text_.size() &&
        text_.substr(position - last_token.size(), last_token.size()) == last_token) {
      offset = position - last_token.size();
    }
    const std::size_t before = text_.substr(0, offset).find_last_not_of(" \t\r\n");
    const bool closes = offset < text_.size() && (text_[offset] == '}' || text_[offset] == ']');
    if (closes && before != std::string_view::npos && text_[before] == ',') {
      problems_.add(place(before), "",
                    std::string("trailing comma before '") + text_[offset] + "'");
    } else {
      problems_.add(place(offset), "", "not valid JSON: " + plain_message(error.what()));
    }
    return false;
  }

  const DiagnosticList& problems() const { return problems_; }

 private:
  /// An open object or array.
  struct Frame {
    json* value{nullptr};
    Node node;
    std::vector<Node> children;
    std::string pointer;
  };

  Location place(std::size_t offset) const {
    return document_.location(static_cast<std::uint32_t>(offset));
  }

  std::uint32_t take_token() {
    const std::size_t begin = skip_to_token(text_, cursor_);
    cursor_ = token_end(text_, begin);
    return static_cast<std::uint32_t>(begin);
  }

  /// Puts a value where the document has it, and its place beside it.
  json* insert(json value, Node& node) {
    node = {};
    node.value_offset = node.key_offset = take_token();
    if (stack_.empty()) return &(*document_.root_ = std::move(value));
    Frame& frame = stack_.back();
    if (frame.value->is_array()) return &frame.value->emplace_back(std::move(value));
    node.key_offset = pending_.key_offset;
    node.key = pending_.key;
    return &(*slot_ = std::move(value));
  }

  void finish(const Node& node) {
    (stack_.empty() ? document_.nodes_ : stack_.back().children).push_back(node);
  }

  bool scalar(json value) {
    Node node;
    insert(std::move(value), node);
    finish(node);
    return true;
  }

  bool open(json container) {
    Frame frame;
    if (!stack_.empty()) {
      const Frame& parent = stack_.back();
      frame.pointer = parent.value->is_array()
                          ? child_pointer(parent.pointer, parent.children.size())
                          : child_pointer(parent.pointer, document_.keys_[pending_.key]);
    }
    frame.value = insert(std::move(container), frame.node);
    if (stack_.size() == kMaxDepth) {
      problems_.add(place(frame.node.value_offset), "",
                    "nested deeper than " + std::to_string(kMaxDepth) + " levels");
      return false;
    }
    stack_.push_back(std::move(frame));
    return true;
  }

  bool close() {
    take_token();
    Frame frame = std::move(stack_.back());
    stack_.pop_back();
    frame.node.first_child = static_cast<std::uint32_t>(document_.nodes_.size());
    frame.node.child_count = static_cast<std::uint32_t>(frame.children.size());
    document_.nodes_.insert(document_.nodes_.end(), frame.children.begin(), frame.children.end());
    finish(frame.node);
    return true;
  }

  void report_duplicate(const Frame& frame, const std::string& name, std::uint32_t offset) {
    const auto first =
        std::find_if(frame.children.begin(), frame.children.end(),
                     [&](const Node& node) { return document_.keys_[node.key] == name; });
    problems_.add(
        place(offset), child_pointer(frame.pointer, name),
        "key \"" + name + "\" is given twice; the first is at " + place(first->key_offset).text());
  }

  LocatedJson& document_;
  std::string_view text_;
  std::size_t cursor_{0};  ///< one past the last token taken [byte]
  std::vector<Frame> stack_;
  Node pending_;         ///< the key read last, whose value follows
  json* slot_{nullptr};  ///< where that value goes
  DiagnosticList problems_;
};

LocatedJson LocatedJson::parse_file(const std::filesystem::path& file) {
  const std::string name = file.string();
  check_is_file(file);
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) {
    const std::string reason = errno != 0 ? std::strerror(errno) : "unknown reason";
    throw InputError(name + ": error: cannot be read: " + reason);
  }
  return parse_text(text, name);
}

LocatedJson LocatedJson::parse_text(std::string_view text, std::string source) {
  LocatedJson document;
  document.source_ = std::move(source);
  if (text.size() >= kNoKey) throw InputError(document.source_ + ": error: larger than 4 GiB");
  document.line_starts_.push_back(0);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n') document.line_starts_.push_back(static_cast<std::uint32_t>(i + 1));
  }
  Builder builder(document, text);
  json::sax_parse(text.begin(), text.end(), &builder, json::input_format_t::json, true, true);
  builder.problems().throw_if_any();
  return document;
}

}  // namespace penumbra
