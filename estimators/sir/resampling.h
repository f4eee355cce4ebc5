#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace penumbra {

/// A candidate that was chosen, and how often.
struct Choice {
  std::uint32_t candidate{0};
  std::uint32_t copies{0};
};

/// Systematic resampling: chooses `count` of the candidates with one offset, candidate j
/// count * w_j / sum times in expectation and never off by 1 or more. What is chosen together is
/// spread along the list.
/// @param weights  [candidate], >= 0 and finite, with a positive sum
/// @param sum      of the weights, added up in their order
/// @param offset   uniform in [0, 1)
/// @param choices  result, ascending candidates; room for min(count, candidates)
/// @return the number of choices
/// Source: Carpenter, Clifford and Fearnhead 1999, "Improved particle filter for nonlinear
/// problems".
std::size_t systematic_choice(std::span<const double> weights, double sum, std::uint32_t count,
                              double offset, std::span<Choice> choices) noexcept;

}  // namespace penumbra
