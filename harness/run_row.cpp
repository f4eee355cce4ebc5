#include "harness/run_row.h"

#include <algorithm>
#include <array>

#include "harness/table_columns.h"

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

// The column whose name is its member's.
#define PN_RUN(name) column<&RunRow::name>(#name)
#define PN_EFF(name) column<&EfficiencyRow::name>(#name)
#define PN_LATER_EFF(name) later_column<&EfficiencyRow::name>(#name)

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
    later_column<&RunRow::attempt>("attempt"),
    later_column<&RunRow::contaminated>("contaminated"),
    later_column<&RunRow::load_average>("load_average"),
    later_column<&RunRow::steal_share>("steal_share"),
    later_column<&RunRow::switches_voluntary>("switches_voluntary"),
    later_column<&RunRow::switches_involuntary>("switches_involuntary"),
    later_column<&RunRow::relmse_trim>("relmse_trim"),
    later_column<&RunRow::reference_spp>("reference_spp"),
    later_column<&RunRow::build>("build"),
    later_column<&RunRow::machine>("machine"),
    later_column<&RunRow::host>("host")};

// Of radiance; of irradiance the square of W/m^2.
constexpr std::string_view kErrorUnit = "(W/(m^2 sr))^2";
constexpr std::string_view kPerSecond = "1/(s (W/(m^2 sr))^2)";

constexpr std::array kEfficiencyColumns{
    PN_EFF(scene), PN_EFF(label), PN_EFF(estimator), PN_EFF(spp), PN_EFF(srl), PN_EFF(population),
    PN_EFF(n_blocks), column<&EfficiencyRow::time_wall_s>("T_s", "s"),
    column<&EfficiencyRow::err>("err", kErrorUnit), column<&EfficiencyRow::eff>("eff", kPerSecond),
    column<&EfficiencyRow::eff_lo>("eff_lo", kPerSecond),
    column<&EfficiencyRow::eff_hi>("eff_hi", kPerSecond),
    PN_EFF(ratio), PN_EFF(ratio_lo), PN_EFF(ratio_hi),
    column<&EfficiencyRow::eff_cpu>("eff_cpu", kPerSecond),
    column<&EfficiencyRow::eff_rays>("eff_rays", "1/(ray (W/(m^2 sr))^2)"),
    column<&EfficiencyRow::eff_instructions>("eff_instructions", "1/(instruction (W/(m^2 sr))^2)"),
    PN_EFF(bias_rel), PN_EFF(bias_p), PN_EFF(verdict),
    PN_EFF(sampler), PN_EFF(params), column<&EfficiencyRow::budget_s>("budget_s", "s"),
    PN_EFF(baseline), column<&EfficiencyRow::err_lo>("err_lo", kErrorUnit),
    column<&EfficiencyRow::err_hi>("err_hi", kErrorUnit), PN_EFF(relmse),
    column<&EfficiencyRow::p_eff>("p_eff", "pixels"), PN_EFF(reference_share), PN_EFF(ratio_tuned),
    PN_EFF(ratio_tuned_lo), PN_EFF(ratio_tuned_hi),
    column<&EfficiencyRow::time_cpu_s>("T_cpu_s", "s"), PN_EFF(srl_initial), PN_EFF(srl_adaptive),
    PN_EFF(note), PN_LATER_EFF(ratio_published), PN_LATER_EFF(geometry),
    PN_LATER_EFF(ratio_wall), PN_LATER_EFF(ratio_wall_lo), PN_LATER_EFF(ratio_wall_hi),
    PN_LATER_EFF(ratio_rays), PN_LATER_EFF(ratio_rays_lo), PN_LATER_EFF(ratio_rays_hi),
    PN_LATER_EFF(ratio_instructions), PN_LATER_EFF(ratio_instructions_lo),
    PN_LATER_EFF(ratio_instructions_hi), PN_LATER_EFF(ratio_blocks), PN_LATER_EFF(log_ratio_se),
    PN_LATER_EFF(detectable), PN_LATER_EFF(ratio_tuned_blocks), PN_LATER_EFF(log_ratio_tuned_se),
    PN_LATER_EFF(bias_p_holm), PN_LATER_EFF(best_of),
    PN_LATER_EFF(n_contaminated),
    later_column<&EfficiencyRow::variance>("variance", kErrorUnit),
    later_column<&EfficiencyRow::bias2>("bias2", kErrorUnit),
    later_column<&EfficiencyRow::p_eff_runs>("p_eff_runs", "pixels"),
    PN_LATER_EFF(bias_smallest_p), PN_LATER_EFF(bias_tost),
    PN_LATER_EFF(bias_rel_lo), PN_LATER_EFF(bias_rel_hi)};
// clang-format on

#undef PN_RUN
#undef PN_EFF
#undef PN_LATER_EFF

}  // namespace

std::string_view verdict_text(Verdict verdict) noexcept {
  return kVerdictTexts[static_cast<std::size_t>(verdict)];
}

std::string csv_text(RunStatus status) {
  return std::string(kStatusTexts[static_cast<std::size_t>(status)]);
}

std::string csv_text(Verdict verdict) { return std::string(verdict_text(verdict)); }

bool parse_csv(std::string_view text, RunStatus& status) {
  return parse_enum(text, kStatusTexts, status);
}

bool parse_csv(std::string_view text, Verdict& verdict) {
  return parse_enum(text, kVerdictTexts, verdict);
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
  return read_whole_table<EfficiencyRow>(kEfficiencyColumns, file);
}

std::span<const Column<RunRow>> run_table_columns() { return kRunColumns; }

std::span<const Column<EfficiencyRow>> efficiency_table_columns() { return kEfficiencyColumns; }

}  // namespace penumbra
