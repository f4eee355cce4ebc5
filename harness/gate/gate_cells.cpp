#include "harness/gate/gate_cells.h"

#include <fmt/format.h>

#include <map>

#include "harness/experiment.h"
#include "harness/keys.h"

namespace penumbra {

std::vector<std::string> gate_cell_names(const ExperimentConfig& config,
                                         std::span<const Cell> cells) {
  std::vector<std::string> names;
  std::map<std::string, int> count;
  for (const Cell& cell : cells) {
    names.push_back(fmt::format("{}/{}/{}", config.scenes[cell.scene].name, cell.label,
                                to_string(cell.sampler)));
    ++count[names.back()];
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (count[names[i]] == 1) continue;
    names[i] += fmt::format("/spp={},srl={}", cells[i].spp, cells[i].srl.text());
    if (!cells[i].params_text.empty()) names[i] += "," + cells[i].params_text;
  }
  return names;
}

std::uint64_t gate_seed(const ExperimentConfig& config, const std::string& cell, int block) {
  return hash_texts({"gate", std::to_string(config.seed), cell, std::to_string(block)});
}

void set_thresholds(const GateConfig& config, std::span<const GateOverride> accepted,
                    GateCellRuns& runs) {
  runs.thresholds = config.thresholds_of(runs.name);
  for (const GateOverride& loss : accepted) {
    if (!matches_glob(loss.cells, runs.name)) continue;
    runs.thresholds = loss.thresholds;
    runs.accepted = loss.reason;
  }
}

}  // namespace penumbra
