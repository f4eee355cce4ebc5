#include "harness/efficiency.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <utility>

#include "harness/efficiency_marks.h"
#include "harness/metrics.h"
#include "harness/statistics.h"

namespace penumbra {
namespace {

/// What has been worked out of one cell.
struct Cell {
  MeasuredCell runs;
  EfficiencyRow row;
  double floor{0};
  bool comparable{false};  // has an efficiency
  bool has_times{true};    // its runs' times may be put together
};

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

std::optional<double> inverse_product(std::optional<double> cost, std::optional<double> error) {
  if (!cost || !error || *cost <= 0 || *error <= 0) return std::nullopt;
  return 1.0 / (*cost * *error);
}

std::optional<double> harmonic_p_eff(const Cell& cell) {
  Welford inverse;
  for (const auto& [block, run] : cell.runs.blocks) {
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
  const RunRow& first = cell.runs.first();
  cell.floor = first.reference_floor.value_or(0);
  Welford errors;
  Welford biases;
  for (const auto& [block, run] : cell.runs.blocks) {
    errors.add(*run->mse);
    biases.add(*run->mean_error);
  }
  row.err = errors.mean();
  if (const auto interval = mean_interval(errors, confidence, cell.floor)) {
    row.err_lo = interval->lo;
    row.err_hi = interval->hi;
  }
  row.relmse = cell.runs.mean_of(&RunRow::relmse);
  row.p_eff = harmonic_p_eff(cell);
  // mse_naive - mse is the variance of the reference, exactly (statistics.md 3.1).
  const std::optional<double> naive = cell.runs.mean_of(&RunRow::mse_naive);
  if (naive && *row.err > 0) row.reference_share = (*naive - *row.err) / *row.err;
  const double reference_se = first.reference_mean_se.value_or(0);
  if (first.reference_mean && std::isfinite(*first.reference_mean) && *first.reference_mean != 0) {
    row.bias_rel = biases.mean() / *first.reference_mean;
    if (const auto interval = mean_interval(biases, confidence, reference_se)) {
      const auto [lo, hi] =
          std::minmax({interval->lo / *first.reference_mean, interval->hi / *first.reference_mean});
      row.bias_rel_lo = lo;
      row.bias_rel_hi = hi;
    }
  }
  row.bias_p = zero_mean_p(biases, reference_se);
}

/// Root mean square error that the rounding of float pixels explains, as a share of the reference's
/// mean; sampling would take 1e12 estimates to come near.
constexpr double kRoundingError = 1e-6;

bool equals_reference(const Cell& cell) {
  const std::optional<double> naive = cell.runs.mean_of(&RunRow::mse_naive);
  const std::optional<double> mean = cell.runs.first().reference_mean;
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
  for (const auto& [block, run] : cell.runs.blocks) {
    blocks.push_back(
        {cell.has_times ? *run->time_wall_s : static_cast<double>(run->rays), *run->mse});
  }
  const EfficiencyEstimate estimate = log_efficiency(blocks, {confidence, cell.floor});
  if (!estimate.log) {
    if (estimate.reason == NoEstimate::BelowReferenceNoise) {
      row.verdict = Verdict::ReferenceLimited;
    }
    add_note(row, reason_text(estimate.reason));
    return;
  }
  cell.comparable = true;
  if (!estimate.log->interval) add_note(row, "one block: no interval");
  if (cell.has_times) {
    row.eff = std::exp(estimate.log->value);
    if (estimate.log->interval) {
      row.eff_lo = std::exp(estimate.log->interval->lo);
      row.eff_hi = std::exp(estimate.log->interval->hi);
    }
  }
  Welford rays;
  for (const auto& [block, run] : cell.runs.blocks) rays.add(static_cast<double>(run->rays));
  row.eff_cpu = inverse_product(row.time_cpu_s, row.err);
  row.eff_rays = inverse_product(rays.mean(), row.err);
  row.eff_instructions = inverse_product(cell.runs.mean_of(&RunRow::instructions), row.err);
}

void add_contamination(Cell& cell) {
  cell.row.n_contaminated = cell.runs.n_contaminated;
  if (cell.runs.contaminated_in_use == 0) return;
  add_note(cell.row, fmt::format("the times of {} of {} blocks are contaminated in every attempt",
                                 cell.runs.contaminated_in_use, cell.runs.blocks.size()));
}

void summarise(Cell& cell, const TableOptions& options) {
  EfficiencyRow& row = cell.row;
  row = identity_of(cell.runs.first(), options);
  row.n_blocks = static_cast<int>(cell.runs.blocks.size());
  add_contamination(cell);
  const std::string fault = fault_of(cell.runs);
  if (!fault.empty()) {
    row.verdict = Verdict::Failed;
    add_note(row, fault);
    return;
  }
  const std::string time_fault = time_fault_of(cell.runs);
  cell.has_times = time_fault.empty();
  if (cell.has_times) {
    row.time_wall_s = cell.runs.mean_of(&RunRow::time_wall_s);
    row.time_cpu_s = cell.runs.mean_of(&RunRow::time_cpu_s);
  } else {
    add_note(row, time_fault);
  }
  add_errors(cell, options.confidence);
  add_efficiency(cell, options.confidence);
}

/// A ratio of efficiencies, or why there is none.
struct Ratio {
  std::optional<double> value, lo, hi, log_se;
  std::int64_t blocks{0};
  std::string fault;
  int apart{0};  ///< blocks that are left out: the two runs' times are of different hosts
};

Ratio no_ratio(std::string why) {
  Ratio ratio;
  ratio.fault = std::move(why);
  return ratio;
}

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

/// What an efficiency is per.
enum class Currency { Cpu, Wall, Rays, Instructions };

bool is_time(Currency currency) { return currency == Currency::Cpu || currency == Currency::Wall; }

Currency primary_currency(const TableOptions& options) {
  return options.primary == PrimaryTime::Cpu ? Currency::Cpu : Currency::Wall;
}

std::optional<double> cost_of(const RunRow& run, Currency currency) {
  switch (currency) {
    case Currency::Cpu:
      return run.time_cpu_s;
    case Currency::Wall:
      return run.time_wall_s;
    case Currency::Rays:
      return static_cast<double>(run.rays);
    case Currency::Instructions:
      if (!run.instructions) return std::nullopt;
      return static_cast<double>(*run.instructions);
  }
  return std::nullopt;
}

Ratio ratio_of(const Cell& cell, const Cell& baseline, Currency currency,
               const TableOptions& options) {
  if (is_time(currency) && !cell.has_times) return {};
  if (&cell == &baseline) return {1.0, 1.0, 1.0, {}, cell.row.n_blocks, {}, 0};
  if (!baseline.comparable) {
    return no_ratio(fmt::format("baseline {} has no efficiency", baseline.row.label));
  }
  if (is_time(currency) &&
      !(baseline.has_times && has_comparable_times(cell.runs.first(), baseline.runs.first()))) {
    return no_ratio("times of several machines or numbers of threads");
  }
  std::vector<PairedCostError> blocks;
  int apart = 0;
  for (const auto& [block, run] : cell.runs.blocks) {
    const auto other = baseline.runs.blocks.find(block);
    if (other == baseline.runs.blocks.end()) continue;
    if (is_time(currency) && run->host != other->second->host) {
      ++apart;
      continue;
    }
    const std::optional<double> cost = cost_of(*run, currency);
    const std::optional<double> other_cost = cost_of(*other->second, currency);
    if (!cost || !other_cost) return no_ratio("a cost was not measured");
    blocks.push_back({{*cost, *run->mse}, {*other_cost, *other->second->mse}});
  }
  const EfficiencyEstimate estimate =
      log_efficiency_ratio(blocks, {options.confidence, cell.floor});
  if (!estimate.log) return no_ratio(std::string(reason_text(estimate.reason)));
  Ratio ratio;
  ratio.apart = apart;
  ratio.value = std::exp(estimate.log->value);
  ratio.blocks = static_cast<std::int64_t>(blocks.size());
  ratio.log_se = estimate.log->standard_error;
  if (estimate.log->interval) {
    ratio.lo = std::exp(estimate.log->interval->lo);
    ratio.hi = std::exp(estimate.log->interval->hi);
  }
  return ratio;
}

/// The baseline of a cell. A baseline that is swept is its own measure in each of its cells.
const Cell* baseline_of(const Cell& cell, const std::vector<Cell>& cells, const std::string& label,
                        const std::string& sampler, std::string& fault) {
  if (cell.row.label == label) return &cell;
  return find_baseline(cells, cell.row, label, sampler, fault);
}

void compare_with_published(EfficiencyRow& row) {
  if (!row.ratio_published || !row.ratio_lo || !row.ratio_hi) return;
  if (*row.ratio_published >= *row.ratio_lo && *row.ratio_published <= *row.ratio_hi) return;
  add_note(row, fmt::format("published {:.3g} lies outside [{:.3g}, {:.3g}]", *row.ratio_published,
                            *row.ratio_lo, *row.ratio_hi));
}

// Costs that are the same on any machine.
void add_ratios_of_work(EfficiencyRow& row, const Cell& cell, const Cell& baseline,
                        const TableOptions& options) {
  const Ratio rays = ratio_of(cell, baseline, Currency::Rays, options);
  row.ratio_rays = rays.value;
  row.ratio_rays_lo = rays.lo;
  row.ratio_rays_hi = rays.hi;
  if (!row.eff_instructions || !baseline.row.eff_instructions) return;
  const Ratio instructions = ratio_of(cell, baseline, Currency::Instructions, options);
  row.ratio_instructions = instructions.value;
  row.ratio_instructions_lo = instructions.lo;
  row.ratio_instructions_hi = instructions.hi;
}

void add_ratio(EfficiencyRow& row, const Cell& cell, const Cell& baseline,
               const TableOptions& options) {
  const Ratio ratio = ratio_of(cell, baseline, primary_currency(options), options);
  if (!ratio.fault.empty()) add_note(row, "ratio: " + ratio.fault);
  if (ratio.apart > 0) {
    add_note(row, fmt::format("ratio: {} blocks left out, measured on two hosts", ratio.apart));
  }
  add_ratios_of_work(row, cell, baseline, options);
  if (!ratio.value) return;
  row.ratio = ratio.value;
  row.ratio_lo = ratio.lo;
  row.ratio_hi = ratio.hi;
  row.ratio_blocks = ratio.blocks;
  row.log_ratio_se = ratio.log_se;
  if (ratio.log_se) row.detectable = detectable_effect(*ratio.log_se, ratio.blocks);
  const Ratio wall = ratio_of(cell, baseline, Currency::Wall, options);
  row.ratio_wall = wall.value;
  row.ratio_wall_lo = wall.lo;
  row.ratio_wall_hi = wall.hi;
}

void add_tuned_ratio(EfficiencyRow& row, const Cell& cell, const std::vector<Cell>& cells,
                     const TableOptions& options) {
  std::string fault;
  const Cell* const baseline = baseline_of(cell, cells, *options.tuned_baseline, "", fault);
  Ratio ratio;
  if (baseline) ratio = ratio_of(cell, *baseline, primary_currency(options), options);
  row.ratio_tuned = ratio.value;
  row.ratio_tuned_lo = ratio.lo;
  row.ratio_tuned_hi = ratio.hi;
  if (ratio.value) row.ratio_tuned_blocks = ratio.blocks;
  row.log_ratio_tuned_se = ratio.log_se;
  if (!ratio.fault.empty()) fault = ratio.fault;
  if (!fault.empty()) add_note(row, "ratio_tuned: " + fault);
}

/// The row of a cell with its ratios and verdict; the cells stay as they are.
EfficiencyRow compared(const Cell& cell, const std::vector<Cell>& cells,
                       const TableOptions& options) {
  EfficiencyRow row = cell.row;
  row.ratio_published = published_ratio(row, options);
  if (!cell.comparable) return row;
  std::string fault;
  const Cell* const baseline = baseline_of(cell, cells, options.baseline, row.sampler, fault);
  if (baseline) add_ratio(row, cell, *baseline, options);
  if (!fault.empty()) add_note(row, "ratio: " + fault);
  compare_with_published(row);
  if (row.label == options.baseline) {
    row.verdict = Verdict::Baseline;
  } else if (row.ratio_lo && *row.ratio_lo > 1) {
    row.verdict = Verdict::Better;
  } else if (row.ratio_hi && *row.ratio_hi < 1) {
    row.verdict = Verdict::Worse;
  }
  if (options.tuned_baseline) add_tuned_ratio(row, cell, cells, options);
  return row;
}

std::size_t rank_of(const std::string& name, const std::vector<std::string>& order) {
  return static_cast<std::size_t>(std::find(order.begin(), order.end(), name) - order.begin());
}

}  // namespace

std::vector<EfficiencyRow> efficiency_table(std::span<const RunRow> rows,
                                            const TableOptions& options) {
  if (rows.empty()) return {};
  std::vector<Cell> cells;
  for (MeasuredCell& runs : measured_cells(rows)) {
    cells.push_back({std::move(runs), {}, 0, false});
    summarise(cells.back(), options);
  }
  std::vector<EfficiencyRow> result;
  for (const Cell& cell : cells) result.push_back(compared(cell, cells, options));
  adjust_bias(result);
  mark_best(result, options.primary);
  // What is equal here keeps the order of cell_key.
  const auto place = [&](const EfficiencyRow& row) {
    return std::tuple(rank_of(row.scene, options.scenes), row.scene, row.budget_s, row.sampler,
                      rank_of(row.label, options.labels), row.label);
  };
  std::stable_sort(result.begin(), result.end(),
                   [&](const auto& left, const auto& right) { return place(left) < place(right); });
  return result;
}

}  // namespace penumbra
