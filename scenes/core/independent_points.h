#pragma once

#include <cstddef>
#include <cstdint>

#include "scenes/core/block.h"
#include "scenes/core/sampler.h"

namespace penumbra {

/// Which point of which component's set goes into each lane.
struct PointLanes {
  Block<std::uint32_t> component{}, index{};

  /// Lanes [at, at + count) get points [first, first + count) of a component; whole groups are
  /// written, so lanes must be added in ascending order. at + count <= kBlock.
  void add(std::size_t at, std::size_t count, std::uint32_t of_component,
           std::uint32_t first) noexcept {
    for (std::size_t i = 0; i < whole_groups(count); ++i) {
      component[at + i] = of_component;
      index[at + i] = first + static_cast<std::uint32_t>(i);
    }
  }
};

/// Points of sets of SamplerKind::Independent, of several components at once, with the same bits
/// as from a PointSet each: populations of a few points leave most lanes idle when every set is
/// filled by itself.
/// @param key    of the sets; the component is that of each lane
/// @param count   lanes to fill; `out` gets whole groups
/// @param fourth  nullptr, or where a fourth uniform variate of each point goes, which sets do not
///                have
void fill_independent(const StreamKey& key, const PointLanes& lanes, std::size_t count,
                      VariateBlock& out, Block<float>* fourth = nullptr) noexcept;

}  // namespace penumbra
