#include "harness/curves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "harness/curve_fit.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

/// Cells of one method at several budgets, by increasing budget.
struct Family {
  std::vector<const MeasuredCell*> cells;
  std::vector<const MeasuredCell*> failed;
  CurveRow row;
  CurveData mse;
  CurveData relmse;  // no budgets where a run lacks it
  CurveData mse_by_spp;
  CurveData relmse_by_spp;  // no budgets, both, where points differ in more than SPP
};

/// Position on a curve: the budget or, without, the SPP.
double place_of(const MeasuredCell& cell) {
  const RunRow& run = cell.first();
  return run.budget_s.value_or(static_cast<double>(run.spp));
}

auto method_key(const RunRow& r) {
  return std::tuple(r.scene, r.sampler, r.label, r.estimator, r.params, r.population,
                    r.budget_s.has_value());
}

using CellList = std::vector<const MeasuredCell*>;

/// Whether every budget occurs once.
bool is_curve(const CellList& cells) {
  std::set<double> places;
  for (const MeasuredCell* cell : cells) {
    if (!places.insert(place_of(*cell)).second) return false;
  }
  return true;
}

template <class Key>
std::vector<CellList> split_by(const CellList& cells, const Key& key) {
  std::map<decltype(key(cells.front()->first())), CellList> groups;
  for (const MeasuredCell* cell : cells) groups[key(cell->first())].push_back(cell);
  std::vector<CellList> result;
  for (auto& [value, group] : groups) result.push_back(std::move(group));
  return result;
}

/// The curves of one method. Where budgets solve for SPP or for SRL, that number says nothing about
/// the curve and the other tells curves apart; rows do not say which it was, so the first way that
/// leaves one cell per budget is taken.
std::vector<CellList> curves_of(const CellList& cells) {
  const auto srl = [](const RunRow& r) { return std::tuple(r.srl, r.srl_initial); };
  const auto spp = [](const RunRow& r) { return r.spp; };
  const auto both = [](const RunRow& r) { return std::tuple(r.srl, r.srl_initial, r.spp); };
  if (!cells.front()->first().budget_s) return split_by(cells, srl);
  if (is_curve(cells)) return {cells};
  const std::vector<CellList> by_srl = split_by(cells, srl);
  if (std::all_of(by_srl.begin(), by_srl.end(), is_curve)) return by_srl;
  const std::vector<CellList> by_spp = split_by(cells, spp);
  if (std::all_of(by_spp.begin(), by_spp.end(), is_curve)) return by_spp;
  return split_by(cells, both);
}

/// Blocks that all cells have.
std::vector<int> common_blocks(const CellList& cells) {
  std::vector<int> blocks;
  for (const auto& [block, run] : cells.front()->blocks) {
    const bool everywhere = std::all_of(
        cells.begin(), cells.end(),
        [&wanted = block](const MeasuredCell* cell) { return cell->blocks.count(wanted) != 0; });
    if (everywhere) blocks.push_back(block);
  }
  return blocks;
}

/// @param abscissa  of a run
template <class Abscissa>
CurveData data_of(const CellList& cells, const std::vector<int>& blocks, const Abscissa& abscissa,
                  std::optional<double> RunRow::*error, double floor) {
  CurveData data;
  data.reference_floor = floor;
  for (const MeasuredCell* cell : cells) {
    BudgetRuns& runs = data.budgets.emplace_back();
    for (const int block : blocks) {
      const RunRow& run = *cell->blocks.at(block);
      if (!(run.*error) || !std::isfinite(*(run.*error))) return {};
      runs.times_s.push_back(abscissa(run));
      runs.errors.push_back(*(run.*error));
    }
  }
  return data;
}

void add_note(CurveRow& row, const std::string& text) {
  row.note += (row.note.empty() ? "" : "; ") + text;
}

template <class T>
std::optional<int> shared(const CellList& cells, T RunRow::*member) {
  const T value = cells.front()->first().*member;
  const bool same = std::all_of(cells.begin(), cells.end(), [&](const MeasuredCell* cell) {
    return cell->first().*member == value;
  });
  return same ? std::optional<int>(value) : std::nullopt;
}

/// Why a cell is no point of a curve; empty when it is.
std::string curve_fault(const MeasuredCell& cell) {
  const std::string fault = fault_of(cell);
  return fault.empty() ? time_fault_of(cell) : fault;
}

void describe(Family& family, const TableOptions& options) {
  CurveRow& row = family.row;
  const RunRow& run = family.cells.front()->first();
  row.scene = run.scene;
  row.label = run.label;
  row.estimator = run.estimator;
  row.sampler = run.sampler;
  row.params = run.params;
  row.population = run.population;
  row.srl = shared(family.cells, &RunRow::srl);
  row.srl_initial = shared(family.cells, &RunRow::srl_initial);
  row.srl_adaptive = shared(family.cells, &RunRow::srl_adaptive);
  row.spp = shared(family.cells, &RunRow::spp);
  row.baseline = options.baseline;
  row.n_points = static_cast<int>(family.cells.size());
  if (!family.failed.empty()) {
    add_note(row, fmt::format("{} budgets left out, the first because {}", family.failed.size(),
                              curve_fault(*family.failed.front())));
  }
}

/// Whether errors can be put over the SPP. Rows of early versions do not say the camera samples.
bool differ_in_spp_only(const Family& family) {
  return family.row.srl && family.row.srl_initial &&
         std::all_of(family.cells.begin(), family.cells.end(), [](const MeasuredCell* cell) {
           const RunRow& run = cell->first();
           return run.camera_samples >= 1 && run.spp >= run.camera_samples;
         });
}

/// Cells with a failed run or without a time apart, the others in order of their realised time.
Family family_of(const CellList& cells, const TableOptions& options) {
  Family family;
  for (const MeasuredCell* cell : cells) {
    (curve_fault(*cell).empty() ? family.cells : family.failed).push_back(cell);
  }
  if (family.cells.size() < 2) return family;
  const auto time =
      options.primary == PrimaryTime::Cpu ? &RunRow::time_cpu_s : &RunRow::time_wall_s;
  std::sort(family.cells.begin(), family.cells.end(),
            [&](const auto* a, const auto* b) { return *a->mean_of(time) < *b->mean_of(time); });
  describe(family, options);
  const std::vector<int> blocks = common_blocks(family.cells);
  family.row.n_blocks = static_cast<int>(blocks.size());
  if (blocks.empty()) {
    add_note(family.row, "no block has all budgets");
    return family;
  }
  const double floor = family.cells.front()->first().reference_floor.value_or(0);
  const auto time_of = [&](const RunRow& run) { return primary_time(run, options.primary); };
  family.mse = data_of(family.cells, blocks, time_of, &RunRow::mse, floor);
  family.relmse = data_of(family.cells, blocks, time_of, &RunRow::relmse, 0);
  if (differ_in_spp_only(family)) {
    const auto spp_of = [](const RunRow& run) {
      return effective_spp(run.spp, run.camera_samples);
    };
    family.mse_by_spp = data_of(family.cells, blocks, spp_of, &RunRow::mse, floor);
    family.relmse_by_spp = data_of(family.cells, blocks, spp_of, &RunRow::relmse, 0);
  }
  const std::vector<CurvePoint> points = points_of(family.mse, blocks.size());
  family.row.time_min_s = points.front().time_s;
  family.row.time_max_s = points.back().time_s;
  return family;
}

/// The time at which errors of a scene are compared: the largest budget or, without budgets, what
/// all of its curves reach.
double common_time(const std::vector<Family>& families, const std::string& scene) {
  std::optional<double> budget;
  double reached = std::numeric_limits<double>::infinity();
  for (const Family& family : families) {
    if (family.row.scene != scene) continue;
    reached = std::min(reached, family.row.time_max_s);
    for (const MeasuredCell* cell : family.cells) {
      if (cell->first().budget_s) budget = std::max(budget.value_or(0), *cell->first().budget_s);
    }
  }
  return budget.value_or(reached);
}

const Family* baseline_of(const Family& family, const std::vector<Family>& families,
                          const TableOptions& options) {
  if (family.row.label == options.baseline) return &family;
  std::vector<const Family*> found;
  for (const Family& other : families) {
    if (other.row.label == options.baseline && other.row.scene == family.row.scene &&
        other.row.sampler == family.row.sampler && !other.mse.budgets.empty()) {
      found.push_back(&other);
    }
  }
  if (found.size() > 1) {
    std::erase_if(found, [&](const Family* other) {
      return other->row.srl != family.row.srl || other->row.spp != family.row.spp;
    });
  }
  return found.size() == 1 ? found[0] : nullptr;
}

void put(const FitEstimate& fit, std::optional<double>& value, std::optional<double>& lo,
         std::optional<double>& hi) {
  value = fit.value;
  if (!fit.interval) return;
  lo = fit.interval->lo;
  hi = fit.interval->hi;
}

/// The same blocks of two curves, as far as both have them.
std::pair<CurveData, CurveData> paired(const Family& a, const Family& b, bool relative,
                                       PrimaryTime primary) {
  CellList all = a.cells;
  all.insert(all.end(), b.cells.begin(), b.cells.end());
  const std::vector<int> blocks = common_blocks(all);
  if (blocks.empty()) return {};
  const auto error = relative ? &RunRow::relmse : &RunRow::mse;
  const auto time_of = [&](const RunRow& run) { return primary_time(run, primary); };
  return {data_of(a.cells, blocks, time_of, error, 0), data_of(b.cells, blocks, time_of, error, 0)};
}

void add_target(MetricCurve& curve, const Family& family, const Family& baseline, bool relative,
                const TableOptions& options) {
  const auto [method, base] = paired(family, baseline, relative, options.primary);
  if (method.budgets.empty() || base.budgets.empty()) return;
  const auto fit = fit_target(method, base, options.confidence);
  if (!fit) return;
  curve.target = fit->target;
  put(fit->time_s, curve.time_s, curve.time_lo_s, curve.time_hi_s);
  curve.speedup = std::exp(fit->log_speedup.value);
  if (!fit->log_speedup.interval) return;
  curve.speedup_lo = std::exp(fit->log_speedup.interval->lo);
  curve.speedup_hi = std::exp(fit->log_speedup.interval->hi);
}

MetricCurve metric_curve(const CurveData& data, const CurveData& by_spp, double at_s,
                         double confidence) {
  MetricCurve curve;
  if (data.budgets.empty()) return curve;
  if (const auto slope = fit_slope(data, confidence)) {
    put(slope->slope, curve.slope, curve.slope_lo, curve.slope_hi);
    curve.slope_p = slope->p_minus_1;
  }
  if (const auto order = fit_slope(by_spp, confidence)) {
    put(order->slope, curve.order, curve.order_lo, curve.order_hi);
    curve.order_p = order->p_minus_1;
  }
  if (const auto floor = fit_floor(data, confidence)) {
    curve.decay = floor->a;
    curve.floor = floor->floor;
    if (floor->interval) {
      curve.floor_lo = floor->interval->lo;
      curve.floor_hi = floor->interval->hi;
    }
  }
  if (const auto at = fitted_error_at(data, at_s, confidence)) {
    put(*at, curve.at, curve.at_lo, curve.at_hi);
  }
  return curve;
}

CurveRow fitted(const Family& family, const std::vector<Family>& families,
                const TableOptions& options) {
  CurveRow row = family.row;
  row.at_s = common_time(families, row.scene);
  row.mse = metric_curve(family.mse, family.mse_by_spp, row.at_s, options.confidence);
  row.relmse = metric_curve(family.relmse, family.relmse_by_spp, row.at_s, options.confidence);
  if (!row.mse.slope && row.n_blocks > 0)
    add_note(row, "no slope: an error is below reference noise");
  if (row.n_blocks == 1) add_note(row, "one block: no intervals");
  const Family* const baseline = baseline_of(family, families, options);
  if (!baseline) {
    add_note(row, fmt::format("no single curve of baseline {} to compare with", options.baseline));
    return row;
  }
  add_target(row.mse, family, *baseline, false, options);
  add_target(row.relmse, family, *baseline, true, options);
  return row;
}

CurvePointRow point_row(const MeasuredCell& cell, int curve, const TableOptions& options) {
  const RunRow& run = cell.first();
  CurvePointRow row;
  row.curve = curve;
  row.scene = run.scene;
  row.label = run.label;
  row.sampler = run.sampler;
  row.params = run.params;
  row.budget_s = run.budget_s;
  row.spp = run.spp;
  row.srl = run.srl;
  row.srl_initial = run.srl_initial;
  row.srl_adaptive = run.srl_adaptive;
  row.n_blocks = static_cast<int>(cell.blocks.size());
  row.time_wall_s = cell.mean_of(&RunRow::time_wall_s);
  row.time_cpu_s = cell.mean_of(&RunRow::time_cpu_s);
  row.time_s = options.primary == PrimaryTime::Cpu ? *row.time_cpu_s : *row.time_wall_s;
  Welford errors, relative, inverse_pixels;
  for (const auto& [block, r] : cell.blocks) {
    errors.add(*r->mse);
    if (r->relmse) relative.add(*r->relmse);
    if (r->p_eff) inverse_pixels.add(1 / *r->p_eff);
  }
  row.err = errors.mean();
  if (const auto i = mean_interval(errors, options.confidence, run.reference_floor.value_or(0))) {
    row.err_lo = i->lo;
    row.err_hi = i->hi;
  }
  if (inverse_pixels.count() == cell.blocks.size()) row.p_eff = 1 / inverse_pixels.mean();
  if (relative.count() != cell.blocks.size()) return row;
  row.relmse = relative.mean();
  if (const auto i = mean_interval(relative, options.confidence)) {
    row.relmse_lo = i->lo;
    row.relmse_hi = i->hi;
  }
  return row;
}

std::size_t rank_of(const std::string& name, const std::vector<std::string>& order) {
  return static_cast<std::size_t>(std::find(order.begin(), order.end(), name) - order.begin());
}

}  // namespace

double effective_spp(int spp, int camera_samples) {
  PN_CHECK(camera_samples >= 1 && spp >= camera_samples, "every camera sample has an estimate");
  const int least = spp / camera_samples;
  const int with_one_more = spp % camera_samples;
  const double inverse_sum = static_cast<double>(with_one_more) / (least + 1) +
                             static_cast<double>(camera_samples - with_one_more) / least;
  return static_cast<double>(camera_samples) * camera_samples / inverse_sum;
}

Curves error_curves(std::span<const RunRow> rows, const TableOptions& options) {
  Curves result;
  if (rows.empty()) return result;
  const std::vector<MeasuredCell> cells = measured_cells(rows);
  std::map<decltype(method_key(rows[0])), CellList> methods;
  for (const MeasuredCell& cell : cells) methods[method_key(cell.first())].push_back(&cell);
  std::vector<Family> families;
  for (const auto& [key, list] : methods) {
    for (const CellList& curve : curves_of(list)) {
      Family family = family_of(curve, options);
      if (family.cells.size() >= 2) families.push_back(std::move(family));
    }
  }
  const auto place = [&](const Family& f) {
    return std::tuple(rank_of(f.row.scene, options.scenes), f.row.scene, f.row.sampler,
                      rank_of(f.row.label, options.labels), f.row.label);
  };
  std::stable_sort(families.begin(), families.end(),
                   [&](const auto& a, const auto& b) { return place(a) < place(b); });
  for (Family& family : families) {
    family.row.curve = static_cast<int>(result.rows.size()) + 1;
    result.rows.push_back(fitted(family, families, options));
    for (const MeasuredCell* cell : family.cells) {
      result.points.push_back(point_row(*cell, family.row.curve, options));
    }
  }
  return result;
}

}  // namespace penumbra
