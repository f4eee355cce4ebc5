#include "harness/efficiency_marks.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>

#include "harness/efficiency.h"
#include "harness/statistics.h"

namespace penumbra {
namespace {

std::optional<double> published_efficiency(const TableOptions& options, const std::string& label,
                                           const std::string& scene) {
  const auto method = options.published.find(label);
  if (method == options.published.end()) return std::nullopt;
  const auto found = method->second.find(scene);
  return found == method->second.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

std::optional<double> published_ratio(const EfficiencyRow& row, const TableOptions& options) {
  const auto own = published_efficiency(options, row.label, row.scene);
  const auto baseline = published_efficiency(options, options.baseline, row.scene);
  if (!own || !baseline) return std::nullopt;
  return *own / *baseline;
}

void adjust_bias(std::vector<EfficiencyRow>& rows) {
  std::vector<double> p;
  for (const EfficiencyRow& row : rows) {
    if (row.bias_p) p.push_back(*row.bias_p);
  }
  const std::vector<double> adjusted = holm_adjusted(p);
  std::size_t next = 0;
  for (EfficiencyRow& row : rows) {
    if (row.bias_p) row.bias_p_holm = adjusted[next++];
  }
}

void mark_best(std::vector<EfficiencyRow>& rows, PrimaryTime primary) {
  std::map<std::tuple<std::string, std::string, std::string, std::optional<double>, int>,
           std::vector<EfficiencyRow*>>
      groups;
  for (EfficiencyRow& row : rows) {
    if (!row.eff_cpu || !row.eff) continue;
    // Where nothing is solved for, cells of other SPP are other points of a curve.
    const int spp = row.budget_s ? 0 : row.spp;
    groups[{row.scene, row.label, row.sampler, row.budget_s, spp}].push_back(&row);
  }
  for (auto& [key, group] : groups) {
    if (group.size() < 2) continue;
    const auto efficiency = [&](const EfficiencyRow* row) {
      return primary == PrimaryTime::Cpu ? *row->eff_cpu : *row->eff;
    };
    const auto best = std::max_element(
        group.begin(), group.end(),
        [&](const auto* a, const auto* b) { return efficiency(a) < efficiency(b); });
    (*best)->best_of = static_cast<std::int64_t>(group.size());
  }
}

}  // namespace penumbra
