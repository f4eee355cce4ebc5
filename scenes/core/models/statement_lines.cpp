#include "scenes/core/models/statement_lines.h"

#include <utility>

#include "scenes/core/models/mesh_tools.h"

namespace penumbra {
namespace {

constexpr std::string_view kSpaces = " \t\r";

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Skips digits from `i` on.
/// @return whether there was one
bool skip_digits(std::string_view word, std::size_t& i) {
  const std::size_t first = i;
  while (i < word.size() && is_digit(word[i])) ++i;
  return i > first;
}

bool is_number(std::string_view word) {
  const auto is_sign = [&](std::size_t i) {
    return i < word.size() && (word[i] == '+' || word[i] == '-');
  };
  std::size_t i = is_sign(0) ? 1 : 0;
  bool has_digits = skip_digits(word, i);
  if (i < word.size() && word[i] == '.') {
    ++i;
    has_digits |= skip_digits(word, i);
  }
  if (!has_digits) return false;
  if (i < word.size() && (word[i] == 'e' || word[i] == 'E')) {
    ++i;
    if (is_sign(i)) ++i;
    if (!skip_digits(word, i)) return false;
  }
  return i == word.size();
}

}  // namespace

StatementLines::StatementLines(std::filesystem::path file, std::string text, Check check)
    : file_(std::move(file)), text_(std::move(text)), check_(std::move(check)) {
  if (const std::size_t zero = text_.find('\0'); zero != std::string::npos) {
    model_error(file_, "is not a text: byte " + std::to_string(zero) + " is 0");
  }
}

StatementLines::int_type StatementLines::underflow() {
  if (next_ >= text_.size()) return traits_type::eof();
  line_ = next_line_;
  const std::size_t begin = next_;
  std::size_t end = begin;
  for (bool goes_on = true; goes_on;) {
    const std::size_t newline = text_.find('\n', end);
    end = newline == std::string::npos ? text_.size() : newline + 1;
    ++next_line_;
    std::size_t last = newline;
    if (last != std::string::npos && last > begin && text_[last - 1] == '\r') --last;
    goes_on = last != std::string::npos && last > begin && text_[last - 1] == '\\';
    if (goes_on) text_.replace(last - 1, end - last + 1, end - last + 1, ' ');
  }
  next_ = end;
  const std::string_view statement(&text_[begin], end - begin);
  const std::size_t first = statement.find_first_not_of(kSpaces);
  const std::size_t last = statement.find_last_not_of(" \t\r\n");
  if (last != std::string_view::npos && statement[first] != '#') {
    check_(statement.substr(first, last - first + 1));
  }
  setg(&text_[begin], &text_[begin], &text_[begin] + (end - begin));
  return traits_type::to_int_type(text_[begin]);
}

std::string_view take_word(std::string_view& statement) {
  const std::size_t first = statement.find_first_not_of(kSpaces);
  if (first == std::string_view::npos) {
    statement = {};
    return {};
  }
  statement.remove_prefix(first);
  const std::string_view word = statement.substr(0, statement.find_first_of(kSpaces));
  statement.remove_prefix(word.size());
  return word;
}

std::string joined_words(std::string_view rest) {
  std::string result;
  for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
    if (!result.empty()) result += ' ';
    result += word;
  }
  return result;
}

int check_numbers(const StatementLines& lines, std::string_view keyword, std::string_view rest,
                  int least, int most) {
  int count = 0;
  while (true) {
    const std::string_view word = take_word(rest);
    if (word.empty()) break;
    if (!is_number(word)) {
      model_error(lines.file(), lines.line(),
                  "expected a finite number after \"" + std::string(keyword) + "\", found \"" +
                      std::string(word) + "\"");
    }
    ++count;
  }
  if (count < least || count > most) {
    model_error(lines.file(), lines.line(),
                "expected " + std::to_string(least) +
                    (most > least ? " to " + std::to_string(most) : "") + " numbers after \"" +
                    std::string(keyword) + "\", found " + std::to_string(count));
  }
  return count;
}

}  // namespace penumbra
