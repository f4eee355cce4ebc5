#include "scenes/core/sampler.h"

#include <Random123/philox.h>

#include <array>
#include <bit>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr std::uint32_t kIterationShift = 20;
constexpr std::uint32_t kSetIndex = 0xffffffffu;  // counter value of a set's own scramble

// Seven rounds are the fewest that pass the statistical tests of Salmon et al. 2011, "Parallel random numbers: as easy
// as 1, 2, 3"; ten are their margin, which sampling has no use for.
using Philox = r123::Philox4x32_R<7>;
using Words = Philox::ctr_type;

Words philox(const StreamKey& key, std::uint32_t index) noexcept {
  PN_ASSERT(key.component < (1u << kIterationShift) && key.iteration < (1u << 12));
  const Words counter = {
      {key.pixel, key.estimate, (key.iteration << kIterationShift) | key.component, index}};
  const Philox::key_type philox_key = {
      {static_cast<std::uint32_t>(key.seed), static_cast<std::uint32_t>(key.seed >> 32)}};
  return Philox()(counter, philox_key);
}

// The top 24 bits, so that the float is exact and below 1.
float unit_float(std::uint32_t bits) noexcept {
  return static_cast<float>(bits >> 8) * 0x1p-24f;
}

// (stratum + jitter) / strata on a grid of 2^-24, rounded down so that it can not become 1. The half keeps the product
// with the rounded reciprocal on the right side of every stratum's border.
float stratum_float(std::uint32_t stratum, double inv_strata, std::uint32_t jitter) noexcept {
  const std::uint64_t numerator = (std::uint64_t{stratum} << 24) + (jitter >> 8);
  const auto scaled =
      static_cast<std::int64_t>((static_cast<double>(numerator) + 0.5) * inv_strata);
  return static_cast<float>(scaled) * 0x1p-24f;
}

// (a + b) mod n for a, b < n.
std::uint32_t add_modulo(std::uint32_t a, std::uint32_t b, std::uint32_t n) noexcept {
  const std::uint32_t sum = a + b;
  return sum >= n ? sum - n : sum;
}

// An almost uniform integer below n from 32 bits.
std::uint32_t below(std::uint32_t bits, std::uint32_t n) noexcept {
  return static_cast<std::uint32_t>((std::uint64_t{bits} * n) >> 32);
}

using DirectionNumbers = std::array<std::uint32_t, 32>;

// Dimension 1 of Joe and Kuo: polynomial x + 1, m = {1}. Dimension 2: x^2 + x + 1, m = {1, 3}.
constexpr DirectionNumbers sobol_directions_1() {
  DirectionNumbers v{};
  v[0] = 0x80000000u;
  for (std::size_t i = 1; i < 32; ++i) v[i] = v[i - 1] ^ (v[i - 1] >> 1);
  return v;
}

constexpr DirectionNumbers sobol_directions_2() {
  DirectionNumbers v{};
  v[0] = 0x80000000u;
  v[1] = 0xc0000000u;
  for (std::size_t i = 2; i < 32; ++i) v[i] = v[i - 2] ^ (v[i - 2] >> 2) ^ v[i - 1];
  return v;
}

constexpr DirectionNumbers kSobol1 = sobol_directions_1();
constexpr DirectionNumbers kSobol2 = sobol_directions_2();

std::uint32_t reverse_bits(std::uint32_t x) noexcept {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  return __builtin_bswap32(x);
}

}  // namespace

std::string_view to_string(SamplerKind kind) {
  switch (kind) {
    case SamplerKind::Independent: return "independent";
    case SamplerKind::Stratified: return "stratified";
    case SamplerKind::Sobol: return "sobol";
  }
  return "?";
}

std::optional<SamplerKind> parse_sampler_kind(std::string_view name) {
  for (const SamplerKind kind :
       {SamplerKind::Independent, SamplerKind::Stratified, SamplerKind::Sobol}) {
    if (name == to_string(kind)) return kind;
  }
  return std::nullopt;
}

// The fourth word: no point set of the same key uses it.
std::uint32_t random_bits(const StreamKey& key) noexcept { return philox(key, 0)[3]; }

std::uint32_t permute(std::uint32_t index, std::uint32_t n, std::uint32_t seed) noexcept {
  PN_ASSERT(index < n);
  const std::uint32_t mask = std::bit_ceil(n) - 1;
  const int half = (std::bit_width(mask) + 1) / 2;
  // Every step is a bijection of [0, mask]; walking the cycle until the value is below n makes one of [0, n).
  std::uint32_t i = index;
  do {
    i = (i + seed) & mask;
    i = (i * ((seed >> 7) | 1u)) & mask;
    i ^= i >> half;
    i = (i * 0x9e3779b1u + (seed >> 16)) & mask;
    i ^= i >> half;
    i = (i * ((seed >> 19) | 0x2d1u)) & mask;
    i ^= i >> half;
  } while (i >= n);
  // A final rotation by an almost uniform amount makes every image uniform whatever the mixing does.
  const std::uint32_t rotation = (seed ^ (seed >> 15)) * 0x85ebca6bu;
  return add_modulo(i, below(rotation ^ (rotation >> 13), n), n);
}

std::uint32_t owen_scramble(std::uint32_t fraction, std::uint32_t seed) noexcept {
  // On reversed digits, additions and even-factor multiplications carry from higher to lower digits only.
  std::uint32_t x = reverse_bits(fraction);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reverse_bits(x);
}

std::uint32_t sobol_fraction(std::uint32_t index, int dimension) noexcept {
  if (dimension == 0) return reverse_bits(index);
  const DirectionNumbers& directions = dimension == 1 ? kSobol1 : kSobol2;
  std::uint32_t x = 0;
  for (std::size_t bit = 0; index != 0; index >>= 1, ++bit) {
    if ((index & 1u) != 0) x ^= directions[bit];
  }
  return x;
}

PointSet::PointSet(SamplerKind kind, const StreamKey& key, std::uint32_t count) noexcept
    : kind_(kind), count_(count), key_(key) {
  if (kind == SamplerKind::Independent) return;
  const Words words = philox(key, kSetIndex);
  for (std::size_t d = 0; d < 3; ++d) scramble_[d] = words[d];
  if (kind == SamplerKind::Stratified) {
    // The grid nearest to a square with at least `count` cells; which axis gets more cells is a coin flip, so
    // that two points do not always split the same axis.
    columns_ = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(count)));
    rows_ = (count + columns_ - 1) / columns_;
    transposed_ = (words[3] & 1u) != 0;
    inv_cells_ = 1.0 / (columns_ * rows_);
    inv_count_ = 1.0 / count_;
  }
}

Variates PointSet::operator()(std::uint32_t index) const noexcept {
  PN_ASSERT(index < count_);
  if (kind_ == SamplerKind::Sobol) return sobol(index);
  if (kind_ == SamplerKind::Stratified) return stratified(index);
  const Words words = philox(key_, index);
  return {Vec2(unit_float(words[0]), unit_float(words[1])), unit_float(words[2])};
}

Variates PointSet::stratified(std::uint32_t index) const noexcept {
  const Words jitter = philox(key_, index);
  const std::uint32_t cells = columns_ * rows_;
  // Where every cell gets a point, a random turn makes each point uniform on its own; else cells are left out at random.
  const std::uint32_t cell = cells == count_
                                 ? add_modulo(index, below(scramble_[0], cells), cells)
                                 : permute(index, cells, scramble_[0]);
  const std::uint32_t row = cell / columns_;
  const std::uint32_t column = cell - row * columns_;
  // Each coordinate takes a fine stratum of its own as well (N rooks): the rows within a column, and the columns within
  // a row, are turned by a random amount.
  const std::uint32_t turn_x = below(scramble_[1] * (2u * column + 1u), rows_);
  const std::uint32_t turn_y = below(scramble_[2] * (2u * row + 1u), columns_);
  const std::uint32_t fine_x = column * rows_ + add_modulo(row, turn_x, rows_);
  const std::uint32_t fine_y = row * columns_ + add_modulo(column, turn_y, columns_);
  Vec2 u(stratum_float(fine_x, inv_cells_, jitter[0]), stratum_float(fine_y, inv_cells_, jitter[1]));
  if (transposed_) std::swap(u.x, u.y);
  const std::uint32_t slot = permute(index, count_, scramble_[1] ^ scramble_[2]);
  return {u, stratum_float(slot, inv_count_, jitter[2])};
}

Variates PointSet::sobol(std::uint32_t index) const noexcept {
  return {Vec2(unit_float(owen_scramble(sobol_fraction(index, 0), scramble_[0])),
               unit_float(owen_scramble(sobol_fraction(index, 1), scramble_[1]))),
          unit_float(owen_scramble(sobol_fraction(index, 2), scramble_[2]))};
}

}  // namespace penumbra
