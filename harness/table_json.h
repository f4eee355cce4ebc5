#pragma once

#include <span>
#include <string>

#include "harness/efficiency.h"

namespace penumbra {

/// Of efficiency.json. Columns may be added without another version.
inline constexpr int kEfficiencyJsonVersion = 1;

/// The efficiency table as JSON: {"format": "penumbra-efficiency", "version", "baseline",
/// "tuned_baseline", "confidence", "primary_time", "relmse_epsilon", "columns": [{"name", "unit"}],
/// "rows": [{column: value}]}. Columns, order and units are those of efficiency.csv. An empty field
/// is null, and so is the unit of a column without one. JSON has no NaN: a number that is not
/// finite is a string, as in the CSV file.
std::string to_json(std::span<const EfficiencyRow> rows, const TableOptions& options);

}  // namespace penumbra
