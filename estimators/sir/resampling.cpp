#include "estimators/sir/resampling.h"

namespace penumbra {

std::size_t systematic_choice(std::span<const double> weights, double sum, std::uint32_t count,
                              double offset, std::span<Choice> choices) noexcept {
  const double scale = static_cast<double>(count) / sum;
  std::size_t chosen = 0;
  double cumulative = 0.0;
  std::uint32_t before = 0;
  std::uint32_t last = 0;  // candidate of positive weight
  for (std::size_t j = 0; j < weights.size(); ++j) {
    if (!(weights[j] > 0.0)) continue;
    last = static_cast<std::uint32_t>(j);
    cumulative += weights[j];
    // Marks stand at offset, offset + 1, ...; upto of them lie below the scaled sum.
    const double place = cumulative * scale - offset;
    if (!(place > static_cast<double>(before))) continue;
    const auto whole = static_cast<std::uint32_t>(place);
    std::uint32_t upto = whole + (place > static_cast<double>(whole) ? 1u : 0u);
    if (upto > count) upto = count;
    if (upto == before) continue;
    choices[chosen++] = {last, upto - before};
    before = upto;
  }
  // The sum may round to just below the last mark.
  if (before < count) {
    if (chosen > 0 && choices[chosen - 1].candidate == last) {
      choices[chosen - 1].copies += count - before;
    } else {
      choices[chosen++] = {last, count - before};
    }
  }
  return chosen;
}

}  // namespace penumbra
