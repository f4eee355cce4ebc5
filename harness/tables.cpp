#include "harness/tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "harness/statistics.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

// ---- Columns: one list per table, for header, writer and reader ---------------------------------

constexpr std::array<std::string_view, 2> kStatusTexts{"ok", "failed"};
constexpr std::array<std::string_view, 6> kVerdictTexts{
    "baseline", "better", "worse", "inconclusive", "reference_limited", "failed"};

template <class Enum, std::size_t n>
bool parse_enum(std::string_view text, const std::array<std::string_view, n>& texts, Enum& value) {
  const auto found = std::find(texts.begin(), texts.end(), text);
  if (found == texts.end()) return false;
  value = static_cast<Enum>(found - texts.begin());
  return true;
}

template <class T>
std::string text_of(const T& value) {
  if constexpr (std::is_same_v<T, RunStatus>) {
    return std::string(kStatusTexts[static_cast<std::size_t>(value)]);
  } else if constexpr (std::is_same_v<T, Verdict>) {
    return std::string(verdict_text(value));
  } else {
    return csv_text(value);
  }
}

template <class T>
bool parse(std::string_view text, T& value) {
  if constexpr (std::is_same_v<T, RunStatus>) {
    return parse_enum(text, kStatusTexts, value);
  } else if constexpr (std::is_same_v<T, Verdict>) {
    return parse_enum(text, kVerdictTexts, value);
  } else {
    return parse_csv(text, value);
  }
}

template <class Row>
struct Column {
  std::string_view name;
  std::string (*text)(const Row&);
  bool (*parse)(std::string_view, Row&);
};

template <class Row, class T>
Row row_of(T Row::*);

template <auto member, class Row = decltype(row_of(member))>
constexpr Column<Row> column(std::string_view name) {
  return {name, [](const Row& row) { return text_of(row.*member); },
          [](std::string_view text, Row& row) { return parse(text, row.*member); }};
}

// The column whose name is its member's.
#define PN_RUN(name) column<&RunRow::name>(#name)
#define PN_EFF(name) column<&EfficiencyRow::name>(#name)

// clang-format off
constexpr std::array kRunColumns{
    PN_RUN(run_id), PN_RUN(scene), PN_RUN(label), PN_RUN(estimator), PN_RUN(sampler), PN_RUN(spp),
    PN_RUN(srl), PN_RUN(srl_initial), PN_RUN(srl_adaptive), PN_RUN(population), PN_RUN(iterations),
    PN_RUN(budget_s), PN_RUN(block), PN_RUN(seed), PN_RUN(width), PN_RUN(height), PN_RUN(threads),
    PN_RUN(estimates), PN_RUN(rays), PN_RUN(time_wall_s), PN_RUN(time_cpu_s),
    PN_RUN(time_prepare_s), PN_RUN(instructions), PN_RUN(mse), PN_RUN(mse_naive), PN_RUN(relmse),
    PN_RUN(mape), PN_RUN(mean_error), PN_RUN(p_eff), PN_RUN(reference_id), PN_RUN(reference_share),
    PN_RUN(nonfinite), PN_RUN(status),
    PN_RUN(cell), PN_RUN(params), PN_RUN(camera_samples), PN_RUN(samples), PN_RUN(order),
    PN_RUN(failure), PN_RUN(reference_mean), PN_RUN(reference_mean_se), PN_RUN(reference_floor)};

constexpr std::array kEfficiencyColumns{
    PN_EFF(scene), PN_EFF(label), PN_EFF(estimator), PN_EFF(spp), PN_EFF(srl), PN_EFF(population),
    PN_EFF(n_blocks), column<&EfficiencyRow::time_wall_s>("T_s"), PN_EFF(err), PN_EFF(eff),
    PN_EFF(eff_lo), PN_EFF(eff_hi), PN_EFF(ratio), PN_EFF(ratio_lo), PN_EFF(ratio_hi),
    PN_EFF(eff_cpu), PN_EFF(eff_rays), PN_EFF(eff_instructions), PN_EFF(bias_rel), PN_EFF(bias_p),
    PN_EFF(verdict),
    PN_EFF(sampler), PN_EFF(params), PN_EFF(budget_s), PN_EFF(baseline), PN_EFF(err_lo),
    PN_EFF(err_hi), PN_EFF(relmse), PN_EFF(p_eff), PN_EFF(reference_share), PN_EFF(ratio_tuned),
    PN_EFF(ratio_tuned_lo), PN_EFF(ratio_tuned_hi),
    column<&EfficiencyRow::time_cpu_s>("T_cpu_s"), PN_EFF(srl_initial), PN_EFF(srl_adaptive),
    PN_EFF(note)};
// clang-format on

#undef PN_RUN
#undef PN_EFF

template <class Columns>
CsvRecord names_of(const Columns& columns) {
  CsvRecord names;
  for (const auto& c : columns) names.emplace_back(c.name);
  return names;
}

template <class Columns, class Row>
CsvRecord record_of(const Columns& columns, const Row& row) {
  CsvRecord record;
  for (const auto& c : columns) record.push_back(c.text(row));
  return record;
}

/// @return place of each column in the file. @throws InputError listing missing and unknown ones
template <class Columns>
std::vector<std::size_t> places_of(const Columns& columns, const CsvTable& table,
                                   const std::filesystem::path& file) {
  std::set<std::string_view> unknown(table.header.begin(), table.header.end());
  std::vector<std::string_view> missing;
  std::vector<std::size_t> places;
  for (const auto& c : columns) {
    unknown.erase(c.name);
    const std::optional<std::size_t> place = table.column(c.name);
    if (!place) missing.push_back(c.name);
    places.push_back(place.value_or(0));
  }
  if (missing.empty() && unknown.empty()) return places;
  throw InputError(fmt::format("{}:1: missing columns: \"{}\"; unknown columns: \"{}\"",
                               file.string(), fmt::join(missing, ","), fmt::join(unknown, ",")));
}

template <class Row, class Columns>
std::vector<Row> rows_of(const Columns& columns, const CsvTable& table,
                         const std::filesystem::path& file) {
  std::vector<Row> rows;
  if (table.header.empty()) return rows;
  const std::vector<std::size_t> places = places_of(columns, table, file);
  for (const CsvRecord& record : table.rows) {
    Row& row = rows.emplace_back();
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const std::string& text = record[places[i]];
      if (columns[i].parse(text, row)) continue;
      throw InputError(fmt::format("{}: row {}: column {}: \"{}\" is not a value of it",
                                   file.string(), rows.size(), columns[i].name, text));
    }
  }
  return rows;
}

// ---- Cells --------------------------------------------------------------------------------------

/// Runs of one cell and what has been worked out of them.
struct Cell {
  std::map<int, const RunRow*> blocks;
  EfficiencyRow row;
  double floor{0};
  bool comparable{false};  // has an efficiency
};

auto key_of(const RunRow& r) {
  return std::tie(r.scene, r.budget_s, r.sampler, r.label, r.estimator, r.srl, r.srl_initial,
                  r.srl_adaptive, r.population, r.spp, r.params);
}

void check_reference(std::map<std::string, std::string>& references, const RunRow& row) {
  if (row.reference_id.empty()) return;
  const auto [place, added] = references.emplace(row.scene, row.reference_id);
  if (added || place->second == row.reference_id) return;
  throw ReferenceError(
      fmt::format("scene \"{}\": run {} was measured against reference {}, others against {}; "
                  "measure them again",
                  row.scene, row.run_id, row.reference_id, place->second));
}

EfficiencyRow identity_of(const RunRow& run, const TableOptions& options) {
  EfficiencyRow row;
  row.scene = run.scene;
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

std::vector<Cell> group_cells(std::span<const RunRow> rows, const TableOptions& options) {
  std::map<decltype(key_of(rows[0])), Cell> cells;
  std::map<std::string, std::string> references;
  for (const RunRow& run : rows) {
    check_reference(references, run);
    Cell& cell = cells[key_of(run)];
    if (cell.blocks.empty()) cell.row = identity_of(run, options);
    const auto [place, added] = cell.blocks.emplace(run.block, &run);
    if (!added) {
      throw InputError(
          fmt::format("scene \"{}\", \"{}\": block {} was measured twice, as {} and {}", run.scene,
                      run.label, run.block, place->second->run_id, run.run_id));
    }
  }
  std::vector<Cell> result;
  for (auto& [key, cell] : cells) result.push_back(std::move(cell));
  return result;
}

bool is_number(const std::optional<double>& value) { return value && std::isfinite(*value); }

/// @return why the run cannot be used; empty when it can
std::string fault_of(const RunRow& run) {
  if (run.status == RunStatus::Failed) return run.failure.empty() ? "failed" : run.failure;
  if (run.nonfinite > 0) return fmt::format("{} pixels not finite", run.nonfinite);
  if (!is_number(run.mse) || !is_number(run.mean_error)) return "no finite error";
  if (!is_number(run.time_wall_s) || !is_number(run.time_cpu_s)) return "no time";
  return {};
}

/// Mean of a column over blocks. @return empty when a block lacks it
template <class T>
std::optional<double> mean_of(const Cell& cell, std::optional<T> RunRow::*member) {
  Welford values;
  for (const auto& [block, run] : cell.blocks) {
    if (!(run->*member)) return std::nullopt;
    values.add(static_cast<double>(*(run->*member)));
  }
  return values.mean();
}

std::optional<double> inverse_product(std::optional<double> cost, std::optional<double> error) {
  if (!cost || !error || *cost <= 0 || *error <= 0) return std::nullopt;
  return 1.0 / (*cost * *error);
}

std::optional<double> harmonic_p_eff(const Cell& cell) {
  Welford inverse;
  for (const auto& [block, run] : cell.blocks) {
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
  const RunRow& first = *cell.blocks.begin()->second;
  cell.floor = first.reference_floor.value_or(0);
  Welford errors;
  Welford biases;
  for (const auto& [block, run] : cell.blocks) {
    errors.add(*run->mse);
    biases.add(*run->mean_error);
  }
  row.err = errors.mean();
  if (const auto interval = mean_interval(errors, confidence, cell.floor)) {
    row.err_lo = interval->lo;
    row.err_hi = interval->hi;
  }
  row.relmse = mean_of(cell, &RunRow::relmse);
  row.p_eff = harmonic_p_eff(cell);
  // mse_naive - mse is the variance of the reference, exactly (statistics.md 3.1).
  const std::optional<double> naive = mean_of(cell, &RunRow::mse_naive);
  if (naive && *row.err > 0) row.reference_share = (*naive - *row.err) / *row.err;
  if (is_number(first.reference_mean) && *first.reference_mean != 0) {
    row.bias_rel = biases.mean() / *first.reference_mean;
  }
  row.bias_p = zero_mean_p(biases, first.reference_mean_se.value_or(0));
}

void add_efficiency(Cell& cell, double confidence) {
  EfficiencyRow& row = cell.row;
  if (row.reference_share.value_or(0) > 0.5) {
    row.verdict = Verdict::ReferenceLimited;
    add_note(row, "more than half of the error is the reference's");
    return;
  }
  std::vector<CostError> blocks;
  for (const auto& [block, run] : cell.blocks) blocks.push_back({*run->time_wall_s, *run->mse});
  const EfficiencyEstimate estimate = log_efficiency(blocks, {confidence, cell.floor});
  if (!estimate.log) {
    if (estimate.reason == NoEstimate::BelowReferenceNoise) {
      row.verdict = Verdict::ReferenceLimited;
    }
    add_note(row, reason_text(estimate.reason));
    return;
  }
  cell.comparable = true;
  row.eff = std::exp(estimate.log->value);
  if (estimate.log->interval) {
    row.eff_lo = std::exp(estimate.log->interval->lo);
    row.eff_hi = std::exp(estimate.log->interval->hi);
  } else {
    add_note(row, "one block: no interval");
  }
  Welford rays;
  for (const auto& [block, run] : cell.blocks) rays.add(static_cast<double>(run->rays));
  row.eff_cpu = inverse_product(row.time_cpu_s, row.err);
  row.eff_rays = inverse_product(rays.mean(), row.err);
  row.eff_instructions = inverse_product(mean_of(cell, &RunRow::instructions), row.err);
}

void summarise(Cell& cell, double confidence) {
  EfficiencyRow& row = cell.row;
  row.n_blocks = static_cast<int>(cell.blocks.size());
  int faults = 0;
  std::string first_fault;
  for (const auto& [block, run] : cell.blocks) {
    const std::string fault = fault_of(*run);
    if (fault.empty()) continue;
    if (faults++ == 0) first_fault = fmt::format("run {}: {}", run->run_id, fault);
  }
  if (faults > 0) {
    row.verdict = Verdict::Failed;
    add_note(row, fmt::format("{} of {} runs failed, {}", faults, row.n_blocks, first_fault));
    return;
  }
  row.time_wall_s = mean_of(cell, &RunRow::time_wall_s);
  row.time_cpu_s = mean_of(cell, &RunRow::time_cpu_s);
  add_errors(cell, confidence);
  add_efficiency(cell, confidence);
}

// ---- Ratios -------------------------------------------------------------------------------------

struct Ratio {
  std::optional<double> value, lo, hi;
  std::string fault;
};

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

CostError cost_error(const RunRow& run, PrimaryTime primary) {
  return {primary == PrimaryTime::Cpu ? *run.time_cpu_s : *run.time_wall_s, *run.mse};
}

Ratio ratio_of(const Cell& cell, const Cell& baseline, const TableOptions& options) {
  if (&cell == &baseline) return {1.0, 1.0, 1.0, {}};
  if (!baseline.comparable) {
    return {{}, {}, {}, fmt::format("baseline {} has no efficiency", baseline.row.label)};
  }
  std::vector<PairedCostError> blocks;
  for (const auto& [block, run] : cell.blocks) {
    const auto other = baseline.blocks.find(block);
    if (other == baseline.blocks.end()) continue;
    blocks.push_back(
        {cost_error(*run, options.primary), cost_error(*other->second, options.primary)});
  }
  const EfficiencyEstimate estimate =
      log_efficiency_ratio(blocks, {options.confidence, cell.floor});
  if (!estimate.log) return {{}, {}, {}, std::string(reason_text(estimate.reason))};
  Ratio ratio{std::exp(estimate.log->value), {}, {}, {}};
  if (estimate.log->interval) {
    ratio.lo = std::exp(estimate.log->interval->lo);
    ratio.hi = std::exp(estimate.log->interval->hi);
  }
  return ratio;
}

Ratio compare(const Cell& cell, const std::vector<Cell>& cells, const std::string& label,
              const std::string& sampler, const TableOptions& options) {
  // A baseline that is swept is its own measure in each of its cells.
  if (cell.row.label == label) return ratio_of(cell, cell, options);
  Ratio none;
  const Cell* const baseline = find_baseline(cells, cell.row, label, sampler, none.fault);
  return baseline ? ratio_of(cell, *baseline, options) : none;
}

/// The row of a cell with its ratios and verdict; the cells stay as they are.
EfficiencyRow compared(const Cell& cell, const std::vector<Cell>& cells,
                       const TableOptions& options) {
  EfficiencyRow row = cell.row;
  if (!cell.comparable) return row;
  const Ratio plain = compare(cell, cells, options.baseline, row.sampler, options);
  row.ratio = plain.value;
  row.ratio_lo = plain.lo;
  row.ratio_hi = plain.hi;
  if (!plain.fault.empty()) add_note(row, "ratio: " + plain.fault);
  if (row.label == options.baseline) {
    row.verdict = Verdict::Baseline;
  } else if (plain.lo && *plain.lo > 1) {
    row.verdict = Verdict::Better;
  } else if (plain.hi && *plain.hi < 1) {
    row.verdict = Verdict::Worse;
  }
  if (!options.tuned_baseline) return row;
  const Ratio tuned = compare(cell, cells, *options.tuned_baseline, "", options);
  row.ratio_tuned = tuned.value;
  row.ratio_tuned_lo = tuned.lo;
  row.ratio_tuned_hi = tuned.hi;
  if (!tuned.fault.empty()) add_note(row, "ratio_tuned: " + tuned.fault);
  return row;
}

std::size_t rank_of(const std::string& name, const std::vector<std::string>& order) {
  return static_cast<std::size_t>(std::find(order.begin(), order.end(), name) - order.begin());
}

// ---- Text ---------------------------------------------------------------------------------------

constexpr double kShareWarning = 0.05;
constexpr double kPixelWarning = 200;
constexpr std::size_t kTerminalWidth = 119;
constexpr std::size_t kShortestName = 6;

using Grid = std::vector<std::vector<std::string>>;  // [line][column], line 0 the titles

/// Three significant digits, without the padding of the exponent.
std::string number(double value) {
  const double size = std::abs(value);
  if (!std::isfinite(value) || value == 0) return fmt::format("{:g}", value);
  if (size < 1e-3 || size >= 99950) {
    const std::string text = fmt::format("{:.2e}", value);
    const std::size_t e = text.find('e');
    return text.substr(0, e + 1) + std::to_string(std::stoi(text.substr(e + 1)));
  }
  if (size >= 99.95) return fmt::format("{:.0f}", value);
  const int digits = 2 - static_cast<int>(std::floor(std::log10(size) + 1e-12));
  return fmt::format("{:.{}f}", value, std::max(digits, 0));
}

std::string number(const std::optional<double>& value) { return value ? number(*value) : "-"; }

std::string seconds(const std::optional<double>& value) {
  if (!value) return "-";
  if (*value >= 1) return number(*value) + " s";
  return *value >= 1e-3 ? number(*value * 1e3) + " ms" : number(*value * 1e6) + " us";
}

std::string ratio_number(double value) {
  return value >= 0.01 && value < 99.995 ? fmt::format("{:.2f}", value) : number(value);
}

std::string interval(const std::optional<double>& value, const std::optional<double>& lo,
                     const std::optional<double>& hi) {
  if (!value) return "-";
  const bool exact = lo == value && hi == value;  // of a baseline to itself
  if (!lo || !hi || exact) return ratio_number(*value);
  return fmt::format("{} [{}, {}]", ratio_number(*value), ratio_number(*lo), ratio_number(*hi));
}

std::string srl_text(const EfficiencyRow& row) {
  if (row.srl_adaptive == 0) return std::to_string(row.srl);
  return fmt::format("{}-{}", row.srl_initial, row.srl_adaptive);
}

bool noisy_reference(const EfficiencyRow& row) {
  return row.reference_share.value_or(0) > kShareWarning;
}

bool few_pixels(const EfficiencyRow& row) {
  return row.p_eff.has_value() && *row.p_eff < kPixelWarning;
}

std::string error_text(const EfficiencyRow& row) {
  return number(row.err) + (noisy_reference(row) ? "r" : "") + (few_pixels(row) ? "p" : "");
}

std::string eff_text(const EfficiencyRow& row, const TableOptions& options) {
  return number(options.primary == PrimaryTime::Cpu ? row.eff_cpu : row.eff);
}

std::string percent(const std::optional<double>& value) {
  return value ? fmt::format("{:+.2f} %", 100 * *value) : "-";
}

std::string shown_verdict(Verdict verdict) {
  if (verdict == Verdict::ReferenceLimited) return "ref-limited";
  return std::string(verdict_text(verdict));
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

/// Length in code points.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::vector<std::size_t> widths_of(const Grid& grid) {
  std::vector<std::size_t> widths(grid[0].size(), 0);
  for (const auto& line : grid) {
    for (std::size_t c = 0; c < line.size(); ++c)
      widths[c] = std::max(widths[c], width_of(line[c]));
  }
  return widths;
}

/// Text columns to the left, numbers to the right.
std::string padded(const std::string& text, std::size_t width, bool is_text) {
  const std::string blanks(width - std::min(width, width_of(text)), ' ');
  return is_text ? text + blanks : blanks + text;
}

/// Keeps both ends, where names differ. Bytes of one code point stay together.
std::string shortened(const std::string& text, std::size_t width) {
  if (width_of(text) <= width) return text;
  std::vector<std::string> points;
  for (const char c : text) {
    if ((c & 0xC0) != 0x80) points.emplace_back();
    points.back() += c;
  }
  const std::size_t tail = (width - 1) / 2;
  const std::size_t head = width - 1 - tail;
  std::string result;
  for (std::size_t i = 0; i < head; ++i) result += points[i];
  result += '~';
  for (std::size_t i = points.size() - tail; i < points.size(); ++i) result += points[i];
  return result;
}

std::vector<std::string> footnotes(std::span<const EfficiencyRow> rows,
                                   const TableOptions& options) {
  std::vector<std::string> notes;
  const std::string_view time = options.primary == PrimaryTime::Cpu ? "CPU" : "wall";
  notes.push_back(fmt::format(
      "Eff: 1/(T x MSE) in {} time. Ratio: over that of \"{}\" in the same blocks; in brackets its "
      "{:g} % interval (block jackknife of the ratio of means, t).",
      time, options.baseline, 100 * options.confidence));
  notes.push_back(
      fmt::format("MSE is debiased; relMSE divides by reference^2 + {:g} mean(reference)^2.",
                  options.relmse_epsilon));
  if (std::any_of(rows.begin(), rows.end(), noisy_reference)) {
    notes.push_back("r: the reference's own variance is more than 5 % of this MSE.");
  }
  if (std::any_of(rows.begin(), rows.end(), few_pixels)) {
    notes.push_back("p: fewer than 200 effective pixels decide this MSE; trust relMSE.");
  }
  for (const EfficiencyRow& row : rows) {
    if (row.note.empty()) continue;
    notes.push_back(fmt::format("{}, {} ({}, SRL {}): {}.", row.scene, label_text(row, rows),
                                row.sampler, srl_text(row), row.note));
  }
  return notes;
}

std::string escaped(std::string text) {
  for (std::size_t i = 0; (i = text.find('|', i)) != std::string::npos; i += 2)
    text.insert(i, "\\");
  return text;
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
constexpr std::array<ShownColumn, 17> kShownColumns{{
    {"Scene", true, true, [](const auto& r, const auto&) { return r.scene; }},
    {"Label", true, true, [](const auto& r, const auto& c) { return label_text(r, c.rows); }},
    {"Sampler", true, true, [](const auto& r, const auto&) { return r.sampler; }},
    {"Budget", false, false, [](const auto& r, const auto&) { return seconds(r.budget_s); }},
    {"SPP", false, true, [](const auto& r, const auto&) { return std::to_string(r.spp); }},
    {"SRL", false, true, [](const auto& r, const auto&) { return srl_text(r); }},
    {"Pop", false, true, [](const auto& r, const auto&) { return population_text(r); }},
    {"Blocks", false, false, [](const auto& r, const auto&) { return std::to_string(r.n_blocks); }},
    {"T_cpu", false, true, [](const auto& r, const auto&) { return seconds(r.time_cpu_s); }},
    {"MSE", false, true, [](const auto& r, const auto&) { return error_text(r); }},
    {"relMSE", false, true, [](const auto& r, const auto&) { return number(r.relmse); }},
    {"Eff", false, true, [](const auto& r, const auto& c) { return eff_text(r, c.options); }},
    {"Ratio", false, true, [](const auto& r, const auto&) {
       return interval(r.ratio, r.ratio_lo, r.ratio_hi); }},
    {"Ratio to tuned", false, false, [](const auto& r, const auto&) {
       return interval(r.ratio_tuned, r.ratio_tuned_lo, r.ratio_tuned_hi); }},
    {"Bias", false, false, [](const auto& r, const auto&) { return percent(r.bias_rel); }},
    {"Bias p", false, false, [](const auto& r, const auto&) { return number(r.bias_p); }},
    {"Verdict", true, true, [](const auto& r, const auto&) { return shown_verdict(r.verdict); }},
}};
// clang-format on

Grid grid_of(const TableContext& context, const std::vector<ShownColumn>& columns) {
  Grid grid(1);
  for (const ShownColumn& c : columns) grid[0].emplace_back(c.title);
  for (const EfficiencyRow& row : context.rows) {
    auto& line = grid.emplace_back();
    for (const ShownColumn& c : columns) line.push_back(c.text(row, context));
  }
  return grid;
}

/// Narrows the widest of the name columns until the line fits.
void fit_names(std::vector<std::size_t>& widths, const std::vector<ShownColumn>& columns) {
  std::size_t total = widths.size() - 1;
  for (const std::size_t width : widths) total += width;
  for (; total > kTerminalWidth; --total) {
    std::size_t widest = 0;  // the first three columns are names
    for (std::size_t c = 1; c < 3; ++c) {
      if (columns[c].is_text && widths[c] > widths[widest]) widest = c;
    }
    if (widths[widest] <= kShortestName) return;
    --widths[widest];
  }
}

/// Breaks at blanks, or inside a word that is too long for a line.
std::string wrapped(const std::string& text, std::size_t width) {
  std::string result;
  std::size_t start = 0;
  while (text.size() - start > width) {
    std::size_t end = text.rfind(' ', start + width);
    if (end == std::string::npos || end <= start) end = start + width;
    result += text.substr(start, end - start) + "\n";
    start = text[end] == ' ' ? end + 1 : end;
  }
  return result + text.substr(start) + "\n";
}

std::string without_line_ends(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

}  // namespace

std::string_view verdict_text(Verdict verdict) noexcept {
  return kVerdictTexts[static_cast<std::size_t>(verdict)];
}

CsvRecord run_columns() { return names_of(kRunColumns); }

CsvRecord efficiency_columns() { return names_of(kEfficiencyColumns); }

CsvRecord run_record(const RunRow& row) { return record_of(kRunColumns, row); }

RunRows read_run_rows(const std::filesystem::path& file) {
  const CsvTable table = read_csv(file);
  return {rows_of<RunRow>(kRunColumns, table, file), table.torn_tail};
}

std::vector<EfficiencyRow> read_efficiency_rows(const std::filesystem::path& file) {
  const CsvTable table = read_csv(file);
  if (table.torn_tail) {
    throw InputError(
        fmt::format("{}: the last line is incomplete; make the report again", file.string()));
  }
  return rows_of<EfficiencyRow>(kEfficiencyColumns, table, file);
}

std::vector<EfficiencyRow> efficiency_table(std::span<const RunRow> rows,
                                            const TableOptions& options) {
  if (rows.empty()) return {};
  std::vector<Cell> cells = group_cells(rows, options);
  for (Cell& cell : cells) summarise(cell, options.confidence);
  std::vector<EfficiencyRow> result;
  for (const Cell& cell : cells) result.push_back(compared(cell, cells, options));
  // What is equal here keeps the order of key_of.
  const auto place = [&](const EfficiencyRow& row) {
    return std::tuple(rank_of(row.scene, options.scenes), row.scene, row.budget_s, row.sampler,
                      rank_of(row.label, options.labels), row.label);
  };
  std::stable_sort(result.begin(), result.end(),
                   [&](const auto& left, const auto& right) { return place(left) < place(right); });
  return result;
}

std::string to_csv(std::span<const EfficiencyRow> rows) {
  std::string text = csv_line(efficiency_columns());
  for (const EfficiencyRow& row : rows) text += csv_line(record_of(kEfficiencyColumns, row));
  return text;
}

std::string to_markdown(std::span<const EfficiencyRow> rows, const TableOptions& options) {
  const TableContext context{rows, options};
  const std::vector<ShownColumn> columns(kShownColumns.begin(), kShownColumns.end());
  Grid grid = grid_of(context, columns);
  for (auto& line : grid) {
    for (std::string& field : line) field = escaped(without_line_ends(field));
  }
  const std::vector<std::size_t> widths = widths_of(grid);
  std::string text;
  for (std::size_t l = 0; l < grid.size(); ++l) {
    text += "|";
    for (std::size_t c = 0; c < columns.size(); ++c) {
      text += " " + padded(grid[l][c], widths[c], columns[c].is_text) + " |";
    }
    text += "\n";
    if (l > 0) continue;
    text += "|";
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const std::string dashes(widths[c], '-');
      text += columns[c].is_text ? ":" + dashes + "-|" : "-" + dashes + ":|";
    }
    text += "\n";
  }
  text += "\n";
  for (const std::string& note : footnotes(rows, options)) {
    text += "- " + escaped(without_line_ends(note)) + "\n";
  }
  return text;
}

std::string to_terminal(std::span<const EfficiencyRow> rows, const TableOptions& options) {
  const TableContext context{rows, options};
  std::vector<ShownColumn> columns;
  for (const ShownColumn& c : kShownColumns) {
    if (c.in_terminal) columns.push_back(c);
  }
  const Grid grid = grid_of(context, columns);
  std::vector<std::size_t> widths = widths_of(grid);
  fit_names(widths, columns);
  std::string text;
  for (const auto& line : grid) {
    std::string out;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const std::string field = c < 3 ? shortened(line[c], widths[c]) : line[c];
      out += (c > 0 ? " " : "") + padded(field, widths[c], columns[c].is_text);
    }
    out.erase(out.find_last_not_of(' ') + 1);
    text += out + "\n";
  }
  for (const std::string& note : footnotes(rows, options)) {
    text += wrapped(without_line_ends(note), kTerminalWidth);
  }
  return text;
}

}  // namespace penumbra
