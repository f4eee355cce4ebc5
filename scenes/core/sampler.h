#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "scenes/core/block.h"
#include "scenes/core/vec.h"

/// Point sets for one component of one estimate. Random numbers are keyed by what they are for,
/// never by who draws them, so an image has the same bits on any number of threads and one pixel
/// can be replayed alone.
namespace penumbra {

/// The kind of points, a property of a run and the same for every estimator of a comparison.
enum class SamplerKind : std::uint8_t {
  Independent,  ///< Philox 4x32-7, every point on its own
  Stratified,   ///< multi-jittered in 2D, jittered in 1D, for any number of points
  Sobol,        ///< Owen-scrambled Sobol sequence, scrambled afresh for every key
};

std::string_view to_string(SamplerKind kind);
std::optional<SamplerKind> parse_sampler_kind(std::string_view name);

/// What a point set is for. Ranges: iteration < 2^12, component < 2^20.
struct StreamKey {
  std::uint64_t seed{0};
  std::uint32_t pixel{0};      ///< index in the image, row-major
  std::uint32_t estimate{0};   ///< index of the estimate in the pixel
  std::uint32_t iteration{0};  ///< adaptation stage; a new one means a fresh randomisation
  std::uint32_t component{0};  ///< mixture component, or one of the purposes below
};

/// Components that are not proposals of a mixture.
inline constexpr std::uint32_t kCameraComponent = (1u << 20) - 1;
inline constexpr std::uint32_t kRoundingComponent = (1u << 20) - 2;

/// Three uniform variates in [0, 1), multiples of 2^-24: a point and a choice (a lobe, a triangle).
struct Variates {
  Vec2 u;
  float choice;
};

/// Variates of up to kBlock points.
struct VariateBlock {
  Block<float> x{}, y{}, choice{};

  Variates operator[](std::size_t i) const noexcept { return {Vec2(x[i], y[i]), choice[i]}; }
};

/// 32 random bits, for decisions that are not points (tie breaks, offsets).
std::uint32_t random_bits(const StreamKey& key, std::uint32_t index = 0) noexcept;

/// `count` points for one key. Each point is marginally uniform, so any estimate from them is
/// unbiased; together they are stratified as the kind says. Copies are cheap and share no state.
class PointSet {
 public:
  /// @param count  number of points that will be drawn, >= 1; stratification is over exactly these
  PointSet(SamplerKind kind, const StreamKey& key, std::uint32_t count) noexcept;

  /// @param index  in [0, count)
  Variates operator()(std::uint32_t index) const noexcept;

  /// Points [first, first + count), with the same bits as one at a time, into the lanes from `at`
  /// on; at + count <= kBlock.
  /// @param with_choice  false leaves `out.choice` alone, for what has nothing to choose
  void fill(std::uint32_t first, std::uint32_t count, bool with_choice, VariateBlock& out,
            std::size_t at = 0) const noexcept;

 private:
  struct Grid;
  Grid grid() const noexcept;
  Variates stratified(std::uint32_t index) const noexcept;
  Variates sobol(std::uint32_t index) const noexcept;
  struct Lanes;  // where points go
  void fill_independent(std::uint32_t first, std::uint32_t count, const Lanes& out) const noexcept;
  void fill_stratified(std::uint32_t first, std::uint32_t count, bool with_choice,
                       const Lanes& out) const noexcept;
  void fill_sobol(std::uint32_t first, std::uint32_t count, bool with_choice,
                  const Lanes& out) const noexcept;

  SamplerKind kind_;
  bool transposed_{false};
  std::uint32_t count_;
  std::uint32_t columns_{1}, rows_{1};
  double inv_columns_{1.0}, inv_cells_{1.0}, inv_count_{1.0};
  std::uint32_t scramble_[3]{};
  StreamKey key_;
};

/// Bijection of [0, n) chosen by a seed; uniform in its image for every index.
/// Source of the idea (invertible mixing with cycle walking): Kensler 2013, "Correlated
/// multi-jittered sampling".
std::uint32_t permute(std::uint32_t index, std::uint32_t n, std::uint32_t seed) noexcept;

/// Nested uniform scramble of a 32-bit fraction: flips of a digit depend on all higher digits.
/// Source: Laine and Karras 2011; Burley 2020, "Practical hash-based Owen scrambling"; constants by
/// Vegdahl 2021.
std::uint32_t owen_scramble(std::uint32_t fraction, std::uint32_t seed) noexcept;

/// Point `index` of dimension 0, 1 or 2 of the Sobol sequence as a 32-bit fraction.
/// Source: Joe and Kuo 2008, "Constructing Sobol sequences with better two-dimensional
/// projections".
std::uint32_t sobol_fraction(std::uint32_t index, int dimension) noexcept;

}  // namespace penumbra
