#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "harness/plan.h"

/// From time budgets to frozen sample counts. Source: statistics.md 3.4.
namespace penumbra {

/// Measures the cells with pilot runs, interleaved, and solves each for its time budget.
///
/// Cells that differ in nothing but their budget share one line T(n) = fixed + per_unit n, through
/// pilots at two n. It is then checked at the n that it gives for the largest budget; where the
/// time there misses the budget by more than the tolerance, the line is drawn anew through that
/// point and the pilots farther from it, at most kCheckRounds times.
/// Where the budget is the time of a method, that is measured first, at the numbers it is given,
/// but for scenes whose time is known.
/// Cells without a budget get their prediction from one run.
/// @throws InputError when a budget does not pay for the least number of samples
/// @throws RunError when the times do not grow with the work
/// @param matched_s  known times of the method that gives the budget, by index of the scene
/// @param foresee  also find PlannedCell::p_eff, which keeps one picture per cell in memory
std::vector<PlannedCell> run_pilots(const ExperimentConfig& config,
                                    const std::vector<LoadedScene>& scenes,
                                    const std::vector<Cell>& cells,
                                    const std::map<std::size_t, double>& matched_s = {},
                                    bool foresee = false);

inline constexpr int kCheckRounds = 3;

}  // namespace penumbra
