#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

/// Parameters of an estimator: declared once in a table, from which validation, `penumbra list`,
/// defaults and error messages are derived.
namespace penumbra {

using ParamValue = std::variant<bool, std::int64_t, double, std::string>;

/// One declared parameter. The type is that of the default; a string parameter must have choices.
struct ParamSpec {
  std::string name;
  ParamValue default_value;
  std::string doc;
  std::vector<std::string> choices{};  ///< allowed values of a string parameter
  double min{-std::numeric_limits<double>::infinity()};
  double max{std::numeric_limits<double>::infinity()};
};

std::string to_string(const ParamValue& value);

/// The complete, valid parameters of one estimator: every declared name has a value.
class ParamSet {
 public:
  using Map = std::map<std::string, ParamValue, std::less<>>;

  ParamSet() = default;
  explicit ParamSet(Map values) : values_(std::move(values)) {}

  bool boolean(std::string_view name) const;
  std::int64_t integer(std::string_view name) const;
  double real(std::string_view name) const;
  const std::string& text(std::string_view name) const;

  const Map& values() const { return values_; }

  /// "name=value" of every parameter that differs from its default, comma-separated, in the table's
  /// order.
  std::string differences(std::span<const ParamSpec> specs) const;

 private:
  const ParamValue& at(std::string_view name) const;
  Map values_;
};

/// Why one given parameter was refused.
struct ParamProblem {
  std::string name;     ///< the key as given
  std::string message;  ///< what was found, what is allowed
};

/// Checks one value: type (an integer is accepted where a real is declared), range, choices.
/// @return empty when valid, otherwise the message
std::string check_param(const ParamSpec& spec, const ParamValue& value);

/// Fills in the defaults and converts integers to reals where declared.
/// @param problems  every refused parameter is appended; the result is then not to be used
ParamSet resolve_params(std::span<const ParamSpec> specs, const ParamSet::Map& given,
                        std::vector<ParamProblem>& problems);

}  // namespace penumbra
