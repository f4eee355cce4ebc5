#pragma once

#include <optional>
#include <string_view>

#include "harness/metrics.h"
#include "harness/run_row.h"

/// Between the table of metrics and the columns of measurements.csv.
namespace penumbra {

/// The field of a metric in a row; its column has the metric's name.
/// @return nullptr for rmse, a root of mse, which has no column, and for names that are no metric
std::optional<double> RunRow::*metric_field(std::string_view metric);

/// Writes every metric that has a column, and what the reference says, into a row.
void record_metrics(const ImageMetrics& metrics, RunRow& row);

}  // namespace penumbra
