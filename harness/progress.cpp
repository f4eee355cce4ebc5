#include "harness/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

namespace penumbra {
namespace {

constexpr double kTerminalInterval = 0.2;
constexpr double kPlainInterval = 10.0;

bool is_silent = false;

}  // namespace

std::string duration_text(double seconds) {
  if (!(seconds >= 0.0) || !std::isfinite(seconds)) return "?";
  if (seconds < 10.0) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<long long>(std::llround(seconds));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

void warn(const std::string& message) { fmt::print(stderr, "penumbra: warning: {}\n", message); }

void note(const std::string& message) {
  if (!is_silent) fmt::print(stderr, "penumbra: {}\n", message);
}

void silence_progress() { is_silent = true; }

Progress::Progress(std::string title, double total_work)
    : title_(std::move(title)), total_(total_work), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (!finished_ && terminal_ && last_print_s_ >= 0.0) std::fputc('\n', stderr);
}

void Progress::update(double done, const std::string& what) {
  const double elapsed = watch_.wall_s();
  if (elapsed - last_print_s_ < (terminal_ ? kTerminalInterval : kPlainInterval)) return;
  last_print_s_ = elapsed;
  const double share = total_ > 0.0 ? std::min(done / total_, 1.0) : 0.0;
  const std::string left =
      share > 0.01 ? duration_text(elapsed * (1.0 - share) / share) + " left" : "estimating";
  print(fmt::format("{}: {:3.0f} %, {}{}{}", title_, 100.0 * share, left, what.empty() ? "" : ", ",
                    what),
        false);
}

void Progress::finish() {
  finished_ = true;
  print(fmt::format("{}: done in {}", title_, duration_text(watch_.wall_s())), true);
}

void Progress::print(const std::string& line, bool last) {
  if (is_silent) return;
  if (terminal_) {
    fmt::print(stderr, "\r\033[K{}{}", line, last ? "\n" : "");
  } else {
    fmt::print(stderr, "{}\n", line);
  }
  std::fflush(stderr);
}

}  // namespace penumbra
