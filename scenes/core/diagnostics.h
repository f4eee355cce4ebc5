#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Errors of input files, collected so that the user sees all of them at once.
namespace penumbra {

/// A place in an input: a file with line and column, or a whole source such as a command-line
/// option.
struct Location {
  std::string source;  ///< file as the user named it, or "--set key=value"
  int line{0};         ///< from 1; 0 where the source has no lines
  int column{0};       ///< from 1, counted in bytes, so a character beyond ASCII counts 2 to 4

  /// "file:line:column", or the source alone.
  std::string text() const;
  friend bool operator==(const Location&, const Location&) = default;
};

/// One fault and where it is.
struct Diagnostic {
  Location location;
  std::string pointer;  ///< JSON pointer (RFC 6901); empty for the document itself
  std::string message;  ///< what was found, what is allowed

  /// "file:line:column: error: /json/pointer: message".
  std::string text() const;
};

/// Collects faults while a document is read.
class DiagnosticList {
 public:
  /// How many faults `text` spells out; the rest is counted.
  static constexpr std::size_t kMaxShown = 100;

  void add(Location location, std::string pointer, std::string message);

  bool empty() const { return diagnostics_.empty(); }

  /// In the order of their discovery.
  const std::vector<Diagnostic>& all() const { return diagnostics_; }

  /// Whether a fault at this JSON pointer, or below it, is known. A later check of the same value
  /// then has nothing to add, so one fault gives one message.
  bool covers(std::string_view pointer) const;

  /// One line per fault, sorted by place.
  std::string text() const;

  /// @throws InputError with `text()` unless the list is empty
  void throw_if_any() const;

 private:
  std::vector<Diagnostic> diagnostics_;
};

}  // namespace penumbra
