#pragma once

#include <filesystem>
#include <functional>
#include <streambuf>
#include <string>
#include <string_view>

/// OBJ and MTL as tinyobjloader reads them, with what it does not do: it takes what is not a number
/// for 0 and passes over what it does not know.
namespace penumbra {

/// Hands a text to a parser one statement at a time, so that `line` tells where the parser is, and
/// shows each one to a check before.
class StatementLines : public std::streambuf {
 public:
  /// @param check  called with the statement without leading spaces and line end; may throw. The
  ///               stream that reads must have badbit among its exceptions(), to pass it on.
  using Check = std::function<void(std::string_view statement)>;

  /// @throws InputError when the text is not one
  StatementLines(std::filesystem::path file, std::string text, Check check);

  const std::filesystem::path& file() const { return file_; }
  /// Of the statement handed out last, from 1. A statement that goes on over a backslash at the end
  /// of its line has the number of its first line.
  int line() const { return line_; }

 protected:
  int_type underflow() override;

 private:
  std::filesystem::path file_;
  std::string text_;
  Check check_;
  std::size_t next_{0};  ///< start of the statement that comes
  int line_{0}, next_line_{1};
};

/// Takes the first word off a statement.
std::string_view take_word(std::string_view& statement);

/// The words of a statement's rest with single spaces between them: a name.
std::string joined_words(std::string_view rest);

/// @throws InputError unless `rest` holds `least` to `most` decimal numbers
/// @return how many
int check_numbers(const StatementLines& lines, std::string_view keyword, std::string_view rest,
                  int least, int most);

}  // namespace penumbra
