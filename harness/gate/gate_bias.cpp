#include "harness/gate/gate_bias.h"

#include <fmt/format.h>

#include "harness/replicates.h"

namespace penumbra {

GateBias test_gate_bias(std::span<const GateRun> head, const Reference& reference,
                        const std::string& declared) {
  GateBias bias;
  if (!declared.empty()) {
    bias.skipped = "declared biased: " + declared;
    return bias;
  }
  TileReplicates tiles(bias_tiles(reference.half_a.width, reference.half_a.height, kBiasTileSides));
  for (const GateRun& run : head) {
    if (run.failure.empty() && run.tiles.values.size() == tiles.tiles().size()) {
      tiles.add_values(run.tiles.values);
    }
  }
  bias.blocks = static_cast<int>(tiles.count());
  const std::optional<BiasTestResult> test =
      test_bias(tiles, {reference.halves(), reference.exact(), reference.correlated_side},
                reference.half_a.width, reference.half_a.height);
  if (!test) {
    bias.skipped =
        fmt::format("{} pictures, expected at least {}", tiles.count(), kReplicatesForTest);
    return bias;
  }
  bias.p = test->smallest_p;
  if (test->relative_bias) {
    bias.relative = test->relative_bias->value;
    bias.relative_interval = test->relative_bias->interval;
  }
  return bias;
}

void adjust_bias(std::vector<GateCell>& cells) {
  std::vector<double> p;
  for (const GateCell& cell : cells) {
    if (cell.bias.skipped.empty()) p.push_back(cell.bias.p);
  }
  const std::vector<double> adjusted = holm_adjusted(p);
  std::size_t next = 0;
  for (GateCell& cell : cells) {
    if (cell.bias.skipped.empty()) cell.bias.adjusted_p = adjusted[next++];
  }
}

}  // namespace penumbra
