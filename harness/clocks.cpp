#include "harness/clocks.h"

#include <linux/perf_event.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstring>
#include <ctime>

namespace penumbra {
namespace {

std::int64_t now_ns(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

// Process-wide by nature: one counter of one process, opened once by main.
int counter_descriptor = -1;

}  // namespace

Stopwatch::Stopwatch()
    : wall_start_ns_(now_ns(CLOCK_MONOTONIC)), cpu_start_ns_(now_ns(CLOCK_PROCESS_CPUTIME_ID)) {}

double Stopwatch::wall_s() const {
  return static_cast<double>(now_ns(CLOCK_MONOTONIC) - wall_start_ns_) * 1e-9;
}

double Stopwatch::cpu_s() const {
  return static_cast<double>(now_ns(CLOCK_PROCESS_CPUTIME_ID) - cpu_start_ns_) * 1e-9;
}

double thread_cpu_s() { return static_cast<double>(now_ns(CLOCK_THREAD_CPUTIME_ID)) * 1e-9; }

void InstructionCounter::open() {
  perf_event_attr attributes;
  std::memset(&attributes, 0, sizeof(attributes));
  attributes.type = PERF_TYPE_HARDWARE;
  attributes.size = sizeof(attributes);
  attributes.config = PERF_COUNT_HW_INSTRUCTIONS;
  attributes.inherit = 1;
  attributes.exclude_kernel = 1;
  attributes.exclude_hv = 1;
  counter_descriptor =
      static_cast<int>(syscall(SYS_perf_event_open, &attributes, 0, -1, -1, PERF_FLAG_FD_CLOEXEC));
}

InstructionCounter::Reading InstructionCounter::read() {
  Reading reading;
  reading.valid = counter_descriptor >= 0 &&
                  ::read(counter_descriptor, &reading.value, sizeof(reading.value)) ==
                      static_cast<ssize_t>(sizeof(reading.value));
  return reading;
}

std::uint64_t InstructionCounter::since(const Reading& before) {
  const Reading after = read();
  return before.valid && after.valid ? after.value - before.value : 0;
}

}  // namespace penumbra
