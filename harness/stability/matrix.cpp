#include "harness/stability/matrix.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "scenes/core/error.h"

namespace penumbra::stability {

Verdict MatrixCell::worst() const {
  Verdict worst = Verdict::Ok;
  for (const StabilityRow* row : steps) worst = std::max(worst, row->verdict);
  return worst;
}

const StabilityRow* MatrixCell::first_trouble() const {
  const auto found = std::find_if(steps.begin(), steps.end(), [](const StabilityRow* row) {
    return row->verdict != Verdict::Ok;
  });
  return found == steps.end() ? nullptr : *found;
}

std::vector<std::vector<MatrixCell>> matrix_of(const StabilityResult& result) {
  std::map<std::string_view, std::size_t> case_index;
  std::map<std::string_view, std::size_t> method_index;
  for (const std::string& name : result.cases) case_index.emplace(name, case_index.size());
  for (const std::string& name : result.methods) method_index.emplace(name, method_index.size());
  std::vector<std::vector<MatrixCell>> matrix(result.cases.size(),
                                              std::vector<MatrixCell>(result.methods.size()));
  for (const StabilityRow& row : result.rows) {
    matrix[case_index.at(row.case_name)][method_index.at(row.method)].steps.push_back(&row);
  }
  return matrix;
}

const StabilityCase& case_named(std::string_view name) {
  const std::span<const StabilityCase> cases = stability_cases();
  const auto found = std::find_if(cases.begin(), cases.end(),
                                  [&](const StabilityCase& c) { return c.name == name; });
  PN_CHECK(found != cases.end(), "the case is known");
  return *found;
}

std::string value_text(double value) {
  if (value == 0) return "0";
  if (value >= 100 && value < 9999.5) return fmt::format("{:.0f}", value);
  if (value >= 1 && value < 100) return fmt::format("{:.3g}", value);
  if (value >= 0.0095 && value < 1) return fmt::format("{:.2g}", value);
  const std::string text = fmt::format("{:.0e}", value);
  const std::size_t e = text.find('e');
  return text.substr(0, e + 1) + std::to_string(std::stoi(text.substr(e + 1)));
}

bool declares_bias(const StabilityResult& result, std::string_view method) {
  return std::any_of(result.rows.begin(), result.rows.end(), [&](const StabilityRow& row) {
    return row.method == method && !row.declared_bias.empty();
  });
}

}  // namespace penumbra::stability
