#pragma once

#include <stdexcept>
#include <string>

namespace penumbra {

/// A fault of the user's input: a scene file, a config, an image, a command line.
/// The message names file, place, what was found and what is allowed. Exit code 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A fault of the machine while a valid job runs: unwritable output, disk full, unreadable image.
/// Exit code 4.
class RunError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A reference or baseline that is missing or belongs to something else. Exit code 5.
class ReferenceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Prints the message with its place and aborts; use PN_CHECK.
[[noreturn]] void check_failed(const char* file, int line, const char* condition,
                               const char* message) noexcept;

}  // namespace penumbra

/// A programmer's fault that is cheap to test: always on.
#define PN_CHECK(condition, message)                                                     \
  do {                                                                                   \
    if (!(condition)) ::penumbra::check_failed(__FILE__, __LINE__, #condition, message); \
  } while (false)

/// A programmer's fault in a hot loop: debug builds only.
#ifdef NDEBUG
#define PN_ASSERT(condition) static_cast<void>(0)
#else
#define PN_ASSERT(condition) PN_CHECK(condition, "debug assertion")
#endif
