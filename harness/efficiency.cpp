#include "harness/efficiency.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>

#include "harness/metrics.h"
#include "harness/statistics.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

/// Runs of one cell and what has been worked out of them.
struct Cell {
  std::map<int, const RunRow*> blocks;
  EfficiencyRow row;
  double floor{0};
  bool comparable{false};  // has an efficiency
};

auto key_of(const RunRow& r) {
  return std::tie(r.scene, r.budget_s, r.sampler, r.label, r.estimator, r.srl, r.srl_initial,
                  r.srl_adaptive, r.population, r.spp, r.params);
}

void check_reference(std::map<std::string, std::string>& references, const RunRow& row) {
  if (row.reference_id.empty()) return;
  const auto [place, added] = references.emplace(row.scene, row.reference_id);
  if (added || place->second == row.reference_id) return;
  throw ReferenceError(
      fmt::format("scene \"{}\": run {} was measured against reference {}, others against {}; "
                  "measure them again",
                  row.scene, row.run_id, row.reference_id, place->second));
}

EfficiencyRow identity_of(const RunRow& run, const TableOptions& options) {
  EfficiencyRow row;
  row.scene = run.scene;
  row.geometry = run.geometry;
  row.label = run.label;
  row.estimator = run.estimator;
  row.spp = run.spp;
  row.srl = run.srl;
  row.srl_initial = run.srl_initial;
  row.srl_adaptive = run.srl_adaptive;
  row.population = run.population;
  row.sampler = run.sampler;
  row.params = run.params;
  row.budget_s = run.budget_s;
  row.baseline = options.baseline;
  return row;
}

std::vector<Cell> group_cells(std::span<const RunRow> rows, const TableOptions& options) {
  std::map<decltype(key_of(rows[0])), Cell> cells;
  std::map<std::string, std::string> references;
  for (const RunRow& run : rows) {
    check_reference(references, run);
    Cell& cell = cells[key_of(run)];
    if (cell.blocks.empty()) cell.row = identity_of(run, options);
    const auto [place, added] = cell.blocks.emplace(run.block, &run);
    if (!added) {
      throw InputError(
          fmt::format("scene \"{}\", \"{}\": block {} was measured twice, as {} and {}", run.scene,
                      run.label, run.block, place->second->run_id, run.run_id));
    }
  }
  std::vector<Cell> result;
  for (auto& [key, cell] : cells) result.push_back(std::move(cell));
  return result;
}

bool is_number(const std::optional<double>& value) { return value && std::isfinite(*value); }

/// @return why the run cannot be used; empty when it can
std::string fault_of(const RunRow& run) {
  if (run.status == RunStatus::Failed) return run.failure.empty() ? "failed" : run.failure;
  if (run.nonfinite > 0) return fmt::format("{} pixels not finite", run.nonfinite);
  if (!is_number(run.mse) || !is_number(run.mean_error)) return "no finite error";
  if (!is_number(run.time_wall_s) || !is_number(run.time_cpu_s)) return "no time";
  return {};
}

/// Mean of a column over blocks. @return empty when a block lacks it
template <class T>
std::optional<double> mean_of(const Cell& cell, std::optional<T> RunRow::*member) {
  Welford values;
  for (const auto& [block, run] : cell.blocks) {
    if (!(run->*member)) return std::nullopt;
    values.add(static_cast<double>(*(run->*member)));
  }
  return values.mean();
}

std::optional<double> inverse_product(std::optional<double> cost, std::optional<double> error) {
  if (!cost || !error || *cost <= 0 || *error <= 0) return std::nullopt;
  return 1.0 / (*cost * *error);
}

std::optional<double> harmonic_p_eff(const Cell& cell) {
  Welford inverse;
  for (const auto& [block, run] : cell.blocks) {
    if (!run->p_eff) return std::nullopt;
    inverse.add(1.0 / *run->p_eff);
  }
  return 1.0 / inverse.mean();
}

void add_note(EfficiencyRow& row, std::string_view text) {
  if (!row.note.empty()) row.note += "; ";
  row.note += text;
}

void add_errors(Cell& cell, double confidence) {
  EfficiencyRow& row = cell.row;
  const RunRow& first = *cell.blocks.begin()->second;
  cell.floor = first.reference_floor.value_or(0);
  Welford errors;
  Welford biases;
  for (const auto& [block, run] : cell.blocks) {
    errors.add(*run->mse);
    biases.add(*run->mean_error);
  }
  row.err = errors.mean();
  if (const auto interval = mean_interval(errors, confidence, cell.floor)) {
    row.err_lo = interval->lo;
    row.err_hi = interval->hi;
  }
  row.relmse = mean_of(cell, &RunRow::relmse);
  row.p_eff = harmonic_p_eff(cell);
  // mse_naive - mse is the variance of the reference, exactly (statistics.md 3.1).
  const std::optional<double> naive = mean_of(cell, &RunRow::mse_naive);
  if (naive && *row.err > 0) row.reference_share = (*naive - *row.err) / *row.err;
  if (is_number(first.reference_mean) && *first.reference_mean != 0) {
    row.bias_rel = biases.mean() / *first.reference_mean;
  }
  row.bias_p = zero_mean_p(biases, first.reference_mean_se.value_or(0));
}

/// Root mean square error that the rounding of float pixels explains, as a share of the reference's
/// mean; sampling would take 1e12 estimates to come near.
constexpr double kRoundingError = 1e-6;

bool equals_reference(const Cell& cell) {
  const std::optional<double> naive = mean_of(cell, &RunRow::mse_naive);
  const std::optional<double> mean = cell.blocks.begin()->second->reference_mean;
  return naive && mean && std::sqrt(*naive) <= kRoundingError * std::abs(*mean);
}

void add_efficiency(Cell& cell, double confidence) {
  EfficiencyRow& row = cell.row;
  if (equals_reference(cell)) {
    row.verdict = Verdict::Exact;
    add_note(row, "exact: equal to the reference, nothing to compare");
    return;
  }
  if (row.reference_share.value_or(0) > kShareToRefuse) {
    row.verdict = Verdict::ReferenceLimited;
    add_note(row, "more than half of the error is the reference's");
    return;
  }
  std::vector<CostError> blocks;
  for (const auto& [block, run] : cell.blocks) blocks.push_back({*run->time_wall_s, *run->mse});
  const EfficiencyEstimate estimate = log_efficiency(blocks, {confidence, cell.floor});
  if (!estimate.log) {
    if (estimate.reason == NoEstimate::BelowReferenceNoise) {
      row.verdict = Verdict::ReferenceLimited;
    }
    add_note(row, reason_text(estimate.reason));
    return;
  }
  cell.comparable = true;
  row.eff = std::exp(estimate.log->value);
  if (estimate.log->interval) {
    row.eff_lo = std::exp(estimate.log->interval->lo);
    row.eff_hi = std::exp(estimate.log->interval->hi);
  } else {
    add_note(row, "one block: no interval");
  }
  Welford rays;
  for (const auto& [block, run] : cell.blocks) rays.add(static_cast<double>(run->rays));
  row.eff_cpu = inverse_product(row.time_cpu_s, row.err);
  row.eff_rays = inverse_product(rays.mean(), row.err);
  row.eff_instructions = inverse_product(mean_of(cell, &RunRow::instructions), row.err);
}

void summarise(Cell& cell, double confidence) {
  EfficiencyRow& row = cell.row;
  row.n_blocks = static_cast<int>(cell.blocks.size());
  int faults = 0;
  std::string first_fault;
  for (const auto& [block, run] : cell.blocks) {
    const std::string fault = fault_of(*run);
    if (fault.empty()) continue;
    if (faults++ == 0) first_fault = fmt::format("run {}: {}", run->run_id, fault);
  }
  if (faults > 0) {
    row.verdict = Verdict::Failed;
    add_note(row, fmt::format("{} of {} runs failed, {}", faults, row.n_blocks, first_fault));
    return;
  }
  row.time_wall_s = mean_of(cell, &RunRow::time_wall_s);
  row.time_cpu_s = mean_of(cell, &RunRow::time_cpu_s);
  add_errors(cell, confidence);
  add_efficiency(cell, confidence);
}

struct Ratio {
  std::optional<double> value, lo, hi;
  std::string fault;
};

/// The cell with that label to compare with. @param sampler  empty: any
/// @return nullptr, and why in `fault`
const Cell* find_baseline(const std::vector<Cell>& cells, const EfficiencyRow& row,
                          const std::string& label, const std::string& sampler,
                          std::string& fault) {
  std::vector<const Cell*> found;
  for (const Cell& cell : cells) {
    if (cell.row.label != label || cell.row.scene != row.scene) continue;
    if (cell.row.budget_s != row.budget_s) continue;
    if (sampler.empty() || cell.row.sampler == sampler) found.push_back(&cell);
  }
  const bool narrowed = found.size() > 1;
  if (narrowed) {
    std::erase_if(found, [&](const Cell* cell) {
      return cell->row.srl != row.srl || cell->row.spp != row.spp;
    });
  }
  if (found.size() == 1) return found[0];
  fault = fmt::format("{} cells of baseline {} match{}", found.size(), label,
                      narrowed ? " in SRL and SPP" : "");
  return nullptr;
}

CostError cost_error(const RunRow& run, PrimaryTime primary) {
  return {primary == PrimaryTime::Cpu ? *run.time_cpu_s : *run.time_wall_s, *run.mse};
}

Ratio ratio_of(const Cell& cell, const Cell& baseline, const TableOptions& options) {
  if (&cell == &baseline) return {1.0, 1.0, 1.0, {}};
  if (!baseline.comparable) {
    return {{}, {}, {}, fmt::format("baseline {} has no efficiency", baseline.row.label)};
  }
  std::vector<PairedCostError> blocks;
  for (const auto& [block, run] : cell.blocks) {
    const auto other = baseline.blocks.find(block);
    if (other == baseline.blocks.end()) continue;
    blocks.push_back(
        {cost_error(*run, options.primary), cost_error(*other->second, options.primary)});
  }
  const EfficiencyEstimate estimate =
      log_efficiency_ratio(blocks, {options.confidence, cell.floor});
  if (!estimate.log) return {{}, {}, {}, std::string(reason_text(estimate.reason))};
  Ratio ratio{std::exp(estimate.log->value), {}, {}, {}};
  if (estimate.log->interval) {
    ratio.lo = std::exp(estimate.log->interval->lo);
    ratio.hi = std::exp(estimate.log->interval->hi);
  }
  return ratio;
}

Ratio compare(const Cell& cell, const std::vector<Cell>& cells, const std::string& label,
              const std::string& sampler, const TableOptions& options) {
  // A baseline that is swept is its own measure in each of its cells.
  if (cell.row.label == label) return ratio_of(cell, cell, options);
  Ratio none;
  const Cell* const baseline = find_baseline(cells, cell.row, label, sampler, none.fault);
  return baseline ? ratio_of(cell, *baseline, options) : none;
}

std::optional<double> published_efficiency(const TableOptions& options, const std::string& label,
                                           const std::string& scene) {
  const auto method = options.published.find(label);
  if (method == options.published.end()) return std::nullopt;
  const auto found = method->second.find(scene);
  return found == method->second.end() ? std::nullopt : std::optional(found->second);
}

std::optional<double> published_ratio(const EfficiencyRow& row, const TableOptions& options) {
  const auto own = published_efficiency(options, row.label, row.scene);
  const auto baseline = published_efficiency(options, options.baseline, row.scene);
  if (!own || !baseline) return std::nullopt;
  return *own / *baseline;
}

void compare_with_published(EfficiencyRow& row) {
  if (!row.ratio_published || !row.ratio_lo || !row.ratio_hi) return;
  if (*row.ratio_published >= *row.ratio_lo && *row.ratio_published <= *row.ratio_hi) return;
  add_note(row, fmt::format("published {:.3g} lies outside [{:.3g}, {:.3g}]", *row.ratio_published,
                            *row.ratio_lo, *row.ratio_hi));
}

/// The row of a cell with its ratios and verdict; the cells stay as they are.
EfficiencyRow compared(const Cell& cell, const std::vector<Cell>& cells,
                       const TableOptions& options) {
  EfficiencyRow row = cell.row;
  row.ratio_published = published_ratio(row, options);
  if (!cell.comparable) return row;
  const Ratio plain = compare(cell, cells, options.baseline, row.sampler, options);
  row.ratio = plain.value;
  row.ratio_lo = plain.lo;
  row.ratio_hi = plain.hi;
  if (!plain.fault.empty()) add_note(row, "ratio: " + plain.fault);
  compare_with_published(row);
  if (row.label == options.baseline) {
    row.verdict = Verdict::Baseline;
  } else if (plain.lo && *plain.lo > 1) {
    row.verdict = Verdict::Better;
  } else if (plain.hi && *plain.hi < 1) {
    row.verdict = Verdict::Worse;
  }
  if (!options.tuned_baseline) return row;
  const Ratio tuned = compare(cell, cells, *options.tuned_baseline, "", options);
  row.ratio_tuned = tuned.value;
  row.ratio_tuned_lo = tuned.lo;
  row.ratio_tuned_hi = tuned.hi;
  if (!tuned.fault.empty()) add_note(row, "ratio_tuned: " + tuned.fault);
  return row;
}

std::size_t rank_of(const std::string& name, const std::vector<std::string>& order) {
  return static_cast<std::size_t>(std::find(order.begin(), order.end(), name) - order.begin());
}

}  // namespace

std::vector<EfficiencyRow> efficiency_table(std::span<const RunRow> rows,
                                            const TableOptions& options) {
  if (rows.empty()) return {};
  std::vector<Cell> cells = group_cells(rows, options);
  for (Cell& cell : cells) summarise(cell, options.confidence);
  std::vector<EfficiencyRow> result;
  for (const Cell& cell : cells) result.push_back(compared(cell, cells, options));
  // What is equal here keeps the order of key_of.
  const auto place = [&](const EfficiencyRow& row) {
    return std::tuple(rank_of(row.scene, options.scenes), row.scene, row.budget_s, row.sampler,
                      rank_of(row.label, options.labels), row.label);
  };
  std::stable_sort(result.begin(), result.end(),
                   [&](const auto& left, const auto& right) { return place(left) < place(right); });
  return result;
}

}  // namespace penumbra
