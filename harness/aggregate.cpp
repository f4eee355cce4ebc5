#include "harness/aggregate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "harness/statistics.h"

namespace penumbra {
namespace {

using RowList = std::vector<const EfficiencyRow*>;

/// One scene's ratio to the baseline that is meant.
struct SceneRatio {
  std::string scene;
  std::optional<double> value, lo, hi, log_se;
  std::optional<std::int64_t> blocks;
};

SceneRatio ratio_of(const EfficiencyRow& row, bool tuned) {
  if (tuned) {
    return {row.scene,          row.ratio_tuned,        row.ratio_tuned_lo,
            row.ratio_tuned_hi, row.log_ratio_tuned_se, row.ratio_tuned_blocks};
  }
  return {row.scene, row.ratio, row.ratio_lo, row.ratio_hi, row.log_ratio_se, row.ratio_blocks};
}

/// A method across scenes. The SRL and SPP that budgets solve for differ from scene to scene.
struct Method {
  RowList rows;  // one per scene
  std::optional<int> srl, spp;
};

double place_of(const EfficiencyRow& row) {
  return row.budget_s.value_or(static_cast<double>(row.spp));
}

auto method_key(const EfficiencyRow& r) { return std::tuple(r.label, r.sampler, r.params); }

/// Those at the largest budget of each scene.
RowList at_largest_budget(const RowList& rows) {
  std::map<std::string, double> largest;
  for (const EfficiencyRow* row : rows) {
    double& place = largest[row->scene];
    place = std::max(place, place_of(*row));
  }
  RowList result;
  for (const EfficiencyRow* row : rows) {
    if (place_of(*row) == largest[row->scene]) result.push_back(row);
  }
  return result;
}

bool is_one_per_scene(const RowList& rows) {
  std::map<std::string, int> count;
  for (const EfficiencyRow* row : rows) {
    if (++count[row->scene] > 1) return false;
  }
  return true;
}

/// Splits a method by what was swept, if anything was.
std::vector<Method> methods_of(const RowList& rows) {
  if (is_one_per_scene(rows)) return {{rows, {}, {}}};
  std::map<std::tuple<int, int, int>, Method> split;
  for (const EfficiencyRow* row : rows) {
    Method& method = split[{row->srl, row->srl_initial, row->spp}];
    method.rows.push_back(row);
    method.srl = row->srl;
    method.spp = row->spp;
  }
  std::vector<Method> result;
  for (auto& [key, method] : split) result.push_back(std::move(method));
  return result;
}

void add_note(AggregateRow& row, const std::string& text) {
  row.note += (row.note.empty() ? "" : "; ") + text;
}

void count_outcome(AggregateRow& result, const SceneRatio& ratio) {
  if (!ratio.lo || !ratio.hi) {
    ++result.undecided;
  } else if (*ratio.lo > 1 + kTieMargin) {
    ++result.wins;
  } else if (*ratio.hi < 1 - kTieMargin) {
    ++result.losses;
  } else {
    ++result.ties;
  }
}

/// The mean's interval from the scenes' own standard errors; degrees of freedom by Satterthwaite.
std::optional<Interval> fixed_interval(std::span<const SceneRatio> ratios, double mean,
                                       double confidence) {
  double variance = 0;
  double fourth = 0;
  for (const SceneRatio& ratio : ratios) {
    if (!ratio.log_se || ratio.blocks.value_or(0) < 2) return std::nullopt;
    const double square = *ratio.log_se * *ratio.log_se;
    variance += square;
    fourth += square * square / static_cast<double>(*ratio.blocks - 1);
  }
  if (!(variance > 0)) return Interval{mean, mean};
  const double dof = variance * variance / fourth;
  const double standard_error = std::sqrt(variance) / static_cast<double>(ratios.size());
  const double half_width = student_t_quantile(0.5 + 0.5 * confidence, dof) * standard_error;
  return Interval{mean - half_width, mean + half_width};
}

void add_mean(AggregateRow& result, std::span<const SceneRatio> ratios, double confidence) {
  Welford logs;
  for (const SceneRatio& ratio : ratios) {
    logs.add(std::log(*ratio.value));
    if (!result.worst_ratio || *ratio.value < *result.worst_ratio) {
      result.worst_ratio = ratio.value;
      result.worst_scene = ratio.scene;
    }
  }
  result.ratio = std::exp(logs.mean());
  if (const auto fixed = fixed_interval(ratios, logs.mean(), confidence)) {
    result.fixed_lo = std::exp(fixed->lo);
    result.fixed_hi = std::exp(fixed->hi);
  }
  if (const auto random = mean_interval(logs, confidence)) {
    result.random_lo = std::exp(random->lo);
    result.random_hi = std::exp(random->hi);
  } else {
    add_note(result, "one scene: nothing about others");
  }
}

void add_budget(AggregateRow& result, const RowList& rows) {
  const bool same = std::all_of(rows.begin(), rows.end(), [&](const EfficiencyRow* row) {
    return row->budget_s == rows.front()->budget_s;
  });
  if (same) {
    result.budget_s = rows.front()->budget_s;
  } else {
    add_note(result, "the largest budgets of the scenes differ");
  }
}

/// @param ecdf  sorted by relative time within each method
void add_targets(AggregateRow& result, std::span<const EcdfRow> ecdf) {
  for (const EcdfRow& row : ecdf) {
    if (row.metric != "mse" || row.label != result.label || row.sampler != result.sampler ||
        row.params != result.params || (result.srl && row.srl && row.srl != result.srl)) {
      continue;
    }
    ++result.targets;
    result.targets_reached += row.time_s.has_value();
    if (!result.median_relative_time && row.share && *row.share >= 0.5) {
      result.median_relative_time = row.relative_time;
    }
  }
}

/// @param tuned  against the tuned baseline
AggregateRow aggregated(const Method& method, bool tuned, std::span<const EcdfRow> ecdf,
                        const TableOptions& options) {
  AggregateRow result;
  const EfficiencyRow& first = *method.rows.front();
  result.label = first.label;
  result.sampler = first.sampler;
  result.params = first.params;
  result.srl = method.srl;
  result.spp = method.spp;
  result.baseline = tuned ? *options.tuned_baseline : options.baseline;
  std::vector<SceneRatio> compared;
  std::string missing;
  for (const EfficiencyRow* row : method.rows) {
    SceneRatio ratio = ratio_of(*row, tuned);
    if (ratio.value) {
      count_outcome(result, ratio);
      compared.push_back(std::move(ratio));
    } else {
      missing += (missing.empty() ? "" : ", ") + row->scene;
    }
  }
  result.n_scenes = static_cast<int>(compared.size());
  result.n_missing = static_cast<int>(method.rows.size() - compared.size());
  if (!missing.empty()) add_note(result, "no ratio on " + missing);
  add_budget(result, method.rows);
  if (!compared.empty()) add_mean(result, compared, options.confidence);
  if (!tuned) add_targets(result, ecdf);
  return result;
}

void add_all(std::vector<AggregateRow>& result, std::span<const EfficiencyRow> rows, bool tuned,
             std::span<const EcdfRow> ecdf, const TableOptions& options) {
  // In the order of the table: the rows' first occurrence.
  std::vector<decltype(method_key(rows.front()))> order;
  std::map<decltype(method_key(rows.front())), RowList> groups;
  for (const EfficiencyRow& row : rows) {
    if (row.label == (tuned ? *options.tuned_baseline : options.baseline)) continue;
    RowList& group = groups[method_key(row)];
    if (group.empty()) order.push_back(method_key(row));
    group.push_back(&row);
  }
  for (const auto& key : order) {
    for (const Method& method : methods_of(at_largest_budget(groups[key]))) {
      result.push_back(aggregated(method, tuned, ecdf, options));
    }
  }
}

}  // namespace

std::vector<AggregateRow> aggregate_over_scenes(std::span<const EfficiencyRow> rows,
                                                std::span<const EcdfRow> ecdf,
                                                const TableOptions& options) {
  std::vector<AggregateRow> result;
  add_all(result, rows, false, ecdf, options);
  if (options.tuned_baseline) add_all(result, rows, true, ecdf, options);
  return result;
}

}  // namespace penumbra
