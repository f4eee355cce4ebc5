#include "scenes/core/sampler.h"

#include <Random123/philox.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr std::uint32_t kIterationShift = 20;
constexpr std::uint32_t kSetIndex = 0xffffffffu;  // counter value of a set's own scramble

// Seven rounds are the fewest that pass the statistical tests of Salmon et al. 2011, "Parallel
// random numbers: as easy as 1, 2, 3"; ten are their margin, which sampling has no use for.
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

// The top 24 bits, so that the float is exact and below 1. Through a signed integer: vectors
// convert no other.
inline float unit_float(std::uint32_t bits) noexcept {
  return static_cast<float>(static_cast<std::int32_t>(bits >> 8)) * 0x1p-24f;
}

// The first three words of points [first, first + count).
struct WordBlock {
  Block<std::uint32_t> x, y, choice;
};

void philox_block(const StreamKey& key, std::uint32_t first, std::uint32_t count,
                  WordBlock& out) noexcept {
  for (std::uint32_t i = 0; i < count; ++i) {
    const Words words = philox(key, first + i);
    out.x[i] = words[0];
    out.y[i] = words[1];
    out.choice[i] = words[2];
  }
}

// (stratum + jitter) / strata on a grid of 2^-24, rounded down so that it can not become 1. The
// half keeps the product with the rounded reciprocal on the right side of every stratum's border.
inline float stratum_float(std::uint32_t stratum, double inv_strata,
                           std::uint32_t jitter) noexcept {
  const double numerator = static_cast<double>(static_cast<std::int32_t>(stratum)) * 0x1p24 +
                           static_cast<double>(static_cast<std::int32_t>(jitter >> 8));
  const auto scaled = static_cast<std::int32_t>((numerator + 0.5) * inv_strata);
  return static_cast<float>(scaled) * 0x1p-24f;
}

// (a + b) mod n for a, b < n.
inline std::uint32_t add_modulo(std::uint32_t a, std::uint32_t b, std::uint32_t n) noexcept {
  const std::uint32_t sum = a + b;
  return sum >= n ? sum - n : sum;
}

// An almost uniform integer below n from 32 bits.
inline std::uint32_t below(std::uint32_t bits, std::uint32_t n) noexcept {
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

constexpr std::uint32_t reverse_bits(std::uint32_t x) noexcept {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  return (x >> 16) | (x << 16);
}

constexpr std::uint32_t sobol_sum(std::uint32_t index,
                                  const DirectionNumbers& directions) noexcept {
  std::uint32_t x = 0;
  for (std::size_t bit = 0; index != 0; index >>= 1, ++bit) {
    if ((index & 1u) != 0) x ^= directions[bit];
  }
  return x;
}

// The first points of a dimension with their bits reversed, as scrambling wants them.
constexpr std::uint32_t kTabulated = 256;
using ReversedTable = std::array<std::uint32_t, kTabulated + kLaneGroup>;

constexpr ReversedTable reversed_table(const DirectionNumbers& directions) {
  ReversedTable table{};
  for (std::uint32_t i = 0; i < kTabulated; ++i) table[i] = reverse_bits(sobol_sum(i, directions));
  return table;
}

constexpr ReversedTable kReversed1 = reversed_table(kSobol1);
constexpr ReversedTable kReversed2 = reversed_table(kSobol2);

// On reversed digits, additions and even-factor multiplications carry from higher to lower digits
// only.
inline std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t seed) noexcept {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

void scramble_block(const std::uint32_t* reversed, std::size_t count, std::uint32_t seed,
                    float* __restrict out) noexcept {
  for (std::size_t i = 0; i < whole_groups(count); ++i) {
    out[i] = unit_float(reverse_bits(scramble_reversed(reversed[i], seed)));
  }
}

// The bijection of [0, mask] under `permute`.
struct Mixing {
  std::uint32_t seed, n, mask;
  int half;

  Mixing(std::uint32_t n_values, std::uint32_t mixing_seed) noexcept
      : seed(mixing_seed),
        n(n_values),
        mask(std::bit_ceil(n_values) - 1),
        half((std::bit_width(mask) + 1) / 2) {}

  std::uint32_t operator()(std::uint32_t i) const noexcept {
    i = (i + seed) & mask;
    i = (i * ((seed >> 7) | 1u)) & mask;
    i ^= i >> half;
    i = (i * 0x9e3779b1u + (seed >> 16)) & mask;
    i ^= i >> half;
    i = (i * ((seed >> 19) | 0x2d1u)) & mask;
    return i ^ (i >> half);
  }

  // A final rotation by an almost uniform amount makes every image uniform whatever the mixing
  // does.
  std::uint32_t rotation() const noexcept {
    const std::uint32_t bits = (seed ^ (seed >> 15)) * 0x85ebca6bu;
    return below(bits ^ (bits >> 13), n);
  }
};

// `permute` of [first, first + count): all lanes walk until the last one has arrived.
void permute_block(std::uint32_t first, std::uint32_t count, std::uint32_t n, std::uint32_t seed,
                   Block<std::uint32_t>& out) noexcept {
  const Mixing mix(n, seed);
  const auto lanes = static_cast<std::uint32_t>(whole_groups(count));
  // A lane behind the last repeats it: a walk from outside [0, n) might never come in.
  for (std::uint32_t i = 0; i < lanes; ++i) out[i] = mix(first + std::min(i, count - 1));
  std::uint32_t walking = 0;
  do {
    walking = 0;
    for (std::uint32_t i = 0; i < lanes; ++i) {
      const std::uint32_t next = mix(out[i]);
      out[i] = out[i] >= n ? next : out[i];
      walking |= out[i] >= n ? 1u : 0u;
    }
  } while (walking != 0);
  const std::uint32_t rotation = mix.rotation();
  for (std::uint32_t i = 0; i < lanes; ++i) out[i] = add_modulo(out[i], rotation, n);
}

}  // namespace

std::string_view to_string(SamplerKind kind) {
  switch (kind) {
    case SamplerKind::Independent:
      return "independent";
    case SamplerKind::Stratified:
      return "stratified";
    case SamplerKind::Sobol:
      return "sobol";
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
std::uint32_t random_bits(const StreamKey& key, std::uint32_t index) noexcept {
  return philox(key, index)[3];
}

std::uint32_t permute(std::uint32_t index, std::uint32_t n, std::uint32_t seed) noexcept {
  PN_ASSERT(index < n);
  // Every step is a bijection of [0, mask]; walking the cycle until the value is below n makes one
  // of [0, n).
  const Mixing mix(n, seed);
  std::uint32_t i = index;
  do {
    i = mix(i);
  } while (i >= n);
  return add_modulo(i, mix.rotation(), n);
}

std::uint32_t owen_scramble(std::uint32_t fraction, std::uint32_t seed) noexcept {
  return reverse_bits(scramble_reversed(reverse_bits(fraction), seed));
}

std::uint32_t sobol_fraction(std::uint32_t index, int dimension) noexcept {
  if (dimension == 0) return reverse_bits(index);
  return sobol_sum(index, dimension == 1 ? kSobol1 : kSobol2);
}

PointSet::PointSet(SamplerKind kind, const StreamKey& key, std::uint32_t count) noexcept
    : kind_(kind),
      count_(count),
      // Member by member: a copy of the whole would wait for the parts that were just written.
      key_{key.seed, key.pixel, key.estimate, key.iteration, key.component} {
  if (kind == SamplerKind::Independent) return;
  const Words words = philox(key, kSetIndex);
  for (std::size_t d = 0; d < 3; ++d) scramble_[d] = words[d];
  if (kind == SamplerKind::Stratified) {
    // The grid nearest to a square with at least `count` cells; which axis gets more cells is a
    // coin flip, so that two points do not always split the same axis.
    columns_ = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(count)));
    rows_ = (count + columns_ - 1) / columns_;
    transposed_ = (words[3] & 1u) != 0;
    inv_columns_ = 1.0 / columns_;
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

// The stratified set's grid of columns x rows cells.
struct PointSet::Grid {
  std::uint32_t columns, rows, scramble_x, scramble_y;
  double inv_columns, inv_cells;

  // A point of a cell. Each coordinate takes a fine stratum of its own as well (N rooks): the rows
  // within a column, and the columns within a row, are turned by a random amount.
  Vec2 point(std::uint32_t cell, std::uint32_t jitter_x, std::uint32_t jitter_y) const noexcept {
    // The half keeps the quotient away from whole numbers, where rounding could reach the next row.
    const auto row = static_cast<std::uint32_t>(static_cast<std::int32_t>(
        (static_cast<double>(static_cast<std::int32_t>(cell)) + 0.5) * inv_columns));
    const std::uint32_t column = cell - row * columns;
    const std::uint32_t turn_x = below(scramble_x * (2u * column + 1u), rows);
    const std::uint32_t turn_y = below(scramble_y * (2u * row + 1u), columns);
    const std::uint32_t fine_x = column * rows + add_modulo(row, turn_x, rows);
    const std::uint32_t fine_y = row * columns + add_modulo(column, turn_y, columns);
    return {stratum_float(fine_x, inv_cells, jitter_x), stratum_float(fine_y, inv_cells, jitter_y)};
  }
};

PointSet::Grid PointSet::grid() const noexcept {
  return {columns_, rows_, scramble_[1], scramble_[2], inv_columns_, inv_cells_};
}

Variates PointSet::stratified(std::uint32_t index) const noexcept {
  const Words jitter = philox(key_, index);
  const std::uint32_t cells = columns_ * rows_;
  // Where every cell gets a point, a random turn makes each point uniform on its own; else cells
  // are left out at random.
  const std::uint32_t cell = cells == count_ ? add_modulo(index, below(scramble_[0], cells), cells)
                                             : permute(index, cells, scramble_[0]);
  Vec2 u = grid().point(cell, jitter[0], jitter[1]);
  if (transposed_) std::swap(u.x, u.y);
  const std::uint32_t slot = permute(index, count_, scramble_[1] ^ scramble_[2]);
  return {u, stratum_float(slot, inv_count_, jitter[2])};
}

Variates PointSet::sobol(std::uint32_t index) const noexcept {
  return {Vec2(unit_float(owen_scramble(sobol_fraction(index, 0), scramble_[0])),
               unit_float(owen_scramble(sobol_fraction(index, 1), scramble_[1]))),
          unit_float(owen_scramble(sobol_fraction(index, 2), scramble_[2]))};
}

struct PointSet::Lanes {
  float *x, *y, *choice;
};

void PointSet::fill(std::uint32_t first, std::uint32_t count, bool with_choice, VariateBlock& out,
                    std::size_t at) const noexcept {
  PN_ASSERT(at + count <= kBlock && first + count <= count_);
  const Lanes lanes{&out.x[at], &out.y[at], &out.choice[at]};
  switch (kind_) {
    case SamplerKind::Independent:
      return fill_independent(first, count, lanes);
    case SamplerKind::Stratified:
      return fill_stratified(first, count, with_choice, lanes);
    case SamplerKind::Sobol:
      return fill_sobol(first, count, with_choice, lanes);
  }
}

void PointSet::fill_independent(std::uint32_t first, std::uint32_t count,
                                const Lanes& out) const noexcept {
  for (std::uint32_t i = 0; i < count; ++i) {
    const Words words = philox(key_, first + i);
    out.x[i] = unit_float(words[0]);
    out.y[i] = unit_float(words[1]);
    out.choice[i] = unit_float(words[2]);
  }
}

void PointSet::fill_stratified(std::uint32_t first, std::uint32_t count, bool with_choice,
                               const Lanes& out) const noexcept {
  WordBlock jitter;
  philox_block(key_, first, count, jitter);
  Block<std::uint32_t> stratum;
  const std::uint32_t cells = columns_ * rows_;
  const auto lanes = static_cast<std::uint32_t>(whole_groups(count));
  if (cells == count_) {
    const std::uint32_t turn = below(scramble_[0], cells);
    for (std::uint32_t i = 0; i < lanes; ++i) stratum[i] = add_modulo(first + i, turn, cells);
  } else {
    permute_block(first, count, cells, scramble_[0], stratum);
  }
  const Grid cell_grid = grid();
  float* __restrict x = transposed_ ? out.y : out.x;
  float* __restrict y = transposed_ ? out.x : out.y;
  for (std::uint32_t i = 0; i < lanes; ++i) {
    const Vec2 u = cell_grid.point(stratum[i], jitter.x[i], jitter.y[i]);
    x[i] = u.x;
    y[i] = u.y;
  }
  if (!with_choice) return;
  permute_block(first, count, count_, scramble_[1] ^ scramble_[2], stratum);
  const double inv_count = inv_count_;
  float* __restrict choice = out.choice;
  for (std::uint32_t i = 0; i < lanes; ++i) {
    choice[i] = stratum_float(stratum[i], inv_count, jitter.choice[i]);
  }
}

void PointSet::fill_sobol(std::uint32_t first, std::uint32_t count, bool with_choice,
                          const Lanes& out) const noexcept {
  const auto lanes = static_cast<std::uint32_t>(whole_groups(count));
  WordBlock reversed;
  for (std::uint32_t i = 0; i < lanes; ++i) reversed.x[i] = first + i;
  const std::uint32_t* y = reversed.y.data();
  const std::uint32_t* choice = reversed.choice.data();
  if (first + count <= kTabulated) {
    y = &kReversed1[first];
    choice = &kReversed2[first];
  } else {
    for (std::uint32_t i = 0; i < count; ++i) {
      reversed.y[i] = reverse_bits(sobol_sum(first + i, kSobol1));
      reversed.choice[i] = reverse_bits(sobol_sum(first + i, kSobol2));
    }
  }
  scramble_block(reversed.x.data(), count, scramble_[0], out.x);
  scramble_block(y, count, scramble_[1], out.y);
  if (with_choice) scramble_block(choice, count, scramble_[2], out.choice);
}

}  // namespace penumbra
