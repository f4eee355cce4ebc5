#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "harness/number_text.h"
#include "harness/progress.h"
#include "harness/stability/matrix.h"
#include "harness/stability/stability.h"
#include "harness/text_grid.h"

namespace penumbra::stability {
namespace {

constexpr std::string_view kDeclared = "*";

/// "ok", "n0.01": noisy from 0.01 on, "n0.01b": and biased at a later step.
std::string cell_text(const MatrixCell& cell) {
  if (cell.steps.empty()) return "-";
  const StabilityRow* first = cell.first_trouble();
  if (first == nullptr) return "ok";
  std::string text = letter_of(first->verdict) + value_text(first->value);
  if (cell.worst() > first->verdict) text += letter_of(cell.worst());
  return text;
}

/// Titles have to be short: thirteen columns share a line.
std::string title_of(const StabilityResult& result, const std::string& method) {
  const std::size_t space = method.find(" literal");
  const std::string name = space == std::string::npos ? method : "literal";
  return name + std::string(declares_bias(result, method) ? kDeclared : "");
}

struct Counts {
  std::array<std::size_t, 4> of{};
  std::size_t failing{0};  ///< that make the command fail
};

Counts count_verdicts(const StabilityResult& result) {
  Counts counts;
  for (const StabilityRow& row : result.rows) {
    ++counts.of[static_cast<std::size_t>(row.verdict)];
    StabilityResult alone;
    alone.rows = {row};
    counts.failing += passed(alone) ? 0u : 1u;
  }
  return counts;
}

std::vector<std::string> notes_of(const StabilityResult& result) {
  std::vector<std::string> notes{
      "A cell is a sweep from harmless to extreme: ok at every step, or the verdict and the value "
      "where it first stops being ok (n noisy, b biased, X breaks); a second letter is a worse "
      "verdict that follows. - : does not apply. sa: lights sampled by solid angle. literal: "
      "pmc_hi "
      "as the paper reads literally. *: declares a bias."};
  for (const auto& [verdict, rule] : rules_in_words()) {
    notes.push_back(fmt::format("{}: {}.", to_string(verdict), rule));
  }
  notes.push_back(bias_rule_in_words());
  for (const std::string& cell : result.left_out) notes.push_back("Left out: " + cell);
  return notes;
}

std::string failures(const StabilityResult& result) {
  std::string text;
  for (const StabilityRow& row : result.rows) {
    StabilityResult alone;
    alone.rows = {row};
    if (passed(alone)) continue;
    text += fmt::format(
        "{} at {}, {}: {}, {}{}\n  again, with the same random numbers: penumbra "
        "stability --case {} --estimator {}{}\n",
        row.case_name, value_text(row.value), row.method, to_string(row.verdict), row.reason,
        row.replay.empty() ? "" : "; " + row.replay, row.case_name, row.estimator,
        result.quick ? " --quick" : "");
  }
  return text;
}

std::string summary(const StabilityResult& result) {
  const Counts counts = count_verdicts(result);
  return fmt::format(
      "\n{}{}: {} cells: {} ok, {} noisy, {} biased, {} break; {} against the claims; {}\n",
      failures(result), passed(result) ? "PASS" : "FAIL", result.rows.size(), counts.of[0],
      counts.of[1], counts.of[2], counts.of[3], counts.failing, duration_text(result.wall_s));
}

std::string percent_or_dash(const std::optional<double>& share) {
  return share ? fmt::format("{:+.3g}", 100 * *share) : "-";
}

std::vector<std::string> detail_line(const StabilityRow& row) {
  const auto microseconds = [](const std::optional<double>& seconds) {
    return number_text(seconds ? std::optional(1e6 * *seconds) : std::nullopt);
  };
  const std::string slope = row.slope ? fmt::format("{:.2f}", *row.slope) : "-";
  const std::string slope_half =
      row.slope ? fmt::format("{:.2f}", 0.5 * (*row.slope_hi - *row.slope_lo)) : "-";
  return {row.method,
          value_text(row.value),
          std::string(to_string(row.verdict)),
          percent_or_dash(row.bias),
          percent_or_dash(row.bias_lo),
          percent_or_dash(row.bias_hi),
          number_text(row.rel_variance),
          number_text(row.largest_over_mean),
          number_text(row.kurtosis),
          slope,
          slope_half,
          microseconds(row.cpu_s),
          microseconds(row.cost)};
}

std::string statistics_grid(const std::vector<MatrixCell>& cells) {
  TextGrid grid;
  grid.columns = {{"Method", true},    {"Value", false}, {"Verdict", true},   {"Bias %", false},
                  {"from", false},     {"to", false},    {"Variance", false}, {"Max/mean", false},
                  {"Kurtosis", false}, {"Slope", false}, {"+-", false},       {"us", false},
                  {"Err x us", false}};
  for (const MatrixCell& cell : cells) {
    for (const StabilityRow* row : cell.steps) grid.lines.push_back(detail_line(*row));
  }
  return terminal_grid(grid, 1);
}

/// Error against run time at the last step of each method, and at the first for comparison.
std::string curve_grid(const std::vector<MatrixCell>& cells) {
  TextGrid grid;
  grid.columns = {{"Method", true},    {"Value", false},        {"Rays/light", false},
                  {"CPU time", false}, {"Square error", false}, {"+-", false}};
  for (const MatrixCell& cell : cells) {
    for (const StabilityRow* row : cell.steps) {
      if (row != cell.steps.front() && row != cell.steps.back()) continue;
      for (const ErrorLevel& level : row->levels) {
        grid.lines.push_back({row->method, value_text(row->value), std::to_string(level.srl),
                              seconds_text(std::optional(level.cpu_s)), number_text(level.rel_mse),
                              number_text(level.rel_mse_se)});
      }
    }
  }
  return terminal_grid(grid, 1);
}

}  // namespace

std::string to_terminal(const StabilityResult& result) {
  TextGrid grid;
  grid.columns.push_back({"Case", true});
  for (const std::string& method : result.methods) {
    grid.columns.push_back({title_of(result, method), true});
  }
  const auto matrix = matrix_of(result);
  for (std::size_t c = 0; c < matrix.size(); ++c) {
    std::vector<std::string> line{result.cases[c]};
    for (const MatrixCell& cell : matrix[c]) line.push_back(cell_text(cell));
    grid.lines.push_back(std::move(line));
  }
  return terminal_grid(grid, 1) + terminal_notes(notes_of(result)) + summary(result);
}

std::string detail_to_terminal(const StabilityResult& result) {
  std::string text;
  const auto matrix = matrix_of(result);
  for (std::size_t c = 0; c < matrix.size(); ++c) {
    const StabilityCase& source = case_named(result.cases[c]);
    text += fmt::format("{} ({}): {}. Swept: {}. Answer: {}.\n", source.name, source.ids,
                        source.summary, source.parameter, source.answer);
    text += statistics_grid(matrix[c]) + "\nError against run time at both ends of the sweep\n" +
            curve_grid(matrix[c]);
  }
  const std::vector<std::string> notes{
      "Bias, its 95 % interval, variance and errors are relative to the exact answer. Slope: of "
      "the "
      "logarithm of the mean square error against that of the shadow rays, -1 for independent "
      "samples, with the half width of its interval. us: CPU time of one estimate. Err x us: mean "
      "square error times that; at equal time the smaller one is better."};
  return text + terminal_notes(notes) + summary(result);
}

}  // namespace penumbra::stability
