#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Comma-separated values as RFC 4180 has them: raw rows are appended, never rewritten.
namespace penumbra {

using CsvRecord = std::vector<std::string>;

/// One line with its CRLF; fields with a comma, a quote or a line end are quoted.
std::string csv_line(std::span<const std::string> fields);

/// A number as text: whole, or the shortest decimal that reads back to the same double ("nan",
/// "inf" included).
std::string csv_text(double value);
std::string csv_text(int value);
std::string csv_text(std::int64_t value);
std::string csv_text(std::uint64_t value);
inline std::string csv_text(const std::string& value) { return value; }

/// Nothing is an empty field.
template <class T>
std::string csv_text(const std::optional<T>& value) {
  return value ? csv_text(*value) : std::string{};
}

/// Reads a field; the whole text must be one value of the type.
/// @return false, `value` untouched, when it is not
bool parse_csv(std::string_view text, double& value);
bool parse_csv(std::string_view text, int& value);
bool parse_csv(std::string_view text, std::int64_t& value);
bool parse_csv(std::string_view text, std::uint64_t& value);
bool parse_csv(std::string_view text, std::string& value);

template <class T>
bool parse_csv(std::string_view text, std::optional<T>& value) {
  if (text.empty()) {
    value.reset();
    return true;
  }
  T parsed{};
  if (!parse_csv(text, parsed)) return false;
  value = parsed;
  return true;
}

struct CsvTable {
  CsvRecord header;             ///< empty for an empty file
  std::vector<CsvRecord> rows;  ///< [row][column], every row as long as the header
  bool torn_tail{false};  ///< the last line is incomplete (a killed writer) and left out of `rows`
  std::size_t complete_bytes{0};  ///< length of the file up to the torn line, or all of it

  std::optional<std::size_t> column(std::string_view name) const;
};

/// Reads a file with a header line; line ends are CRLF or LF, a UTF-8 byte order mark is skipped. A
/// last line without line end, or with too few fields, is a torn tail.
/// @throws InputError naming file and line: cannot be opened, stray or unclosed quote, wrong number
/// of fields, a
///         column twice; an unclosed quote that swallows further lines is an error, not a torn tail
/// @throws RunError when reading fails
CsvTable read_csv(const std::filesystem::path& file);

/// Cuts off a torn last line, and nothing else.
/// @return whether there was one
/// @throws InputError, RunError as read_csv; RunError when the file cannot be cut
bool truncate_torn_tail(const std::filesystem::path& file);

/// Appends rows to a file, each by one write and one fsync: what `append` returned from survives a
/// crash. One writer per file; the file is locked as long as the object lives.
class CsvWriter {
 public:
  /// Opens or creates the file; writes the header line when it is empty.
  /// @throws RunError when it cannot be opened, is being written by another process, has another
  /// header or a torn tail
  /// @throws InputError when it is not a CSV file
  CsvWriter(std::filesystem::path file, CsvRecord header);
  ~CsvWriter();
  CsvWriter(const CsvWriter&) = delete;
  CsvWriter& operator=(const CsvWriter&) = delete;

  /// Appends one row. A row that could be written only in part (disk full) is taken back.
  /// @param fields  as many as the header has
  /// @throws RunError with path and the system's reason
  void append(std::span<const std::string> fields);

 private:
  void check_header();
  void write_line(const std::string& line);
  [[noreturn]] void fail(const char* what, int error_number) const;

  std::filesystem::path file_;
  CsvRecord header_;
  int descriptor_{-1};
};

}  // namespace penumbra
