#pragma once

#include <string_view>

#ifdef __SSE2__
#include <xmmintrin.h>
#endif

/// The floating-point mode of threads that render.
namespace penumbra {

/// What arithmetic does with denormal numbers.
enum class Denormals : bool {
  Kept,
  Flushed,  ///< read and written as 0: Embree asks for it, because processors take a hundred times
            ///< as long for them
};

/// Sets the calling thread's treatment of denormal numbers and restores it. Each thread has its
/// own, which a thread pool's workers take from whoever happened to start them: every task that
/// renders says what it wants. Without effect on processors other than x86.
class DenormalMode {
 public:
  explicit DenormalMode([[maybe_unused]] Denormals denormals) noexcept {
#ifdef __SSE2__
    const unsigned kept = before_ & ~kFlushBits;
    _mm_setcsr(denormals == Denormals::Flushed ? kept | kFlushBits : kept);
#endif
  }
  ~DenormalMode() {
#ifdef __SSE2__
    _mm_setcsr((_mm_getcsr() & ~kFlushBits) | (before_ & kFlushBits));
#endif
  }
  DenormalMode(const DenormalMode&) = delete;
  DenormalMode& operator=(const DenormalMode&) = delete;

  /// What the calling thread does, for the record.
  static std::string_view text() noexcept {
#ifdef __SSE2__
    const unsigned bits = _mm_getcsr() & kFlushBits;
    return bits == kFlushBits ? "flushed to zero" : bits == 0 ? "kept" : "flushed in part";
#else
    return "kept";
#endif
  }

 private:
#ifdef __SSE2__
  static constexpr unsigned kFlushBits = 0x8040;  // FTZ, of results, and DAZ, of operands
  unsigned before_ = _mm_getcsr();
#endif
};

}  // namespace penumbra
