#include "harness/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/keys.h"
#include "harness/reference.h"
#include "harness/render.h"
#include "harness/sweep.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

void finish_cell(const ExperimentConfig& config, const LoadedScene& scene, Cell& cell) {
  cell.params_text = cell.params.differences(cell.estimator->params());
  std::string numbers = fmt::format(
      "{} {} {} {}", cell.srl.text(), cell.budget_time.value_or(0.0),
      config.budget && config.budget->solve_for == SolveFor::Srl ? "srl" : "spp", cell.spp);
  if (config.budget && config.budget->match) numbers += " x " + *config.budget->match;
  cell.id = hash_id({"cell", scene.config->name, reference_id(scene), cell.label,
                     cell.estimator->name, cell.params_text, to_string(cell.sampler), numbers});
  // Refused combinations are found before anything runs.
  cell.estimator->create(*scene.scene, cell.params, cell.budget());
}

}  // namespace

Srl split_srl(int total, bool adaptive) {
  if (!adaptive) return {total, 0, false};
  const int initial = std::max(2, (total + 2) / 4);
  return {initial, total - initial, true};
}

Srl scaled_srl(const Srl& srl, int total) {
  if (!srl.split) return {total, 0, false};
  const double share = static_cast<double>(srl.initial) / srl.total();
  // Something is left to adapt with, where the given split has that.
  const int most = srl.adaptive > 0 ? std::max(1, total - 1) : total;
  const int least = std::min({2, srl.initial, most});
  const int initial = std::clamp(static_cast<int>(std::lround(share * total)), least, most);
  return {initial, total - initial, true};
}

std::vector<Cell> expand_cells(const ExperimentConfig& config,
                               const std::vector<LoadedScene>& scenes) {
  std::vector<std::optional<double>> budgets(1);
  if (config.budget) budgets.assign(config.budget->times.begin(), config.budget->times.end());
  std::vector<Cell> cells;
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    for (const MethodConfig& method : config.methods) {
      for (const SweepPoint& point : sweep_points(config, method, &config.scenes[s])) {
        for (const std::optional<double>& budget_time : budgets) {
          Cell cell;
          cell.scene = s;
          cell.label = method.label;
          cell.tags = method.tags;
          cell.estimator = find_estimator(method.estimator);
          PN_CHECK(cell.estimator != nullptr, "the config was checked");
          std::vector<ParamProblem> problems;
          cell.params = resolve_params(cell.estimator->params(), point.params, problems);
          PN_CHECK(problems.empty(), "the config was checked");
          cell.sampler = *parse_sampler_kind(point.sampler);
          cell.srl =
              point.srl.split ? point.srl : split_srl(point.srl.total(), cell.estimator->adaptive);
          cell.spp = point.spp;
          cell.budget_time = budget_time;
          if (config.budget && !config.budget->match) cell.budget_s = budget_time;
          finish_cell(config, scenes[s], cell);
          cells.push_back(std::move(cell));
        }
      }
    }
  }
  return cells;
}

RenderSettings render_settings(const Cell& cell, std::uint64_t seed, int threads) {
  RenderSettings settings;
  settings.estimator = cell.estimator;
  settings.params = cell.params;
  settings.budget = cell.budget();
  settings.spp = cell.spp;
  settings.seed = seed;
  settings.threads = threads;
  return settings;
}

std::uint64_t run_seed(const ExperimentConfig& config, const Cell& cell, int block) {
  return hash_texts({"run", std::to_string(config.seed), cell.id, std::to_string(block)});
}

void apply_plan(const std::vector<PlannedCell>& plan, std::vector<Cell>& cells) {
  for (Cell& cell : cells) {
    const auto planned = std::find_if(plan.begin(), plan.end(),
                                      [&](const PlannedCell& p) { return p.id == cell.id; });
    if (planned == plan.end()) {
      throw InputError("plan.lock.json has no cell \"" + cell.label + "\" (" + cell.id +
                       "): it belongs to another config; use another --out");
    }
    cell.spp = planned->spp;
    cell.srl = planned->srl;
    if (planned->budget_s) cell.budget_s = planned->budget_s;
  }
}

}  // namespace penumbra
