#pragma once

#include <cstdint>

namespace penumbra {

/// Wall and CPU time since its making.
class Stopwatch {
 public:
  Stopwatch();
  double wall_s() const;  ///< monotonic clock
  double cpu_s() const;   ///< of the whole process, all threads

 private:
  std::int64_t wall_start_ns_;
  std::int64_t cpu_start_ns_;
};

/// CPU time of the calling thread so far, of which differences mean something [s].
double thread_cpu_s();

/// Instructions retired in user space by this process and the threads it makes, through
/// perf_event_open; absent where the kernel does not allow it.
class InstructionCounter {
 public:
  struct Reading {
    std::uint64_t value{0};
    bool valid{false};
  };

  /// Opens the counter; call before any thread is made, because only later threads inherit it.
  static void open();
  static Reading read();
  /// @return 0 where nothing is counted
  static std::uint64_t since(const Reading& before);
};

}  // namespace penumbra
