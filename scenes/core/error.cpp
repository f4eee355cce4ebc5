#include "scenes/core/error.h"

#include <cstdio>
#include <cstdlib>

namespace penumbra {

void check_failed(const char* file, int line, const char* condition, const char* message) noexcept {
  std::fprintf(stderr, "%s:%d: internal error: %s (%s)\n", file, line, message, condition);
  std::abort();
}

}  // namespace penumbra
