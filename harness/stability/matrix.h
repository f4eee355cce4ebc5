#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/stability/stability.h"

namespace penumbra::stability {

/// The steps of one case by one method, from harmless to extreme.
struct MatrixCell {
  std::vector<const StabilityRow*> steps;  ///< empty: the case does not apply

  Verdict worst() const;
  /// The first step that is not ok, or nullptr.
  const StabilityRow* first_trouble() const;
};

/// Cells by case, then by method.
std::vector<std::vector<MatrixCell>> matrix_of(const StabilityResult& result);

/// The case of that name. The name must be known.
const StabilityCase& case_named(std::string_view name);

/// A parameter's value in a few characters: "0.01", "3e-5", "128".
std::string value_text(double value);

/// Whether a method declares a bias, by the rows.
bool declares_bias(const StabilityResult& result, std::string_view method);

}  // namespace penumbra::stability
