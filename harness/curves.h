#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/csv.h"
#include "harness/efficiency.h"

/// Error against run time: what was measured at several budgets, put together to curves.
/// Source: statistics.md 3.4; curve_fit.h has the fits.
namespace penumbra {

/// What a curve says in one metric, MSE or relMSE. Empty where the data do not allow it.
struct MetricCurve {
  std::optional<double> slope, slope_lo, slope_hi;  ///< of log error over log time
  std::optional<double> slope_p;                    ///< two-sided, of a slope of -1
  std::optional<double> order, order_lo, order_hi;  ///< of log error over log effective SPP
  std::optional<double> order_p;                    ///< two-sided, of an order of -1
  std::optional<double> decay;                      ///< a of error = a / time + b^2
  std::optional<double> floor, floor_lo, floor_hi;  ///< b; 0 where the interval holds 0
  std::optional<double> at, at_lo, at_hi;           ///< error at CurveRow::at_s
  std::optional<double> target;                     ///< the baseline's error at its largest budget
  std::optional<double> time_s, time_lo_s, time_hi_s;     ///< to the target
  std::optional<double> speedup, speedup_lo, speedup_hi;  ///< the baseline's time over that

  friend bool operator==(const MetricCurve&, const MetricCurve&) = default;
};

/// Equally spread estimates per pixel that have the variance of `spp` estimates over
/// `camera_samples` shading points: m^2 / sum 1/n_i, n_i of them at shading point i. Equal to `spp`
/// where that is a multiple of the camera samples; 2.67 for 3 over 2.
/// @param spp  >= camera_samples >= 1
double effective_spp(int spp, int camera_samples);

/// One (scene, method with parameters and SRL, sampler) measured at several budgets. Where budgets
/// fix the time, the number that was solved for differs along the curve, and its field is empty.
struct CurveRow {
  int curve{0};  ///< number, joins curve_points.csv
  std::string scene, label, estimator, sampler, params;
  std::optional<std::int64_t> population;
  std::optional<int> srl, srl_initial, srl_adaptive, spp;
  std::string baseline;
  int n_points{0};
  int n_blocks{0};  ///< that all budgets have
  double time_min_s{0}, time_max_s{0};
  double at_s{0};  ///< a time that all curves of the scene share
  MetricCurve mse;
  MetricCurve relmse;
  std::string note;

  friend bool operator==(const CurveRow&, const CurveRow&) = default;
};

/// One budget of a curve. Means over blocks with t intervals.
struct CurvePointRow {
  int curve{0};
  std::string scene, label, sampler, params;
  std::optional<double> budget_s;
  int spp{0}, srl{0}, srl_initial{0}, srl_adaptive{0};
  int n_blocks{0};
  double time_s{0};  ///< the primary one, the abscissa
  std::optional<double> time_wall_s, time_cpu_s;
  double err{0};  ///< debiased MSE
  std::optional<double> err_lo, err_hi;
  std::optional<double> relmse, relmse_lo, relmse_hi;  ///< its interval leaves out the reference
  std::optional<double> p_eff;

  friend bool operator==(const CurvePointRow&, const CurvePointRow&) = default;
};

struct Curves {
  std::vector<CurveRow> rows;
  std::vector<CurvePointRow> points;  ///< curve by curve, in increasing time
};

/// All curves of two budgets or more, in the order of the efficiency table. Points are cells at
/// several budgets or, without budgets, at several SPP; their abscissa is the realised time. Cells
/// with a failed run are left out, which the note says.
/// @throws InputError, ReferenceError as measured_cells
Curves error_curves(std::span<const RunRow> rows, const TableOptions& options);

/// The whole of curves.csv and of curve_points.csv.
std::string to_csv(std::span<const CurveRow> rows);
std::string to_csv(std::span<const CurvePointRow> rows);

/// The columns of both with their units (table_columns.h), for other forms of the tables.
std::span<const Column<CurveRow>> curve_table_columns();
std::span<const Column<CurvePointRow>> curve_point_table_columns();

/// Reads them. @throws InputError as read_efficiency_rows
std::vector<CurveRow> read_curve_rows(const std::filesystem::path& file);
std::vector<CurvePointRow> read_curve_point_rows(const std::filesystem::path& file);

}  // namespace penumbra
