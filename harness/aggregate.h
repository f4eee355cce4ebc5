#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/curves.h"
#include "harness/efficiency.h"

/// Methods over scenes: means of ratios, and times to targets. Source: statistics.md 3.6.
namespace penumbra {

/// A ratio this close to 1 makes no difference.
inline constexpr double kTieMargin = 0.01;

/// One method against the baseline over all scenes, at the largest budget of each scene or,
/// without budgets, at its largest SPP.
struct AggregateRow {
  std::string label, sampler, params;
  std::optional<int> srl, spp;     ///< only where a sweep over them makes several methods of one
  std::optional<double> budget_s;  ///< where it is the same for all scenes
  std::string baseline;
  int n_scenes{0};              ///< that have a ratio
  int n_missing{0};             ///< scenes where it was measured and has none
  std::optional<double> ratio;  ///< geometric mean of the ratios
  /// For these very scenes: what another measurement of them may give.
  std::optional<double> fixed_lo, fixed_hi;
  /// For scenes like these: t over the scenes' log ratios. From two scenes on.
  std::optional<double> random_lo, random_hi;
  std::string worst_scene;
  std::optional<double> worst_ratio;
  /// Scenes whose interval is above 1 by more than kTieMargin, reaches into it, is below, or is
  /// missing.
  int wins{0}, ties{0}, losses{0}, undecided{0};
  int targets{0}, targets_reached{0};  ///< of EcdfRow, in MSE; of the first baseline only
  /// Over targets, of the time relative to the baseline's; empty where half are not reached.
  std::optional<double> median_relative_time;
  std::string note;

  friend bool operator==(const AggregateRow&, const AggregateRow&) = default;
};

/// One (method, scene, target). Targets are spaced evenly in log error from the first to the last
/// point of the baseline's curve.
struct EcdfRow {
  std::string metric;  ///< mse or relmse
  std::string label, sampler, params, scene;
  std::optional<int> srl, spp;
  int curve{0};
  double target{0};
  double baseline_time_s{0};
  /// Nothing is extrapolated. Empty where no budget reached the target.
  std::optional<double> time_s;
  std::optional<double> relative_time;  ///< over the baseline's
  std::string reach;                    ///< "measured", "at_most": before the first point, which is
                                        ///< then the time; "never"
  std::optional<double> share;          ///< of the method's targets with at most this relative time

  friend bool operator==(const EcdfRow&, const EcdfRow&) = default;
};

/// Targets per scene.
inline constexpr int kTargets = 10;

/// Methods in the order of the table, each from its smallest relative time on. Scenes where the
/// baseline has no single curve, or whose error does not fall, have no targets.
std::vector<EcdfRow> time_to_target_ecdf(const Curves& curves, const TableOptions& options);

/// Against the baseline and then, where there is one, against the tuned baseline.
/// @param rows  of efficiency_table with the same options
std::vector<AggregateRow> aggregate_over_scenes(std::span<const EfficiencyRow> rows,
                                                std::span<const EcdfRow> ecdf,
                                                const TableOptions& options);

/// The whole of aggregate.csv and of ecdf.csv.
std::string to_csv(std::span<const AggregateRow> rows);
std::string to_csv(std::span<const EcdfRow> rows);

/// The columns of both with their units (table_columns.h), for other forms of the tables.
std::span<const Column<AggregateRow>> aggregate_table_columns();
std::span<const Column<EcdfRow>> ecdf_table_columns();

/// Reads them. @throws InputError as read_efficiency_rows
std::vector<AggregateRow> read_aggregate_rows(const std::filesystem::path& file);
std::vector<EcdfRow> read_ecdf_rows(const std::filesystem::path& file);

}  // namespace penumbra
