#include "harness/table_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/metrics.h"
#include "harness/number_text.h"
#include "harness/text_grid.h"

namespace penumbra {
namespace {

constexpr std::string_view kBudgetTitle = "Budget";
constexpr std::string_view kPublishedTitle = "published ratio";

std::string srl_text(const EfficiencyRow& row) {
  if (row.srl_adaptive == 0) return std::to_string(row.srl);
  return fmt::format("{}-{}", row.srl_initial, row.srl_adaptive);
}

bool noisy_reference(const EfficiencyRow& row) {
  return row.reference_share.value_or(0) > kShareToWarn;
}

bool few_pixels(const EfficiencyRow& row) {
  return row.p_eff.has_value() && *row.p_eff < kFewPixels;
}

bool has_published(std::span<const EfficiencyRow> rows) {
  return std::any_of(rows.begin(), rows.end(),
                     [](const EfficiencyRow& row) { return row.ratio_published.has_value(); });
}

std::string error_text(const EfficiencyRow& row) {
  return number_text(row.err) + (noisy_reference(row) ? "r" : "") + (few_pixels(row) ? "p" : "");
}

std::string eff_text(const EfficiencyRow& row, const TableOptions& options) {
  return number_text(options.primary == PrimaryTime::Cpu ? row.eff_cpu : row.eff) +
         (row.best_of ? "*" : "");
}

std::string blocks_text(const EfficiencyRow& row) {
  return std::to_string(row.n_blocks) + (row.n_contaminated > 0 ? "c" : "");
}

std::string share(const std::optional<double>& value) {
  return value ? number_text(100 * *value) + " %" : "-";
}

std::string shown_verdict(const EfficiencyRow& row) {
  const std::string verdict = row.verdict == Verdict::ReferenceLimited
                                  ? "ref-limited"
                                  : std::string(verdict_text(row.verdict));
  return is_biased(row) ? verdict + ", biased" : verdict;
}

/// Parameters are shown only where they tell cells of one label apart.
std::string label_text(const EfficiencyRow& row, std::span<const EfficiencyRow> rows) {
  const bool swept = std::any_of(rows.begin(), rows.end(), [&](const EfficiencyRow& other) {
    return other.label == row.label && other.params != row.params;
  });
  return swept && !row.params.empty() ? row.label + " " + row.params : row.label;
}

std::string population_text(const EfficiencyRow& row) {
  return row.population ? std::to_string(*row.population) : "-";
}

/// What scenes with shapes of type "model" are made of.
void add_geometry_notes(std::span<const EfficiencyRow> rows, std::vector<std::string>& notes) {
  std::set<std::string> said;
  for (const EfficiencyRow& row : rows) {
    if (row.geometry != "generated" && row.geometry != "models") continue;
    if (!said.insert(row.scene).second) continue;
    notes.push_back(row.scene + (row.geometry == "models"
                                     ? ": with the real model from PENUMBRA_MODELS."
                                     : ": with geometry generated in place of the real model."));
  }
}

/// What the marks beside numbers and verdicts mean, where there are any.
void add_flag_notes(std::span<const EfficiencyRow> rows, std::vector<std::string>& notes) {
  std::int64_t most = 0;
  std::size_t tested = 0;
  int contaminated = 0;
  for (const EfficiencyRow& row : rows) {
    most = std::max(most, row.best_of.value_or(0));
    tested += row.bias_p_holm.has_value();
    contaminated += row.n_contaminated;
  }
  if (most > 0) {
    notes.push_back(
        fmt::format("*: the most efficient of up to {} cells that differ in SRL or parameters only "
                    "(best_of in the CSV file has the number of each). The best of several is "
                    "favoured by chance; measure it alone before quoting it.",
                    most));
  }
  if (contaminated > 0) {
    notes.push_back(fmt::format(
        "c: some runs were disturbed by other work ({} in all); they are kept in the raw rows, and "
        "clean repetitions are used where there are any.",
        contaminated));
  }
  if (std::any_of(rows.begin(), rows.end(), is_biased)) {
    notes.push_back(fmt::format(
        "biased: the mean error differs from 0, p <= {:g} after Holm over the {} cells tested.",
        kBiasLevel, tested));
  }
}

bool has_budgets(std::span<const EfficiencyRow> rows) {
  return std::any_of(rows.begin(), rows.end(), [&](const EfficiencyRow& row) {
    return row.budget_s != rows.front().budget_s;
  });
}

/// Notes of cells; cells of which the same is to be said share a line.
void add_cell_notes(std::span<const EfficiencyRow> rows, std::vector<std::string>& notes) {
  std::vector<std::pair<std::string, std::string>> lines;  // note, cells
  for (const EfficiencyRow& row : rows) {
    if (row.note.empty()) continue;
    const std::string budget = has_budgets(rows) ? ", " + seconds_text(row.budget_s) : "";
    const std::string cell = fmt::format("{}, {} ({}, SRL {}{})", row.scene, label_text(row, rows),
                                         row.sampler, srl_text(row), budget);
    const auto line = std::find_if(lines.begin(), lines.end(),
                                   [&](const auto& other) { return other.first == row.note; });
    if (line == lines.end()) {
      lines.emplace_back(row.note, cell);
    } else {
      line->second += "; " + cell;
    }
  }
  for (const auto& [note, cells] : lines) notes.push_back(fmt::format("{}: {}.", cells, note));
}

std::vector<std::string> footnotes(std::span<const EfficiencyRow> rows, const TableOptions& options,
                                   bool terminal) {
  std::vector<std::string> notes;
  const std::string_view time = options.primary == PrimaryTime::Cpu ? "CPU" : "wall";
  notes.push_back(fmt::format(
      "Eff: 1/(T x MSE) in {} time. Ratio: over that of \"{}\" in the same blocks; in brackets its "
      "{:g} % interval (block jackknife of the ratio of means, t).",
      time, options.baseline, 100 * options.confidence));
  if (!terminal) {
    notes.push_back(
        "By wall, by rays, by instr.: the same ratio by another cost. Detectable: the "
        "smallest difference of efficiencies that as many blocks of this noise show with 80 % "
        "power, "
        "two-sided at 5 %.");
  }
  notes.push_back(
      fmt::format("MSE is debiased; relMSE divides by reference^2 + {:g} mean(reference)^2.",
                  options.relmse_epsilon));
  if (std::any_of(rows.begin(), rows.end(), noisy_reference)) {
    notes.push_back("r: the reference's own variance is more than 5 % of this MSE.");
  }
  if (std::any_of(rows.begin(), rows.end(), few_pixels)) {
    notes.push_back(fmt::format(
        "p: fewer than {:g} effective pixels decide this MSE; trust relMSE.", kFewPixels));
  }
  if (!options.published_source.empty() && has_published(rows)) {
    notes.push_back("Published ratio: " + options.published_source);
  }
  add_flag_notes(rows, notes);
  add_geometry_notes(rows, notes);
  add_cell_notes(rows, notes);
  return notes;
}

struct TableContext {
  std::span<const EfficiencyRow> rows;
  const TableOptions& options;
};

/// A column for people.
struct ShownColumn {
  std::string_view title;
  bool is_text;
  bool in_terminal;
  std::string (*text)(const EfficiencyRow&, const TableContext&);
};

// clang-format off
constexpr std::array<ShownColumn, 23> kShownColumns{{
    {"Scene", true, true, [](const auto& r, const auto&) { return r.scene; }},
    {"Label", true, true, [](const auto& r, const auto& c) { return label_text(r, c.rows); }},
    {"Sampler", true, true, [](const auto& r, const auto&) { return r.sampler; }},
    {kBudgetTitle, false, false, [](const auto& r, const auto&) { return seconds_text(r.budget_s); }},
    {"SPP", false, true, [](const auto& r, const auto&) { return std::to_string(r.spp); }},
    {"SRL", false, true, [](const auto& r, const auto&) { return srl_text(r); }},
    {"Pop", false, true, [](const auto& r, const auto&) { return population_text(r); }},
    {"Blocks", false, false, [](const auto& r, const auto&) { return blocks_text(r); }},
    {"T_cpu", false, true, [](const auto& r, const auto&) { return seconds_text(r.time_cpu_s); }},
    {"MSE", false, true, [](const auto& r, const auto&) { return error_text(r); }},
    {"Ref share", false, false, [](const auto& r, const auto&) { return share(r.reference_share); }},
    {"relMSE", false, true, [](const auto& r, const auto&) { return number_text(r.relmse); }},
    {"Eff", false, true, [](const auto& r, const auto& c) { return eff_text(r, c.options); }},
    {"Ratio", false, true, [](const auto& r, const auto&) {
       return ratio_interval_text(r.ratio, r.ratio_lo, r.ratio_hi); }},
    {kPublishedTitle, false, true, [](const auto& r, const auto&) {
       return ratio_interval_text(r.ratio_published, {}, {}); }},
    {"by wall", false, false, [](const auto& r, const auto&) {
       return ratio_interval_text(r.ratio_wall, r.ratio_wall_lo, r.ratio_wall_hi); }},
    {"by rays", false, false, [](const auto& r, const auto&) {
       return ratio_interval_text(r.ratio_rays, r.ratio_rays_lo, r.ratio_rays_hi); }},
    {"by instr.", false, false, [](const auto& r, const auto&) {
       return ratio_interval_text(r.ratio_instructions, r.ratio_instructions_lo,
                                  r.ratio_instructions_hi); }},
    {"Detectable", false, false, [](const auto& r, const auto&) {
       return percent_text(r.detectable); }},
    {"Ratio to tuned", false, false, [](const auto& r, const auto&) {
       return ratio_interval_text(r.ratio_tuned, r.ratio_tuned_lo, r.ratio_tuned_hi); }},
    {"Bias", false, false, [](const auto& r, const auto&) { return percent_text(r.bias_rel); }},
    {"Bias p", false, false, [](const auto& r, const auto&) { return number_text(r.bias_p); }},
    {"Verdict", true, true, [](const auto& r, const auto&) { return shown_verdict(r); }},
}};
// clang-format on

/// The columns that are shown: that of published ratios only where there are any, that of budgets
/// on a terminal only where it tells cells apart.
std::vector<ShownColumn> columns_of(const TableContext& context, bool terminal) {
  std::vector<ShownColumn> columns;
  for (const ShownColumn& c : kShownColumns) {
    const bool tells_apart = c.title == kBudgetTitle && has_budgets(context.rows);
    if (terminal && !c.in_terminal && !tells_apart) continue;
    if (c.title == kPublishedTitle && !has_published(context.rows)) continue;
    columns.push_back(c);
  }
  return columns;
}

TextGrid grid_of(const TableContext& context, bool terminal) {
  const std::vector<ShownColumn> columns = columns_of(context, terminal);
  TextGrid grid;
  for (const ShownColumn& c : columns) grid.columns.push_back({std::string(c.title), c.is_text});
  for (const EfficiencyRow& row : context.rows) {
    auto& line = grid.lines.emplace_back();
    for (const ShownColumn& c : columns) line.push_back(c.text(row, context));
  }
  return grid;
}

}  // namespace

std::string to_csv(std::span<const EfficiencyRow> rows) {
  std::string text = csv_line(efficiency_columns());
  for (const EfficiencyRow& row : rows) text += csv_line(efficiency_record(row));
  return text;
}

std::string to_markdown(std::span<const EfficiencyRow> rows, const TableOptions& options) {
  return markdown_grid(grid_of({rows, options}, false)) + "\n" +
         markdown_notes(footnotes(rows, options, false));
}

std::string to_terminal(std::span<const EfficiencyRow> rows, const TableOptions& options) {
  constexpr std::size_t kNames = 3;
  return terminal_grid(grid_of({rows, options}, true), kNames) +
         terminal_notes(footnotes(rows, options, true));
}

}  // namespace penumbra
