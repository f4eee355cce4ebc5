#pragma once

#include <cstddef>
#include <cstdint>

#include "scenes/core/block.h"
#include "scenes/core/sampler.h"

namespace penumbra {

/// Points in the order of a Hilbert curve through the unit square, one in each of `count` equal
/// pieces of the curve: neighbours in the list are neighbours in the square, so a systematic choice
/// along it is stratified. Each point is uniform in its piece, so a list is unbiased for any count.
///
/// Turns independent variates into such points: lanes [at, at + lanes) get points
/// [first, first + lanes) of a list of `count`.
/// @param position  [lane] uniform in [0, 1): where in its piece a point lies
/// @param points    x and y, uniform on entry, are replaced; choice stays
/// Source of the idea: He and Owen 2016, "Extensible grids: uniform sampling on a space-filling
/// curve".
void place_along_curve(std::uint32_t first, std::uint32_t lanes, std::uint32_t count,
                       const Block<float>& position, VariateBlock& points, std::size_t at) noexcept;

}  // namespace penumbra
