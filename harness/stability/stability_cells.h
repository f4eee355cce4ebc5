#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/stability/measure.h"
#include "harness/stability/method.h"
#include "harness/stability/stability.h"
#include "harness/stability/stability_case.h"

/// The measuring half of `penumbra stability`: which estimates are made, and how many. What they
/// mean is judged in stability.cpp.
namespace penumbra::stability {

/// One step of one case's sweep with its scene.
struct BuiltStep {
  const StabilityCase* source{nullptr};
  int index{0};  ///< in the case's values
  StabilityStep step;
};

/// One method at one step.
struct Cell {
  const BuiltStep* built{nullptr};
  const Method* method{nullptr};
  Measurement main;
  std::vector<ErrorLevel> levels;                        ///< the first is that of `main`
  std::optional<Measurement> repeated;                   ///< to confirm a bias
  std::uint64_t other_non_finite{0}, other_negative{0};  ///< of the levels behind the first
  std::string replay;   ///< what makes the first bad estimate again; empty: there is none
  std::string refusal;  ///< the estimator's, instead of all else
};

/// The steps of all cases, built on all threads of the arena.
/// @param quick  four of each sweep, both ends among them
std::vector<BuiltStep> build_steps(const std::vector<const StabilityCase*>& cases, bool quick);

/// An unmeasured cell for every step and method that it applies to, by case, step, method.
/// @param steps, methods  outlive the cells
std::vector<Cell> cells_of(const std::vector<BuiltStep>& steps, const std::vector<Method>& methods);

/// Shadow rays per light of the main measurement.
int srl_of(const Cell& cell);

/// Makes the main measurement and those with more rays.
/// @param quick  a sixteenth of the estimates
void measure_cell(Cell& cell, bool quick);

/// Makes kConfirmFactor as many estimates with fresh random numbers.
void repeat_cell(Cell& cell, bool quick);

/// What the rules of verdict.h want to know of a measurement.
Evidence evidence_of(const Cell& cell, const Measurement& measurement);

}  // namespace penumbra::stability
