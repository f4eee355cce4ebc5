#include "harness/run_row.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>
#include <type_traits>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr std::array<std::string_view, 2> kStatusTexts{"ok", "failed"};
constexpr std::array<std::string_view, 7> kVerdictTexts{
    "baseline", "better", "worse", "inconclusive", "reference_limited", "failed", "exact"};

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
  bool required{true};  // otherwise absent from files of older versions
};

template <class Row, class T>
Row row_of(T Row::*);

template <auto member, class Row = decltype(row_of(member))>
constexpr Column<Row> column(std::string_view name) {
  return {name, [](const Row& row) { return text_of(row.*member); },
          [](std::string_view text, Row& row) { return parse(text, row.*member); }};
}

template <auto member, class Row = decltype(row_of(member))>
constexpr Column<Row> later_column(std::string_view name) {
  Column<Row> result = column<member>(name);
  result.required = false;
  return result;
}

// The column whose name is its member's.
#define PN_RUN(name) column<&RunRow::name>(#name)
#define PN_EFF(name) column<&EfficiencyRow::name>(#name)

// One list per table, for header, writer and reader.
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
    PN_RUN(failure), PN_RUN(reference_mean), PN_RUN(reference_mean_se), PN_RUN(reference_floor),
    later_column<&RunRow::image_hash>("image_hash"),
    later_column<&RunRow::geometry>("geometry"),
    later_column<&RunRow::relmse_trim>("relmse_trim"),
    later_column<&RunRow::reference_spp>("reference_spp")};

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
    PN_EFF(note), later_column<&EfficiencyRow::ratio_published>("ratio_published"),
    later_column<&EfficiencyRow::geometry>("geometry"),
    later_column<&EfficiencyRow::variance>("variance"),
    later_column<&EfficiencyRow::bias2>("bias2"),
    later_column<&EfficiencyRow::p_eff_runs>("p_eff_runs"),
    later_column<&EfficiencyRow::bias_smallest_p>("bias_smallest_p"),
    later_column<&EfficiencyRow::bias_tost>("bias_tost")};
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

/// @return place of each column in the file, none for one that older versions did not write
/// @throws InputError listing missing and unknown ones
template <class Columns>
std::vector<std::optional<std::size_t>> places_of(const Columns& columns, const CsvTable& table,
                                                  const std::filesystem::path& file) {
  std::set<std::string_view> unknown(table.header.begin(), table.header.end());
  std::vector<std::string_view> missing;
  std::vector<std::optional<std::size_t>> places;
  for (const auto& c : columns) {
    unknown.erase(c.name);
    const std::optional<std::size_t> place = table.column(c.name);
    if (!place && c.required) missing.push_back(c.name);
    places.push_back(place);
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
  const std::vector<std::optional<std::size_t>> places = places_of(columns, table, file);
  for (const CsvRecord& record : table.rows) {
    Row& row = rows.emplace_back();
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (!places[i]) continue;
      const std::string& text = record[*places[i]];
      if (columns[i].parse(text, row)) continue;
      throw InputError(fmt::format("{}: row {}: column {}: \"{}\" is not a value of it",
                                   file.string(), rows.size(), columns[i].name, text));
    }
  }
  return rows;
}

}  // namespace

std::string_view verdict_text(Verdict verdict) noexcept {
  return kVerdictTexts[static_cast<std::size_t>(verdict)];
}

CsvRecord run_columns() { return names_of(kRunColumns); }

CsvRecord efficiency_columns() { return names_of(kEfficiencyColumns); }

CsvRecord run_record(const RunRow& row) { return record_of(kRunColumns, row); }

CsvRecord efficiency_record(const EfficiencyRow& row) { return record_of(kEfficiencyColumns, row); }

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

}  // namespace penumbra
