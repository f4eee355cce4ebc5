#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/csv.h"
#include "harness/table_columns.h"

/// The rows of measurements.csv and efficiency.csv, and how they are written and read.
/// Source: design.md section 9.
namespace penumbra {

enum class RunStatus { Ok, Failed };

/// One run, as a line of measurements.csv: one member per column, in the columns' order. Members
/// whose number may not exist (a failed run, a machine without counters) are optional and then an
/// empty field.
struct RunRow {
  std::string run_id;
  std::string scene;
  std::string label;
  std::string estimator;
  std::string sampler;
  int spp{0};  ///< estimates per pixel
  int srl{0};  ///< shadow rays per light, both stages
  int srl_initial{0};
  int srl_adaptive{0};  ///< 0 for estimators without an adaptive stage
  std::optional<std::int64_t> population;
  std::optional<std::int64_t> iterations;  ///< adaptive iterations of all estimates
  std::optional<double> budget_s;          ///< CPU time [s]; empty: SPP and SRL were given
  int block{0};
  std::uint64_t seed{0};
  int width{0};   ///< [pixels]
  int height{0};  ///< [pixels]
  int threads{0};
  std::uint64_t estimates{0};
  std::uint64_t rays{0};
  std::optional<double> time_wall_s;     ///< of the estimation alone
  std::optional<double> time_cpu_s;      ///< likewise, over all threads
  std::optional<double> time_prepare_s;  ///< of creating the estimator
  std::optional<std::uint64_t> instructions;
  std::optional<double> mse;  ///< metrics.h explains the errors
  std::optional<double> mse_naive;
  std::optional<double> relmse;
  std::optional<double> mape;
  std::optional<double> mean_error;
  std::optional<double> p_eff;
  std::string reference_id;
  std::optional<double> reference_share;
  std::uint64_t nonfinite{0};  ///< pixels
  RunStatus status{RunStatus::Ok};
  std::string cell;    ///< stable id of the cell
  std::string params;  ///< parameters other than their defaults, "name=value,..."
  int camera_samples{0};
  std::uint64_t samples{0};                 ///< drawn, of which `rays` were traced
  int order{0};                             ///< position in the block, whoever measures it
  std::string failure;                      ///< why the status is failed
  std::optional<double> reference_mean;     ///< in the unit of the quantity
  std::optional<double> reference_mean_se;  ///< its standard error
  std::optional<double> reference_floor;    ///< u_ref, in the unit of mse
  std::string image_hash;    ///< of all bits of the image in double precision, of failed runs too;
                             ///< empty in files of versions that did not write it
  std::string geometry;      ///< of the scene: own, generated or models; likewise
  int attempt{0};            ///< 0 first; a run whose time was disturbed is tried again
  std::string contaminated;  ///< what disturbed the time; empty: nothing seen
  std::optional<double> load_average;  ///< run_conditions.h explains these
  std::optional<double> steal_share;
  std::optional<std::int64_t> switches_voluntary;
  std::optional<std::int64_t> switches_involuntary;
  std::optional<double> relmse_trim;
  std::optional<std::int64_t> reference_spp;  ///< estimates per pixel of the reference
  std::string build;    ///< id of the program's build; environment.json has its switches by it
  std::string machine;  ///< that it was measured on (machine_text); times of others are no measure
  std::string host;     ///< name of that one

  friend bool operator==(const RunRow&, const RunRow&) = default;
};

/// What is said about a cell, the first that applies: Failed, Exact, ReferenceLimited, Baseline,
/// then the others.
enum class Verdict {
  Baseline,          ///< the ratios' denominator
  Better,            ///< ratio_lo > 1
  Worse,             ///< ratio_hi < 1
  Inconclusive,      ///< the interval holds 1, or there is none
  ReferenceLimited,  ///< more than half of the error is the reference's, or the error is not above
                     ///< 0
  Failed,            ///< at least one run failed or was not finite; all numbers are empty
  Exact,             ///< the image is the reference to the rounding of float: nothing to compare
};

std::string_view verdict_text(Verdict verdict) noexcept;

/// As in csv.h.
std::string csv_text(RunStatus status);
std::string csv_text(Verdict verdict);
bool parse_csv(std::string_view text, RunStatus& status);
bool parse_csv(std::string_view text, Verdict& verdict);

/// One cell, as a line of efficiency.csv. Times, errors and counts are means over blocks.
struct EfficiencyRow {
  std::string scene;
  std::string label;
  std::string estimator;
  int spp{0};
  int srl{0};
  std::optional<std::int64_t> population;
  int n_blocks{0};
  std::optional<double> time_wall_s;  ///< column T_s
  std::optional<double> err;          ///< debiased MSE, the paper's Err
  std::optional<double> eff;          ///< 1 / (wall time x err)
  std::optional<double> eff_lo;       ///< jackknife interval of eff
  std::optional<double> eff_hi;
  std::optional<double>
      ratio;  ///< of efficiencies in the primary time, against `baseline` in the same blocks
  std::optional<double> ratio_lo;
  std::optional<double> ratio_hi;
  std::optional<double> eff_cpu;
  std::optional<double> eff_rays;
  std::optional<double> eff_instructions;
  std::optional<double> bias_rel;  ///< mean error / mean of the reference
  std::optional<double>
      bias_p;  ///< two-sided t test of "no bias" over blocks, the reference's error included
  Verdict verdict{Verdict::Inconclusive};
  std::string sampler;
  std::string params;
  std::optional<double> budget_s;
  std::string baseline;
  std::optional<double> err_lo;  ///< t interval of err, u_ref included; may reach below 0
  std::optional<double> err_hi;
  std::optional<double> relmse;
  std::optional<double>
      p_eff;  ///< harmonic mean over blocks: its inverse is what adds up in a variance
  std::optional<double> reference_share;  ///< reference variance / err
  std::optional<double> ratio_tuned;      ///< against the tuned baseline, whatever its sampler
  std::optional<double> ratio_tuned_lo;
  std::optional<double> ratio_tuned_hi;
  std::optional<double> time_cpu_s;  ///< column T_cpu_s
  int srl_initial{0};
  int srl_adaptive{0};
  std::string note;                       ///< why a number is missing, in words
  std::optional<double> ratio_published;  ///< of published efficiencies; empty where either is
                                          ///< missing
  std::string geometry;                   ///< of the scene: own, generated or models
  /// Ratios of efficiencies in the other currencies, against the same baseline: wall time, rays,
  /// instructions.
  std::optional<double> ratio_wall, ratio_wall_lo, ratio_wall_hi;
  std::optional<double> ratio_rays, ratio_rays_lo, ratio_rays_hi;
  std::optional<double> ratio_instructions, ratio_instructions_lo, ratio_instructions_hi;
  std::optional<std::int64_t> ratio_blocks;  ///< that both have, behind all ratios
  std::optional<double> log_ratio_se;        ///< jackknife standard error of log(ratio)
  /// Smallest relative difference of efficiencies that these blocks show with 80 % power, two-sided
  /// at 5 %: 0.05 is 5 %.
  std::optional<double> detectable;
  std::optional<std::int64_t> ratio_tuned_blocks;  ///< as ratio_blocks, of ratio_tuned
  std::optional<double> log_ratio_tuned_se;
  std::optional<double> bias_p_holm;  ///< bias_p, adjusted over all cells of the table
  /// Of this many cells of one scene, label, sampler and budget, which differ in SRL or parameters,
  /// this has the highest efficiency; empty for the others and where there is one.
  std::optional<std::int64_t> best_of;
  int n_contaminated{0};  ///< runs of all attempts whose times are not to be trusted
  /// From the pictures of the cell's runs (replicates.h); empty where they were not kept.
  std::optional<double> variance;         ///< between runs: the MSE where there is no bias
  std::optional<double> bias2;            ///< squared bias, signed
  std::optional<double> p_eff_runs;       ///< effective pixels by the variance between runs
  std::optional<double> bias_smallest_p;  ///< over the tiles of three scales, adjusted by Holm
  std::string bias_tost;  ///< whether the bias of the whole image is inside +-0.5 %: "shown", "not
                          ///< shown"
  std::optional<double> bias_rel_lo, bias_rel_hi;  ///< t interval of bias_rel, the reference's
                                                   ///< error included

  friend bool operator==(const EfficiencyRow&, const EfficiencyRow&) = default;
};

/// Column names of measurements.csv and efficiency.csv.
CsvRecord run_columns();
CsvRecord efficiency_columns();

/// The columns of both with their units, for other forms of the tables.
std::span<const Column<RunRow>> run_table_columns();
std::span<const Column<EfficiencyRow>> efficiency_table_columns();

/// Fields in the order of run_columns().
CsvRecord run_record(const RunRow& row);

/// Fields in the order of efficiency_columns().
CsvRecord efficiency_record(const EfficiencyRow& row);

struct RunRows {
  std::vector<RunRow> rows;
  bool torn_tail{false};  ///< an incomplete last line was left out
};

/// Reads measurements.csv; columns are found by name. Columns that older versions did not write may
/// be missing and are then empty.
/// @throws InputError as read_csv, and naming file, row and column of a value that cannot be read,
/// or the columns
///         that are missing or unknown
RunRows read_run_rows(const std::filesystem::path& file);

/// Reads efficiency.csv. @throws InputError as read_run_rows, and when the last line is incomplete
std::vector<EfficiencyRow> read_efficiency_rows(const std::filesystem::path& file);

}  // namespace penumbra
