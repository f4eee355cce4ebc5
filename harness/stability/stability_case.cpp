#include "harness/stability/stability_case.h"

#include <algorithm>
#include <cmath>

namespace penumbra::stability {
namespace {

std::vector<StabilityCase> all_cases() {
  std::vector<StabilityCase> all;
  for (const auto& part : {light_cases(), distribution_cases(), visibility_cases(), surface_cases(),
                           geometry_cases()}) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

}  // namespace

bool StabilityStep::is_dark() const {
  return std::all_of(exact.begin(), exact.end(), [](double radiance) { return radiance == 0; });
}

std::span<const StabilityCase> stability_cases() {
  static const std::vector<StabilityCase> cases = all_cases();
  return cases;
}

std::vector<std::string> stability_case_names() {
  std::vector<std::string> names;
  for (const StabilityCase& c : stability_cases()) names.emplace_back(c.name);
  return names;
}

std::vector<double> log_steps(double from, double to, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    const double share = static_cast<double>(i) / (count - 1);
    // Rounded to three digits, so that tables and seeds name the value that is used.
    const double raw = from * std::pow(to / from, share);
    const double unit = std::pow(10.0, 2 - std::floor(std::log10(raw)));
    values.push_back(std::round(raw * unit) / unit);
  }
  values.front() = from;
  values.back() = to;
  return values;
}

std::vector<double> log_steps_then(double from, double to, int count, double limit) {
  std::vector<double> values = log_steps(from, to, count);
  values.push_back(limit);
  return values;
}

}  // namespace penumbra::stability
