#include "harness/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <tuple>

#include "harness/metrics.h"
#include "harness/number_text.h"

namespace penumbra {
namespace {

using RowList = std::vector<const EfficiencyRow*>;

/// Later budgets, or more SPP where there are none, stand for a method.
auto size_of_run(const EfficiencyRow& row) {
  return std::pair(row.budget_s.value_or(0), row.budget_s ? 0 : row.spp);
}

double efficiency_of(const EfficiencyRow& row) { return row.eff_cpu.value_or(-1); }

std::string listed(const std::vector<std::string>& items) {
  std::string text;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0) text += i + 1 == items.size() ? " and " : ", ";
    text += items[i];
  }
  return text;
}

std::string times_text(const std::optional<double>& value, const std::optional<double>& lo,
                       const std::optional<double>& hi) {
  if (!lo || !hi) return ratio_text(*value) + "x";
  return fmt::format("{}x [{}, {}]", ratio_text(*value), ratio_text(*lo), ratio_text(*hi));
}

/// The label, and the sampler where it is not the only one of that label.
std::string name_of(const EfficiencyRow& row, const RowList& rows) {
  const bool several = std::any_of(rows.begin(), rows.end(), [&](const EfficiencyRow* other) {
    return other->label == row.label && other->sampler != row.sampler;
  });
  return several ? fmt::format("{} ({})", row.label, row.sampler) : row.label;
}

const AggregateRow* mean_over_scenes(const EfficiencyRow& row, const ReportTables& tables) {
  const AggregateRow* found = nullptr;
  for (const AggregateRow& mean : tables.aggregate) {
    if (mean.label != row.label || mean.sampler != row.sampler ||
        mean.baseline != tables.options.baseline || mean.n_scenes < 2 || !mean.ratio) {
      continue;
    }
    if (found) return nullptr;  // a sweep: no single number
    found = &mean;
  }
  return found;
}

/// One sentence for all scenes of a method.
std::string result_text(const RowList& method, const RowList& all, const ReportTables& tables) {
  std::map<Standing, std::vector<std::string>> scenes;
  for (const EfficiencyRow* row : method) {
    if (!row->ratio) continue;
    const Standing standing = row->ratio_lo && row->ratio_hi
                                  ? standing_of(*row->ratio_lo, *row->ratio_hi)
                                  : Standing::Undecided;
    scenes[standing].push_back(
        fmt::format("{} ({})", row->scene, times_text(row->ratio, row->ratio_lo, row->ratio_hi)));
  }
  if (scenes.empty()) return {};
  const std::string& baseline = tables.options.baseline;
  std::vector<std::string> parts;
  if (const auto it = scenes.find(Standing::Better); it != scenes.end()) {
    parts.push_back(fmt::format("more efficient than {} on {}", baseline, listed(it->second)));
  }
  if (const auto it = scenes.find(Standing::Worse); it != scenes.end()) {
    parts.push_back(fmt::format("less efficient{} on {}", parts.empty() ? " than " + baseline : "",
                                listed(it->second)));
  }
  if (const auto it = scenes.find(Standing::Undecided); it != scenes.end()) {
    parts.push_back(fmt::format("not told apart{} on {}", parts.empty() ? " from " + baseline : "",
                                listed(it->second)));
  }
  std::string text = fmt::format("{} is {}", name_of(*method.front(), all), fmt::join(parts, "; "));
  if (const AggregateRow* mean = mean_over_scenes(*method.front(), tables)) {
    text += fmt::format("; over the {} scenes {}", mean->n_scenes,
                        times_text(mean->ratio, mean->fixed_lo, mean->fixed_hi));
  }
  return text + ".";
}

/// Whether two efficiencies have intervals that do not meet.
bool are_apart(const EfficiencyRow& a, const EfficiencyRow& b) {
  return a.eff_lo && b.eff_hi && *a.eff_lo > *b.eff_hi;
}

/// The most efficient row of a scene that is neither failed nor biased.
std::string leader_text(const RowList& scene, const RowList& all) {
  RowList ranked;
  for (const EfficiencyRow* row : scene) {
    if (row->eff_cpu && row->verdict != Verdict::Failed && !is_biased(*row)) ranked.push_back(row);
  }
  if (ranked.size() < 2) return {};
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto* a, const auto* b) {
    return efficiency_of(*a) > efficiency_of(*b);
  });
  const EfficiencyRow& first = *ranked[0];
  const EfficiencyRow& second = *ranked[1];
  const double lead = efficiency_of(first) / efficiency_of(second);
  if (!are_apart(first, second)) {
    return fmt::format("On {}, {} and {} are the most efficient, and not told apart.", first.scene,
                       name_of(first, all), name_of(second, all));
  }
  return fmt::format("On {}, {} is the most efficient, {}x ahead of {}.", first.scene,
                     name_of(first, all), ratio_text(lead), name_of(second, all));
}

/// "MDHI on buddha and yearright; PMC-HI on checkerboard" of the rows that satisfy a condition.
std::string where(const RowList& rows, const std::function<bool(const EfficiencyRow&)>& holds) {
  std::vector<std::pair<std::string, std::vector<std::string>>> methods;
  for (const EfficiencyRow* row : rows) {
    if (!holds(*row)) continue;
    const std::string name = name_of(*row, rows);
    const auto same = std::find_if(methods.begin(), methods.end(),
                                   [&](const auto& method) { return method.first == name; });
    if (same == methods.end()) {
      methods.push_back({name, {row->scene}});
    } else {
      same->second.push_back(row->scene);
    }
  }
  std::vector<std::string> parts;
  for (const auto& [name, scenes] : methods) parts.push_back(name + " on " + listed(scenes));
  return fmt::format("{}", fmt::join(parts, "; "));
}

std::vector<std::string> cautions_of(const RowList& rows, const ReportTables& tables) {
  std::vector<std::string> texts;
  const auto add = [&](const std::string& found, const std::string& before,
                       const std::string& after) {
    if (!found.empty()) texts.push_back(before + found + after);
  };
  add(where(rows, [](const auto& row) { return row.verdict == Verdict::Failed; }),
      "Failed, and without numbers: ", ".");
  add(where(rows, [](const auto& row) { return is_biased(row); }),
      "Biased: ", "; efficiency says nothing of an error that does not fall with time.");
  add(where(rows, [](const auto& row) { return row.p_eff && *row.p_eff < kFewPixels; }),
      fmt::format("Fewer than {:g} effective pixels decide the MSE of ", kFewPixels),
      "; relMSE is the safer number.");
  add(where(rows, [](const auto& row) { return row.reference_share.value_or(0) > kShareToWarn; }),
      fmt::format("The reference's own noise is above {:g} % of the error of ", 100 * kShareToWarn),
      ".");
  add(where(rows, [](const auto& row) { return row.n_contaminated > 0; }),
      "Other work on the machine disturbed runs of ", ".");
  std::size_t outside = 0;
  std::size_t published = 0;
  for (const EfficiencyRow* row : rows) {
    if (!row->ratio_published || !row->ratio_lo || !row->ratio_hi ||
        row->label == tables.options.baseline) {
      continue;
    }
    ++published;
    outside += *row->ratio_published < *row->ratio_lo || *row->ratio_published > *row->ratio_hi;
  }
  if (published > 0) {
    texts.push_back(fmt::format(
        "{} of {} published ratios lie outside the measured interval ({}).", outside, published,
        tables.options.published_source.empty() ? "source not given"
                                                : tables.options.published_source));
  }
  return texts;
}

}  // namespace

Standing standing_of(double lo, double hi) noexcept {
  if (lo > 1) return Standing::Better;
  return hi < 1 ? Standing::Worse : Standing::Undecided;
}

std::vector<const EfficiencyRow*> headline_rows(std::span<const EfficiencyRow> rows) {
  const auto key = [](const EfficiencyRow& row) {
    return std::tuple(row.scene, row.label, row.sampler);
  };
  std::map<decltype(key(rows.front())), const EfficiencyRow*> chosen;
  for (const EfficiencyRow& row : rows) {
    const EfficiencyRow*& best = chosen[key(row)];
    const auto rank = [](const EfficiencyRow& r) {
      return std::tuple(size_of_run(r), efficiency_of(r));
    };
    if (!best || rank(row) > rank(*best)) best = &row;
  }
  RowList result;
  for (const EfficiencyRow& row : rows) {
    if (chosen.at(key(row)) == &row) result.push_back(&row);
  }
  return result;
}

std::vector<Statement> summarise(const ReportTables& tables) {
  if (tables.efficiency.empty()) return {};
  const RowList rows = headline_rows(tables.efficiency);
  std::vector<RowList> methods, scenes;
  const auto add = [](std::vector<RowList>& groups, const EfficiencyRow* row, const auto& same) {
    const auto group = std::find_if(groups.begin(), groups.end(),
                                    [&](const RowList& g) { return same(*g.front(), *row); });
    if (group == groups.end()) {
      groups.push_back({row});
    } else {
      group->push_back(row);
    }
  };
  for (const EfficiencyRow* row : rows) {
    add(scenes, row, [](const auto& a, const auto& b) { return a.scene == b.scene; });
    if (row->label == tables.options.baseline) continue;
    add(methods, row,
        [](const auto& a, const auto& b) { return a.label == b.label && a.sampler == b.sampler; });
  }
  std::vector<Statement> statements;
  const auto say = [&](StatementKind kind, const std::string& text) {
    if (!text.empty()) statements.push_back({kind, text});
  };
  for (const RowList& method : methods) {
    say(StatementKind::Result, result_text(method, rows, tables));
  }
  for (const RowList& scene : scenes) say(StatementKind::Leader, leader_text(scene, rows));
  for (const std::string& text : cautions_of(rows, tables)) say(StatementKind::Caution, text);
  return statements;
}

}  // namespace penumbra
