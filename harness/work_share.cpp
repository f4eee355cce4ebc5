#include "harness/work_share.h"

#include <charconv>
#include <string_view>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

// @return 0 where the text is no positive number
int positive_number(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() && value > 0 ? value : 0;
}

}  // namespace

WorkShare parse_shard(const std::string& text) {
  const std::size_t slash = text.find('/');
  const int number = positive_number(std::string_view(text).substr(0, slash));
  const int count =
      slash == std::string::npos ? 0 : positive_number(std::string_view(text).substr(slash + 1));
  if (number == 0 || count == 0 || number > count) {
    throw InputError(
        "--shard \"" + text +
        "\": expected I/N with 1 <= I <= N, such as 1/3 for the first of three shards");
  }
  return {number - 1, count};
}

}  // namespace penumbra
