#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "scenes/core/vec.h"

/// Directions are drawn and evaluated in blocks, structure of arrays: loops over the lanes of a
/// block are plain arithmetic without branches, which the compiler turns into vector instructions.
/// Each loop shares its formula, an inline function, with the scalar form of the same operation.
namespace penumbra {

inline constexpr std::size_t kBlock = 64;     ///< most directions in a block
inline constexpr std::size_t kLaneGroup = 8;  ///< a multiple of every vector's lanes

/// Loops run over whole groups, so that no rest is left for scalar code. What they put into the
/// lanes behind the last direction has no meaning.
constexpr std::size_t whole_groups(std::size_t count) noexcept {
  return (count + kLaneGroup - 1) & ~(kLaneGroup - 1);
}

/// One value per lane, with room for the whole group that starts at the last one.
template <class T>
using Block = std::array<T, kBlock + kLaneGroup>;

/// A vector or a colour per lane.
struct VectorBlock {
  Block<float> x{}, y{}, z{};

  Vec3 operator[](std::size_t i) const noexcept { return {x[i], y[i], z[i]}; }
  void set(std::size_t i, const Vec3& v) noexcept { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
};

/// The same for any number of lanes, with a spare group behind the last.
struct VectorArray {
  std::vector<float> x, y, z;

  explicit VectorArray(std::size_t count)
      : x(count + kLaneGroup), y(count + kLaneGroup), z(count + kLaneGroup) {}
  Vec3 operator[](std::size_t i) const noexcept { return {x[i], y[i], z[i]}; }
  void set(std::size_t i, const Vec3& v) noexcept { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
};

}  // namespace penumbra
