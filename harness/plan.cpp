#include "harness/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/keys.h"
#include "harness/progress.h"
#include "harness/reference.h"
#include "harness/render.h"
#include "harness/statistics.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

// Every combination of a method's parameter axes, in the order of the axes' names.
std::vector<ParamSet::Map> combinations(
    const std::map<std::string, std::vector<ParamValue>>& axes) {
  std::vector<ParamSet::Map> result(1);
  for (const auto& [name, values] : axes) {
    std::vector<ParamSet::Map> grown;
    for (const ParamSet::Map& partial : result) {
      for (const ParamValue& value : values) {
        grown.push_back(partial);
        grown.back()[name] = value;
      }
    }
    result = std::move(grown);
  }
  return result;
}

std::vector<SamplerKind> samplers_of(const ExperimentConfig& config, const MethodConfig& method) {
  std::vector<SamplerKind> kinds;
  if (method.sampler) {
    kinds.push_back(*parse_sampler_kind(*method.sampler));
    return kinds;
  }
  for (const std::string& name : config.samplers) kinds.push_back(*parse_sampler_kind(name));
  return kinds;
}

void finish_cell(const ExperimentConfig& config, const LoadedScene& scene, Cell& cell) {
  cell.params_text = cell.params.differences(cell.estimator->params());
  cell.spp = config.spp;
  if (config.budget) cell.budget_s = config.budget->time_cpu_s;
  const std::string numbers = fmt::format(
      "{} {} {} {}", cell.srl.text(), cell.budget_s.value_or(0.0),
      config.budget && config.budget->solve_for == SolveFor::Srl ? "srl" : "spp", config.spp);
  cell.id = hash_id({"cell", scene.config->name, reference_id(scene), cell.label,
                     cell.estimator->name, cell.params_text, to_string(cell.sampler), numbers});
  // Refused combinations are found before anything runs.
  cell.estimator->create(*scene.scene, cell.params, cell.budget());
}

// The number that a budget solves for, set to n.
Cell with_units(const ExperimentConfig& config, Cell cell, int n) {
  if (config.budget && config.budget->solve_for == SolveFor::Srl) {
    cell.srl = split_srl(n, cell.estimator->adaptive);
  } else {
    cell.spp = n;
  }
  return cell;
}

struct PilotLevels {
  int low{1}, high{2};
};

PilotLevels levels_of(const ExperimentConfig& config, const LoadedScene& scene, const Cell& cell) {
  if (config.budget && config.budget->solve_for == SolveFor::Srl) {
    const int low = std::max(cell.estimator->min_srl, cell.estimator->adaptive ? 8 : 4);
    return {low, 3 * low};
  }
  const int low = scene.points.camera_samples;
  return {low, 3 * low};
}

PlannedCell solve(const ExperimentConfig& config, const LoadedScene& scene, const Cell& cell,
                  const PilotLevels& levels, const std::vector<double>& low,
                  const std::vector<double>& high) {
  const std::optional<TimeFit> fit =
      fit_time({static_cast<double>(levels.low), low}, {static_cast<double>(levels.high), high});
  if (!fit) {
    throw RunError("pilot of \"" + cell.label +
                   "\": times do not grow with the work; the machine is too noisy");
  }
  const std::int64_t n = samples_for_time(*fit, config.budget->time_cpu_s).value_or(0);
  const bool solve_srl = config.budget->solve_for == SolveFor::Srl;
  const int least = solve_srl ? levels.low : scene.points.camera_samples;
  if (n < least) {
    throw InputError(
        fmt::format("budget of {} s is too small for \"{}\" on scene \"{}\": it pays for {} {}, {} "
                    "are the least "
                    "(about {:.2g} s)",
                    config.budget->time_cpu_s, cell.label, scene.config->name, n,
                    solve_srl ? "shadow rays per light" : "estimates per pixel", least,
                    fit->fixed_s + fit->per_sample_s * least));
  }
  const Cell solved = with_units(config, cell, static_cast<int>(n));
  return {cell.id,           solved.spp,
          solved.srl,        fit->fixed_s,
          fit->per_sample_s, fit->fixed_s + fit->per_sample_s * static_cast<double>(n)};
}

}  // namespace

Srl split_srl(int total, bool adaptive) {
  if (!adaptive) return {total, 0, false};
  const int initial = std::max(2, (total + 2) / 4);
  return {initial, total - initial, true};
}

std::vector<Cell> expand_cells(const ExperimentConfig& config,
                               const std::vector<LoadedScene>& scenes) {
  std::vector<Cell> cells;
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    for (const MethodConfig& method : config.methods) {
      for (const SamplerKind sampler : samplers_of(config, method)) {
        for (const Srl& srl : method.srl) {
          for (const ParamSet::Map& values : combinations(method.params)) {
            Cell cell;
            cell.scene = s;
            cell.label = method.label;
            cell.estimator = find_estimator(method.estimator);
            PN_CHECK(cell.estimator != nullptr, "the config was checked");
            std::vector<ParamProblem> problems;
            cell.params = resolve_params(cell.estimator->params(), values, problems);
            PN_CHECK(problems.empty(), "the config was checked");
            cell.sampler = sampler;
            cell.srl = srl.split ? srl : split_srl(srl.total(), cell.estimator->adaptive);
            finish_cell(config, scenes[s], cell);
            cells.push_back(std::move(cell));
          }
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

std::vector<PlannedCell> run_pilots(const ExperimentConfig& config,
                                    const std::vector<LoadedScene>& scenes,
                                    const std::vector<Cell>& cells) {
  const int threads = resolve_threads(config.threads);
  const int pilots = config.budget ? config.budget->pilots : 1;
  std::vector<std::vector<double>> low(cells.size());
  std::vector<std::vector<double>> high(cells.size());
  Progress progress("pilots", pilots * static_cast<double>(cells.size()));
  const auto measure = [&](std::size_t c, int n, int round) {
    const Cell cell = config.budget ? with_units(config, cells[c], n) : cells[c];
    const std::uint64_t seed =
        hash_texts({"pilot", cell.id, std::to_string(n), std::to_string(round)});
    return render(*scenes[cell.scene].scene, scenes[cell.scene].points,
                  render_settings(cell, seed, threads))
        .time_cpu_s;
  };
  if (config.budget && !cells.empty()) {
    // One discarded run warms caches and thread pool.
    measure(0, levels_of(config, scenes[cells[0].scene], cells[0]).low, -1);
  }
  for (int round = 0; round < pilots; ++round) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      // A B ... B A: every other round runs backwards, so that drift hits all cells alike.
      const std::size_t c = round % 2 == 0 ? i : cells.size() - 1 - i;
      const PilotLevels levels = levels_of(config, scenes[cells[c].scene], cells[c]);
      low[c].push_back(measure(c, levels.low, round));
      if (config.budget) high[c].push_back(measure(c, levels.high, round));
      progress.update(static_cast<double>(round) * static_cast<double>(cells.size()) +
                          static_cast<double>(i) + 1.0,
                      cells[c].label);
    }
  }
  progress.finish();
  std::vector<PlannedCell> plan;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const LoadedScene& scene = scenes[cells[c].scene];
    if (config.budget) {
      plan.push_back(
          solve(config, scene, cells[c], levels_of(config, scene, cells[c]), low[c], high[c]));
    } else {
      plan.push_back(
          {cells[c].id, cells[c].spp, cells[c].srl, 0.0, low[c][0] / cells[c].spp, low[c][0]});
    }
  }
  return plan;
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
  }
}

}  // namespace penumbra
