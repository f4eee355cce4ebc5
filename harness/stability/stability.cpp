#include "harness/stability/stability.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>

#include "harness/clocks.h"
#include "harness/progress.h"
#include "harness/stability/stability_cells.h"

namespace penumbra::stability {
namespace {

constexpr double kConfidence = 0.95;

/// Runs work(i) for each cell on all threads, with progress.
template <typename Work>
void for_each_cell(const std::vector<std::size_t>& cells, const std::string& title, Work work) {
  Progress progress(title, static_cast<double>(std::max<std::size_t>(1, cells.size())));
  std::mutex mutex;
  std::size_t done = 0;
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, cells.size(), 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          work(cells[i]);
          const std::lock_guard lock(mutex);
          progress.update(static_cast<double>(++done));
        }
      },
      tbb::simple_partitioner());
  progress.finish();
}

void set_bias(StabilityRow& row, const Measurement& m) {
  const EstimateStatistics& s = m.statistics;
  const Interval interval = s.mean_interval(kConfidence);
  row.bias = s.mean() - 1;
  row.bias_lo = interval.lo - 1;
  row.bias_hi = interval.hi - 1;
  row.rel_variance = s.variance();
  row.kurtosis = s.kurtosis();
  row.cost = s.mean_square_error() * row.cpu_s;
}

void set_slope(StabilityRow& row, const Cell& cell) {
  row.levels = cell.levels;
  // The error of what is never seen does not fall.
  if (!cell.main.statistics.has_mean()) return;
  std::vector<SlopePoint> points;
  for (const ErrorLevel& level : cell.levels) {
    points.push_back({static_cast<double>(level.srl), level.rel_mse, level.rel_mse_se});
  }
  const auto slope = fit_error_slope(points.data(), points.size(), kConfidence);
  if (!slope) return;
  row.slope = slope->value;
  row.slope_lo = slope->interval.lo;
  row.slope_hi = slope->interval.hi;
}

StabilityRow row_of(const Cell& cell) {
  const StabilityCase& c = *cell.built->source;
  const StabilityStep& step = cell.built->step;
  const EstimatorEntry& entry = *cell.method->entry;
  const Measurement& m = cell.main;
  StabilityRow row;
  row.case_name = c.name;
  row.ids = c.ids;
  row.parameter = c.parameter;
  row.step = cell.built->index;
  row.value = step.value;
  row.method = cell.method->label;
  row.estimator = entry.name;
  row.params = cell.method->params(step.params).differences(entry.params());
  row.declared_bias = cell.method->bias_reason;
  const Budget budget = split_budget(entry, srl_of(cell));
  row.srl = budget.srl();
  row.srl_initial = budget.srl_initial;
  row.srl_adaptive = budget.srl_adaptive;
  row.lights = static_cast<int>(step.scene->sampled_lights().size());
  row.exact = std::accumulate(step.exact.begin(), step.exact.end(), 0.0) /
              static_cast<double>(step.exact.size());
  row.estimates = m.counters.estimates;
  row.samples = m.counters.samples;
  row.rays = m.counters.rays;
  row.zeros = m.statistics.zeros();
  row.non_finite = m.non_finite + cell.other_non_finite;
  row.negative = m.negative + cell.other_negative;
  if (cell.repeated) {
    row.non_finite += cell.repeated->non_finite;
    row.negative += cell.repeated->negative;
  }
  row.uncovered = m.counters.uncovered;
  row.tolerance = tolerance_of(step.condition);
  row.cpu_s = m.cpu_s / static_cast<double>(std::max<std::uint64_t>(1, m.counters.estimates));
  const double mean = m.statistics.mean();
  row.largest_over_mean = mean > 0 ? m.statistics.largest() / mean : 0;
  if (!step.is_dark() && m.statistics.count() > 0) set_bias(row, m);
  set_slope(row, cell);
  row.replay = cell.replay;
  return row;
}

/// Tests, repeats what is significant, and judges all cells.
std::vector<StabilityRow> judged(std::vector<Cell>& cells, bool quick) {
  std::vector<Evidence> evidence;
  for (const Cell& cell : cells) evidence.push_back(evidence_of(cell, cell.main));
  const std::vector<std::size_t> suspects = significantly_biased(evidence, kLevel);
  for_each_cell(suspects, "repeating", [&](std::size_t i) { repeat_cell(cells[i], quick); });
  std::vector<Evidence> repeated;
  for (const std::size_t i : suspects)
    repeated.push_back(evidence_of(cells[i], *cells[i].repeated));
  std::vector<const Evidence*> confirmed(cells.size(), nullptr);
  for (const std::size_t s : significantly_biased(repeated, kConfirmLevel)) {
    confirmed[suspects[s]] = &repeated[s];
  }

  std::vector<StabilityRow> rows;
  std::vector<double> p;
  std::vector<std::size_t> tested;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    StabilityRow row = row_of(cells[i]);
    Judgement judgement = judge(evidence[i], confirmed[i]);
    row.verdict = judgement.verdict;
    row.reason = std::move(judgement.reason);
    row.p = bias_p(evidence[i]);
    if (row.p) {
      tested.push_back(i);
      p.push_back(*row.p);
    }
    if (cells[i].repeated) {
      const EstimateStatistics& s = cells[i].repeated->statistics;
      row.confirmed_bias = s.mean() - 1;
      row.confirmed_p = s.test(row.tolerance).p;
    }
    rows.push_back(std::move(row));
  }
  const std::vector<double> adjusted = holm_adjusted(p);
  for (std::size_t i = 0; i < tested.size(); ++i) rows[tested[i]].p_adjusted = adjusted[i];
  return rows;
}

void drop_refused(std::vector<Cell>& cells, std::vector<std::string>& left_out) {
  for (const Cell& cell : cells) {
    if (cell.refusal.empty()) continue;
    left_out.push_back(fmt::format("{} at {:g}, {}: {}", cell.built->source->name,
                                   cell.built->step.value, cell.method->label, cell.refusal));
  }
  std::erase_if(cells, [](const Cell& cell) { return !cell.refusal.empty(); });
}

}  // namespace

StabilityResult run_stability(const StabilityOptions& options) {
  const Stopwatch watch;
  StabilityResult result;
  result.quick = options.quick;
  const std::vector<Method> methods = stability_methods(options.estimators);
  for (const Method& method : methods) result.methods.push_back(method.label);
  for (const StabilityCase* c : options.cases) result.cases.emplace_back(c->name);
  tbb::task_arena arena(std::max(1, options.threads));
  arena.execute([&] {
    const std::vector<BuiltStep> steps = build_steps(options.cases, options.quick);
    result.build_s = watch.wall_s();
    std::vector<Cell> cells = cells_of(steps, methods);
    std::vector<std::size_t> all(cells.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    for_each_cell(all, "stability", [&](std::size_t i) { measure_cell(cells[i], options.quick); });
    drop_refused(cells, result.left_out);
    result.rows = judged(cells, options.quick);
  });
  result.wall_s = watch.wall_s();
  return result;
}

bool passed(const StabilityResult& result) {
  return std::all_of(result.rows.begin(), result.rows.end(), [](const StabilityRow& row) {
    if (row.non_finite > 0 || row.negative > 0) return false;
    return !row.declared_bias.empty() || row.verdict <= Verdict::Noisy;
  });
}

}  // namespace penumbra::stability
