#include "scenes/core/independent_points.h"

#include "scenes/core/error.h"

#if defined(__AVX2__)
#include <immintrin.h>

#include <cstring>
#endif

namespace penumbra {

#if defined(__AVX2__)
namespace {

// Philox 4x32-7 of eight counters at a time. The words of even lanes fill the low halves of 64-bit
// numbers, those of odd lanes another vector's: there the processor's product of two words needs no
// shuffling, with which the compiler's own vectors take longer than one counter after the other (56
// and 50 ns for eight points; so 32). Source: Salmon et al. 2011, "Parallel random numbers: as easy
// as 1, 2, 3".
using Wide = std::uint64_t __attribute__((vector_size(32)));

constexpr int kRounds = 7;
constexpr std::uint64_t kLow = 0xffffffffu;

// The products of the low halves.
Wide multiply(Wide a, std::uint64_t b) noexcept {
  return Wide(_mm256_mul_epu32(__m256i(a), __m256i(Wide{} + b)));
}

struct Words {
  Wide x, y, z, w;

  void round(std::uint64_t key0, std::uint64_t key1) noexcept {
    const Wide a = multiply(x, 0xd2511f53u);
    const Wide b = multiply(z, 0xcd9e8d57u);
    *this = {(b >> 32) ^ y ^ key0, b & kLow, (a >> 32) ^ w ^ key1, a & kLow};
  }
};

Wide load(const std::uint32_t* lanes) noexcept {
  Wide both;
  std::memcpy(&both, lanes, sizeof(both));
  return both;
}

// As unit_float of the sampler: the top 24 bits.
void store_units(Wide even, Wide odd, float* lanes) noexcept {
  using Integers = std::int32_t __attribute__((vector_size(32)));
  using Floats = float __attribute__((vector_size(32)));
  const auto bits = Integers((even >> 8) | ((odd >> 8) << 32));
  const Floats units = __builtin_convertvector(bits, Floats) * 0x1p-24f;
  std::memcpy(lanes, &units, sizeof(units));
}

}  // namespace

void fill_independent(const StreamKey& key, const PointLanes& lanes, std::size_t count,
                      VariateBlock& out, Block<float>* fourth) noexcept {
  constexpr std::uint32_t kIterationShift = 20;
  PN_ASSERT(count <= kBlock && key.iteration < (1u << 12));
  const Wide iteration = Wide{} + (std::uint64_t{key.iteration} << kIterationShift);
  for (std::size_t i = 0; i < count; i += kLaneGroup) {
    const Wide component = load(&lanes.component[i]);
    const Wide index = load(&lanes.index[i]);
    const Wide pixel = Wide{} + std::uint64_t{key.pixel};
    const Wide estimate = Wide{} + std::uint64_t{key.estimate};
    Words even{pixel, estimate, (component & kLow) | iteration, index & kLow};
    Words odd{pixel, estimate, (component >> 32) | iteration, index >> 32};
    std::uint64_t key0 = key.seed & kLow;
    std::uint64_t key1 = key.seed >> 32;
    for (int round = 0; round < kRounds; ++round) {
      even.round(key0, key1);
      odd.round(key0, key1);
      key0 = (key0 + 0x9e3779b9u) & kLow;
      key1 = (key1 + 0xbb67ae85u) & kLow;
    }
    store_units(even.x, odd.x, &out.x[i]);
    store_units(even.y, odd.y, &out.y[i]);
    store_units(even.z, odd.z, &out.choice[i]);
    if (fourth != nullptr) store_units(even.w, odd.w, &(*fourth)[i]);
  }
}

#else

void fill_independent(const StreamKey& key, const PointLanes& lanes, std::size_t count,
                      VariateBlock& out, Block<float>* fourth) noexcept {
  StreamKey of_lane = key;
  for (std::size_t i = 0; i < count; ++i) {
    of_lane.component = lanes.component[i];
    const Variates v =
        PointSet(SamplerKind::Independent, of_lane, lanes.index[i] + 1)(lanes.index[i]);
    out.x[i] = v.u.x;
    out.y[i] = v.u.y;
    out.choice[i] = v.choice;
    if (fourth == nullptr) continue;
    (*fourth)[i] = static_cast<float>(random_bits(of_lane, lanes.index[i]) >> 8) * 0x1p-24f;
  }
}

#endif

}  // namespace penumbra
