#include "harness/report_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "harness/curve_fit.h"
#include "harness/number_text.h"
#include "harness/text_grid.h"

namespace penumbra {
namespace {

constexpr std::string_view kCurvesTitle = "Error against time";
constexpr std::string_view kAggregateTitle = "Over scenes";

/// A method's name with what its label does not say.
template <class Row>
std::string label_of(const Row& row, std::span<const Row> rows) {
  const bool params = std::any_of(rows.begin(), rows.end(), [&](const Row& other) {
    return other.label == row.label && other.params != row.params;
  });
  const bool rays = std::any_of(rows.begin(), rows.end(), [&](const Row& other) {
    return other.label == row.label && other.srl != row.srl;
  });
  std::string text = row.label;
  if (params && !row.params.empty()) text += " " + row.params;
  if (rays && row.srl) text += fmt::format(" SRL {}", *row.srl);
  return text;
}

bool has_relmse(std::span<const CurveRow> rows) {
  return std::any_of(rows.begin(), rows.end(),
                     [](const CurveRow& row) { return row.relmse.slope.has_value(); });
}

TextGrid curves_grid(std::span<const CurveRow> rows, bool terminal) {
  const bool relative = has_relmse(rows) && !terminal;
  TextGrid grid;
  grid.columns = {{"Scene", true}, {"Label", true}, {"Sampler", true}};
  if (!terminal) {
    grid.columns.push_back({"Points", false});
    grid.columns.push_back({"T", false});
  }
  grid.columns.push_back({"Slope", false});
  grid.columns.push_back({"Order", false});
  if (!terminal) grid.columns.push_back({"p of -1", false});
  grid.columns.push_back({"Bias floor", false});
  if (relative) grid.columns.push_back({"relMSE slope", false});
  if (!terminal) grid.columns.push_back({"MSE@B", false});
  grid.columns.push_back({"Time to target", false});
  grid.columns.push_back({"Times faster", false});
  for (const CurveRow& row : rows) {
    const MetricCurve& m = row.mse;
    auto& line = grid.lines.emplace_back();
    line = {row.scene, label_of(row, rows), row.sampler};
    if (!terminal) {
      line.push_back(std::to_string(row.n_points));
      line.push_back(seconds_text(row.time_min_s) + " to " + seconds_text(row.time_max_s));
    }
    line.push_back(slope_interval_text(m.slope, m.slope_lo, m.slope_hi));
    line.push_back(slope_interval_text(m.order, m.order_lo, m.order_hi));
    if (!terminal) line.push_back(number_text(m.order_p));
    line.push_back(number_interval_text(m.floor, m.floor_lo, m.floor_hi));
    if (relative) {
      line.push_back(
          slope_interval_text(row.relmse.slope, row.relmse.slope_lo, row.relmse.slope_hi));
    }
    if (!terminal) line.push_back(number_interval_text(m.at, m.at_lo, m.at_hi));
    line.push_back(seconds_text(m.time_s));
    line.push_back(ratio_interval_text(m.speedup, m.speedup_lo, m.speedup_hi));
  }
  return grid;
}

std::vector<std::string> curve_notes(std::span<const CurveRow> rows, const TableOptions& options,
                                     bool terminal) {
  const std::string_view time = options.primary == PrimaryTime::Cpu ? "CPU" : "wall";
  std::vector<std::string> notes;
  notes.push_back(fmt::format(
      "Slope: of log MSE over log {} time, below the order where part of the time is paid once per "
      "shading point; all intervals are {:g} %, by a jackknife over blocks.",
      time, 100 * options.confidence));
  notes.push_back(
      "Order: the same over log SPP, -1 for an unbiased estimator with independent points.");
  notes.push_back(
      "Bias floor: b of MSE = a/T + b^2, 0 where its interval holds 0; the interval is cut at 0.");
  if (!terminal) {
    std::string at;
    std::string scene;
    for (const CurveRow& row : rows) {
      if (row.scene == scene) continue;
      scene = row.scene;
      at += (at.empty() ? "" : ", ") + scene + " " + seconds_text(row.at_s);
    }
    notes.push_back("MSE@B: log-log interpolation at B = " + at + ".");
  }
  notes.push_back(
      fmt::format("Time to target: to the MSE of \"{}\" at its largest budget; times faster: than "
                  "\"{}\" there. "
                  "From three budgets on, and at most a factor {:g} beyond the times measured.",
                  options.baseline, options.baseline, kMaxExtrapolation));
  for (const CurveRow& row : rows) {
    if (row.note.empty()) continue;
    notes.push_back(
        fmt::format("{}, {} ({}): {}.", row.scene, label_of(row, rows), row.sampler, row.note));
  }
  return notes;
}

std::string reached_text(const AggregateRow& row) {
  if (row.targets == 0) return "-";
  return fmt::format("{} of {}", row.targets_reached, row.targets);
}

bool has_several_scenes(std::span<const AggregateRow> rows) {
  return std::any_of(rows.begin(), rows.end(),
                     [](const AggregateRow& row) { return row.n_scenes > 1; });
}

bool has_two_baselines(std::span<const AggregateRow> rows) {
  return rows.front().baseline != rows.back().baseline;
}

TextGrid aggregate_grid(std::span<const AggregateRow> rows, bool terminal) {
  TextGrid grid;
  const bool two = has_two_baselines(rows);
  grid.columns = {{"Label", true},
                  {"Sampler", true},
                  {"Scenes", false},
                  {"Ratio [these scenes]", false},
                  {"[such scenes]", false},
                  {"Worst", false},
                  {"on", true},
                  {"W/T/L", false}};
  if (!terminal) {
    grid.columns.push_back({"Targets", false});
    grid.columns.push_back({"Median time", false});
  }
  for (const AggregateRow& row : rows) {
    if (row.n_scenes == 0) continue;  // its note says why
    auto& line = grid.lines.emplace_back();
    const std::string label = label_of(row, rows);
    line = {two ? label + " / " + row.baseline : label,
            row.sampler,
            std::to_string(row.n_scenes),
            ratio_interval_text(row.ratio, row.fixed_lo, row.fixed_hi),
            row.random_lo
                ? fmt::format("[{}, {}]", ratio_text(*row.random_lo), ratio_text(*row.random_hi))
                : "-",
            row.worst_ratio ? ratio_text(*row.worst_ratio) : "-",
            row.worst_scene.empty() ? "-" : row.worst_scene,
            fmt::format("{}/{}/{}", row.wins, row.ties, row.losses)};
    if (terminal) continue;
    line.push_back(reached_text(row));
    line.push_back(row.median_relative_time ? ratio_text(*row.median_relative_time) : "-");
  }
  return grid;
}

/// Which runs were compared.
std::string chosen_text(std::span<const AggregateRow> rows) {
  const bool same = std::all_of(rows.begin(), rows.end(), [&](const AggregateRow& row) {
    return row.budget_s == rows.front().budget_s;
  });
  if (same && rows.front().budget_s) {
    return "at the largest budget, " + seconds_text(rows.front().budget_s) + ",";
  }
  return "at the largest budget of each scene (without budgets: the largest SPP)";
}

std::vector<std::string> aggregate_notes(std::span<const AggregateRow> rows,
                                         const TableOptions& options, bool terminal) {
  std::vector<std::string> notes;
  notes.push_back(
      fmt::format("Geometric mean over scenes of the efficiency ratio to {} {} with its {:g} % "
                  "interval for these scenes, from their own noise, and for scenes such as these, "
                  "from their spread (t).",
                  has_two_baselines(rows) ? "the label behind the stroke"
                                          : fmt::format("\"{}\"", options.baseline),
                  chosen_text(rows), 100 * options.confidence));
  notes.push_back(
      fmt::format("W/T/L: scenes won, tied (the interval reaches within {:g} % of 1) and lost.",
                  100 * kTieMargin));
  if (!terminal) {
    notes.push_back(fmt::format(
        "Targets: {} per scene, along the MSE curve of \"{}\"; median time: over targets, relative "
        "to it (ecdf.csv has all of them).",
        kTargets, options.baseline));
  }
  for (const AggregateRow& row : rows) {
    if (row.note.empty()) continue;
    notes.push_back(fmt::format("{} ({}) to {}: {}.", label_of(row, rows), row.sampler,
                                row.baseline, row.note));
  }
  return notes;
}

std::string markdown(std::string_view title, const TextGrid& grid,
                     std::span<const std::string> notes) {
  return fmt::format("## {}\n\n{}\n{}", title, markdown_grid(grid), markdown_notes(notes));
}

std::string terminal(std::string_view title, const TextGrid& grid, std::size_t names,
                     std::span<const std::string> notes) {
  return fmt::format("{}\n{}{}", title, terminal_grid(grid, names), terminal_notes(notes));
}

}  // namespace

std::string curves_markdown(std::span<const CurveRow> rows, const TableOptions& options) {
  if (rows.empty()) return {};
  return markdown(kCurvesTitle, curves_grid(rows, false), curve_notes(rows, options, false));
}

std::string curves_terminal(std::span<const CurveRow> rows, const TableOptions& options) {
  if (rows.empty()) return {};
  return terminal(kCurvesTitle, curves_grid(rows, true), 3, curve_notes(rows, options, true));
}

std::string aggregate_markdown(std::span<const AggregateRow> rows, const TableOptions& options) {
  if (!has_several_scenes(rows)) return {};
  return markdown(kAggregateTitle, aggregate_grid(rows, false),
                  aggregate_notes(rows, options, false));
}

std::string aggregate_terminal(std::span<const AggregateRow> rows, const TableOptions& options) {
  if (!has_several_scenes(rows)) return {};
  return terminal(kAggregateTitle, aggregate_grid(rows, true), 2,
                  aggregate_notes(rows, options, true));
}

}  // namespace penumbra
