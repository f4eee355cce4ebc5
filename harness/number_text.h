#pragma once

#include <optional>
#include <string>

/// Numbers for people: three significant digits, "-" where there is none.
namespace penumbra {

/// Without the padding of the exponent: 1.23e-7.
std::string number_text(double value);
std::string number_text(const std::optional<double>& value);

/// With its unit: s, ms or us.
std::string seconds_text(const std::optional<double>& value);

/// Two digits behind the point where that are enough and not too many.
std::string ratio_text(double value);

/// "1.42 [1.31, 1.54]"; the value alone where there is no interval, or where it is exact (of a
/// baseline to itself).
std::string ratio_interval_text(const std::optional<double>& value, const std::optional<double>& lo,
                                const std::optional<double>& hi);

/// The same with two digits behind the point whatever the size: slopes.
std::string slope_interval_text(const std::optional<double>& value, const std::optional<double>& lo,
                                const std::optional<double>& hi);

/// The same with three significant digits.
std::string number_interval_text(const std::optional<double>& value,
                                 const std::optional<double>& lo, const std::optional<double>& hi);

/// With its sign: "+0.12 %".
std::string percent_text(const std::optional<double>& value);

}  // namespace penumbra
