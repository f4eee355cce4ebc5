#pragma once

#include <string>

#include "harness/clocks.h"

namespace penumbra {

/// Progress with an estimate of the time left, on stderr: one line rewritten in place on a
/// terminal, plain lines every ten seconds otherwise.
class Progress {
 public:
  /// @param total_work  in any unit that is proportional to time
  Progress(std::string title, double total_work);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Work done so far, and what is under way.
  void update(double done, const std::string& what = {});
  /// Ends the line; prints the time taken.
  void finish();

 private:
  void print(const std::string& line, bool last);

  std::string title_;
  double total_;
  Stopwatch watch_;
  double last_print_s_{-1e9};
  bool terminal_;
  bool finished_{false};
};

/// Notes and progress of this process are not printed any more; warnings are. For ranks other than
/// the first, which say the same.
void silence_progress();

/// "42 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);

/// Prints a line on stderr: "penumbra: warning: ...".
void warn(const std::string& message);
void note(const std::string& message);

}  // namespace penumbra
