// Times to targets of all curves, as an empirical distribution over (scene, target).

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "harness/aggregate.h"
#include "harness/curve_fit.h"

namespace penumbra {
namespace {

/// A curve's points in one metric; empty where an error is missing or not positive.
std::vector<CurvePoint> points_of(const Curves& curves, const CurveRow& row, bool relative) {
  std::vector<CurvePoint> points;
  for (const CurvePointRow& p : curves.points) {
    if (p.curve != row.curve) continue;
    const std::optional<double> error = relative ? p.relmse : std::optional(p.err);
    if (!error || !(*error > 0) || !(p.time_s > 0)) return {};
    points.push_back({p.time_s, *error});
  }
  return points;
}

const CurveRow* baseline_of(const Curves& curves, const CurveRow& row,
                            const TableOptions& options) {
  std::vector<const CurveRow*> found;
  for (const CurveRow& other : curves.rows) {
    if (other.label == options.baseline && other.scene == row.scene &&
        other.sampler == row.sampler) {
      found.push_back(&other);
    }
  }
  if (found.size() > 1) {
    std::erase_if(found, [&](const CurveRow* other) {
      return other->srl != row.srl || other->spp != row.spp;
    });
  }
  return found.size() == 1 ? found[0] : nullptr;
}

/// From the first to the last error of the baseline; empty where it does not fall.
std::vector<double> targets_of(const std::vector<CurvePoint>& baseline) {
  if (baseline.size() < 2 || !(baseline.back().error < baseline.front().error)) return {};
  std::vector<double> targets;
  const double first = std::log(baseline.front().error);
  const double last = std::log(baseline.back().error);
  for (int i = 0; i < kTargets; ++i) {
    targets.push_back(std::exp(first + (last - first) * i / (kTargets - 1)));
  }
  targets.front() = baseline.front().error;
  targets.back() = baseline.back().error;
  return targets;
}

/// Inside what was measured.
std::optional<double> measured_time(const std::vector<CurvePoint>& points, double target) {
  if (points.front().error <= target) return points.front().time_s;
  const bool reached = std::any_of(points.begin(), points.end(),
                                   [&](const CurvePoint& p) { return p.error <= target; });
  return reached ? time_to(points, target, -1) : std::nullopt;
}

void add_curve(std::vector<EcdfRow>& rows, const Curves& curves, const CurveRow& curve,
               const CurveRow& baseline, bool relative) {
  const std::vector<CurvePoint> points = points_of(curves, curve, relative);
  const std::vector<CurvePoint> base = points_of(curves, baseline, relative);
  if (points.empty() || base.empty()) return;
  for (const double target : targets_of(base)) {
    EcdfRow row;
    row.metric = relative ? "relmse" : "mse";
    row.label = curve.label;
    row.sampler = curve.sampler;
    row.params = curve.params;
    row.scene = curve.scene;
    row.srl = curve.srl;
    row.spp = curve.spp;
    row.curve = curve.curve;
    row.target = target;
    row.baseline_time_s = measured_time(base, target).value();
    row.time_s = measured_time(points, target);
    if (!row.time_s) {
      row.reach = "never";
    } else {
      row.reach = points.front().error < target ? "at_most" : "measured";
      row.relative_time = *row.time_s / row.baseline_time_s;
    }
    rows.push_back(row);
  }
}

auto label_key(const EcdfRow& r) { return std::tie(r.metric, r.label, r.sampler, r.params); }

/// Whether two rows are of one method. Where some scene has several curves of it, a sweep, SRL and
/// SPP tell methods apart; otherwise they may differ between scenes, as in the paper.
bool are_one_method(const EcdfRow& a, const EcdfRow& b, const Curves& curves) {
  if (label_key(a) != label_key(b)) return false;
  if (a.srl == b.srl && a.spp == b.spp) return true;
  std::map<std::string, int> curves_by_scene;
  for (const CurveRow& curve : curves.rows) {
    if (curve.label == a.label && curve.sampler == a.sampler && curve.params == a.params &&
        ++curves_by_scene[curve.scene] > 1) {
      return false;
    }
  }
  return true;
}

double sort_key(const EcdfRow& row) {
  return row.relative_time.value_or(std::numeric_limits<double>::infinity());
}

/// Shares of the rows of one method, sorted.
void add_shares(std::span<EcdfRow> rows) {
  const double total = static_cast<double>(rows.size());
  for (EcdfRow& row : rows) {
    if (!row.relative_time) continue;
    const auto at_most = std::count_if(rows.begin(), rows.end(), [&](const EcdfRow& other) {
      return sort_key(other) <= *row.relative_time;
    });
    row.share = static_cast<double>(at_most) / total;
  }
}

}  // namespace

std::vector<EcdfRow> time_to_target_ecdf(const Curves& curves, const TableOptions& options) {
  // By method in the order of the curves, which is by scene first.
  std::vector<std::vector<EcdfRow>> methods;
  for (const bool relative : {false, true}) {
    for (const CurveRow& curve : curves.rows) {
      const CurveRow* const baseline = baseline_of(curves, curve, options);
      if (!baseline) continue;
      std::vector<EcdfRow> rows;
      add_curve(rows, curves, curve, *baseline, relative);
      if (rows.empty()) continue;
      const auto same = std::find_if(methods.begin(), methods.end(), [&](const auto& method) {
        return are_one_method(method.front(), rows.front(), curves);
      });
      if (same == methods.end()) {
        methods.push_back(std::move(rows));
      } else {
        same->insert(same->end(), rows.begin(), rows.end());
      }
    }
  }
  std::vector<EcdfRow> result;
  for (std::vector<EcdfRow>& method : methods) {
    std::stable_sort(method.begin(), method.end(),
                     [](const EcdfRow& a, const EcdfRow& b) { return sort_key(a) < sort_key(b); });
    add_shares(method);
    result.insert(result.end(), method.begin(), method.end());
  }
  return result;
}

}  // namespace penumbra
