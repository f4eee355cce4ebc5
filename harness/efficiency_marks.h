#pragma once

#include <optional>
#include <vector>

#include "harness/measured_cells.h"
#include "harness/run_row.h"

/// What a row of the efficiency table owes to the other rows.
namespace penumbra {

struct TableOptions;

/// The published ratio of efficiencies to the baseline's. @return empty where either is missing
std::optional<double> published_ratio(const EfficiencyRow& row, const TableOptions& options);

/// Sets bias_p_holm: Holm over all cells of the table that have a bias_p.
void adjust_bias(std::vector<EfficiencyRow>& rows);

/// Sets best_of: marks the most efficient of the cells that were swept over.
void mark_best(std::vector<EfficiencyRow>& rows, PrimaryTime primary);

}  // namespace penumbra
