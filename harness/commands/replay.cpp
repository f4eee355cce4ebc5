#include "harness/replay.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdio>

#include "harness/commands/commands.h"
#include "harness/progress.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

struct Pixel {
  int x{0}, y{0};
};

bool parse_whole(std::string_view text, int& value) {
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end;
}

Pixel parse_pixel(const std::string& text) {
  const std::string_view view = text;
  const std::size_t comma = view.find(',');
  Pixel pixel;
  if (comma != std::string_view::npos && parse_whole(view.substr(0, comma), pixel.x) &&
      parse_whole(view.substr(comma + 1), pixel.y)) {
    return pixel;
  }
  throw InputError("--pixel: expected X,Y as two whole numbers, such as 12,34; found \"" + text +
                   "\"");
}

// Complaints go to stderr, so that --json stays whole. @return the exit code
int judge(const PixelReplay& replay, const std::optional<RowCheck>& check) {
  int code = kSuccess;
  if (replay.differs()) {
    const Rgb& file = replay.stored->value;
    warn(fmt::format("pixel {},{} is ({:.9g}, {:.9g}, {:.9g}), but {} has ({:.9g}, {:.9g}, {:.9g})",
                     replay.x, replay.y, replay.value.x, replay.value.y, replay.value.z,
                     replay.stored->file.string(), file.x, file.y, file.z));
    code = kCorrectness;
  }
  if (check && !check->same()) {
    warn(fmt::format("the row's image has the hash {}, rendered again it has {}", check->stored,
                     check->rendered));
    code = kCorrectness;
  }
  return code;
}

}  // namespace

int replay_command(const ReplayOptions& options) {
  const Pixel pixel = parse_pixel(options.pixel);
  const StoredRow stored(options.folder, options.row);
  if (options.estimate && (*options.estimate < 0 || *options.estimate >= stored.row().spp)) {
    throw InputError(fmt::format("--estimate: expected 0 to {}, found {}", stored.row().spp - 1,
                                 *options.estimate));
  }
  const PixelReplay replay = replay_pixel(stored, pixel.x, pixel.y);
  std::optional<RowCheck> check;
  if (options.verify) check = verify_row(stored, resolve_threads(options.threads));
  if (options.json) {
    fmt::print("{}", replay_json(stored, replay, options.estimate, check));
  } else {
    fmt::print("{}", replay_text(stored, replay, options.estimate));
    if (check && check->same()) fmt::print("\nrow reproduced to the bit\n");
  }
  std::fflush(stdout);
  return judge(replay, check);
}

}  // namespace penumbra
