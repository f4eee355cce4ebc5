#include "harness/number_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace penumbra {
namespace {

std::string fixed_text(double value) { return fmt::format("{:.2f}", value); }

std::string interval_text(const std::optional<double>& value, const std::optional<double>& lo,
                          const std::optional<double>& hi, std::string (*text)(double)) {
  if (!value) return "-";
  const bool exact = lo == value && hi == value;
  if (!lo || !hi || exact) return text(*value);
  return fmt::format("{} [{}, {}]", text(*value), text(*lo), text(*hi));
}

}  // namespace

std::string number_text(double value) {
  const double size = std::abs(value);
  if (!std::isfinite(value) || value == 0) return fmt::format("{:g}", value);
  if (size < 1e-3 || size >= 99950) {
    const std::string text = fmt::format("{:.2e}", value);
    const std::size_t e = text.find('e');
    return text.substr(0, e + 1) + std::to_string(std::stoi(text.substr(e + 1)));
  }
  if (size >= 99.95) return fmt::format("{:.0f}", value);
  const int digits = 2 - static_cast<int>(std::floor(std::log10(size) + 1e-12));
  return fmt::format("{:.{}f}", value, std::max(digits, 0));
}

std::string number_text(const std::optional<double>& value) {
  return value ? number_text(*value) : "-";
}

std::string seconds_text(const std::optional<double>& value) {
  if (!value) return "-";
  if (*value >= 1) return number_text(*value) + " s";
  return *value >= 1e-3 ? number_text(*value * 1e3) + " ms" : number_text(*value * 1e6) + " us";
}

std::string ratio_text(double value) {
  return value >= 0.0995 && value < 99.995 ? fixed_text(value) : number_text(value);
}

std::string ratio_interval_text(const std::optional<double>& value, const std::optional<double>& lo,
                                const std::optional<double>& hi) {
  return interval_text(value, lo, hi, ratio_text);
}

std::string slope_interval_text(const std::optional<double>& value, const std::optional<double>& lo,
                                const std::optional<double>& hi) {
  return interval_text(value, lo, hi, fixed_text);
}

std::string number_interval_text(const std::optional<double>& value,
                                 const std::optional<double>& lo, const std::optional<double>& hi) {
  return interval_text(value, lo, hi, [](double v) { return number_text(v); });
}

std::string percent_text(const std::optional<double>& value) {
  return value ? fmt::format("{:+.2f} %", 100 * *value) : "-";
}

}  // namespace penumbra
