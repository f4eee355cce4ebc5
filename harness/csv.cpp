#include "harness/csv.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <iterator>
#include <set>
#include <system_error>
#include <utility>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

std::string reason_of(int error_number) { return std::generic_category().message(error_number); }

template <class T>
std::string number_text(T value) {
  std::array<char, 64> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

template <class T>
bool parse_number(std::string_view text, T& value) {
  T parsed{};
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, parsed);
  if (result.ec != std::errc{} || result.ptr != end) return false;
  value = parsed;
  return true;
}

std::string read_all(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    throw InputError(fmt::format("{}: cannot be read: {}", file.string(), reason_of(errno)));
  }
  try {
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  } catch (const std::ios_base::failure& failure) {
    throw RunError(fmt::format("{}: reading failed: {}", file.string(), failure.what()));
  }
}

/// Takes records off a text, one at a time.
class Parser {
 public:
  Parser(const std::filesystem::path& file, std::string_view text) : file_(file), text_(text) {
    if (text_.starts_with(kByteOrderMark)) position_ = kByteOrderMark.size();
  }

  bool at_end() const { return position_ == text_.size(); }
  std::size_t position() const { return position_; }
  std::size_t line() const { return line_; }

  /// @return empty when the text ends inside the record
  std::optional<CsvRecord> next() {
    record_line_ = line_;
    CsvRecord record;
    while (true) {
      record.emplace_back();
      if (!field(record.back())) return std::nullopt;
      const char separator = text_[position_++];
      if (separator == ',') continue;
      if (separator == '\r') ++position_;  // field() has seen the '\n'
      ++line_;
      return record;
    }
  }

  [[noreturn]] void fail(std::size_t line, const std::string& message) const {
    throw InputError(fmt::format("{}:{}: {}", file_.string(), line, message));
  }

 private:
  /// Reads up to the separator. @return false when the text ends before it
  bool field(std::string& value) {
    const bool is_quoted = !at_end() && text_[position_] == '"';
    if (is_quoted && !quoted(value)) return false;
    for (; !at_end(); ++position_) {
      const char c = text_[position_];
      if (c == ',' || c == '\n') return true;
      if (c == '\r') {
        if (position_ + 1 == text_.size()) return false;
        if (text_[position_ + 1] == '\n') return true;
        fail(line_, "carriage return without line feed outside quotes");
      }
      if (is_quoted) fail(line_, "text after a closing quote");
      if (c == '"') fail(line_, "quote inside an unquoted field");
      value += c;
    }
    return false;
  }

  /// Reads a quoted field up to behind its closing quote. @return false when the text ends before
  /// it
  bool quoted(std::string& value) {
    for (++position_; !at_end(); ++position_) {
      const char c = text_[position_];
      if (c == '\n') ++line_;
      if (c == '"') {
        ++position_;
        if (at_end()) return false;
        if (text_[position_] != '"') return true;
      }
      value += c;
    }
    if (line_ != record_line_) fail(record_line_, "a quoted field is never closed");
    return false;
  }

  const std::filesystem::path& file_;
  std::string_view text_;
  std::size_t position_{0};
  std::size_t line_{1};
  std::size_t record_line_{1};
};

CsvRecord read_header(Parser& parser) {
  CsvRecord header = parser.next().value_or(CsvRecord{});
  std::set<std::string> seen;
  for (const std::string& name : header) {
    if (!seen.insert(name).second) parser.fail(1, fmt::format("column \"{}\" occurs twice", name));
  }
  return header;
}

std::string quoted_field(const std::string& field) {
  if (field.find_first_of(",\"\r\n") == std::string::npos) return field;
  std::string text = "\"";
  for (const char c : field) {
    if (c == '"') text += '"';
    text += c;
  }
  return text + '"';
}

}  // namespace

std::string csv_line(std::span<const std::string> fields) {
  std::string line;
  for (const std::string& field : fields) {
    if (&field != fields.data()) line += ',';
    line += quoted_field(field);
  }
  return line + "\r\n";
}

std::string csv_text(double value) { return number_text(value); }
std::string csv_text(int value) { return number_text(value); }
std::string csv_text(std::int64_t value) { return number_text(value); }
std::string csv_text(std::uint64_t value) { return number_text(value); }

bool parse_csv(std::string_view text, double& value) { return parse_number(text, value); }
bool parse_csv(std::string_view text, int& value) { return parse_number(text, value); }
bool parse_csv(std::string_view text, std::int64_t& value) { return parse_number(text, value); }
bool parse_csv(std::string_view text, std::uint64_t& value) { return parse_number(text, value); }

bool parse_csv(std::string_view text, std::string& value) {
  value = text;
  return true;
}

std::optional<std::size_t> CsvTable::column(std::string_view name) const {
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (header[i] == name) return i;
  }
  return std::nullopt;
}

CsvTable read_csv(const std::filesystem::path& file) {
  const std::string text = read_all(file);
  Parser parser(file, text);
  CsvTable table;
  if (parser.at_end()) {
    table.complete_bytes = text.size();
    return table;
  }
  table.header = read_header(parser);
  table.torn_tail = table.header.empty();
  if (!table.torn_tail) table.complete_bytes = parser.position();
  while (!table.torn_tail && !parser.at_end()) {
    const std::size_t line = parser.line();
    std::optional<CsvRecord> record = parser.next();
    if (!record || (parser.at_end() && record->size() < table.header.size())) {
      table.torn_tail = true;
      break;
    }
    if (record->size() != table.header.size()) {
      parser.fail(line, fmt::format("{} fields where the header has {}", record->size(),
                                    table.header.size()));
    }
    table.rows.push_back(std::move(*record));
    table.complete_bytes = parser.position();
  }
  return table;
}

bool truncate_torn_tail(const std::filesystem::path& file) {
  const CsvTable table = read_csv(file);
  if (!table.torn_tail) return false;
  std::error_code error;
  std::filesystem::resize_file(file, table.complete_bytes, error);
  if (error) {
    throw RunError(
        fmt::format("{}: torn last line cannot be cut off: {}", file.string(), error.message()));
  }
  return true;
}

CsvWriter::CsvWriter(std::filesystem::path file, CsvRecord header)
    : file_(std::move(file)), header_(std::move(header)) {
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail("cannot be opened for appending", errno);
  try {
    // File systems without locks are no reason to stop.
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      fail("is being written by another process", errno);
    }
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0) fail("cannot be examined", errno);
    if (status.st_size == 0) {
      write_line(csv_line(header_));
    } else {
      check_header();
    }
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

CsvWriter::~CsvWriter() { ::close(descriptor_); }

void CsvWriter::check_header() {
  const CsvTable table = read_csv(file_);
  if (table.torn_tail) {
    throw RunError(fmt::format("{}: the last line is incomplete; cut it off before appending",
                               file_.string()));
  }
  if (table.header == header_) return;
  throw RunError(fmt::format("{}: has columns \"{}\", cannot append rows of \"{}\"", file_.string(),
                             fmt::join(table.header, ","), fmt::join(header_, ",")));
}

void CsvWriter::append(std::span<const std::string> fields) {
  PN_CHECK(fields.size() == header_.size(), "a row has as many fields as the header");
  write_line(csv_line(fields));
}

void CsvWriter::write_line(const std::string& line) {
  struct stat before {};
  if (::fstat(descriptor_, &before) != 0) fail("cannot be examined", errno);
  // One call, unless the system takes only a part: then the next call says why.
  for (std::string_view rest = line; !rest.empty();) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written >= 0) {
      rest.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      const int error_number = errno;
      if (rest.size() < line.size() && ::ftruncate(descriptor_, before.st_size) != 0) {
        fail("was written in part and cannot be cut back", error_number);
      }
      fail("cannot be written", error_number);
    }
  }
  if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != EROFS) {
    fail("cannot be synchronised with the disk", errno);
  }
}

void CsvWriter::fail(const char* what, int error_number) const {
  throw RunError(fmt::format("{}: {}: {}", file_.string(), what, reason_of(error_number)));
}

}  // namespace penumbra
