#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/config.h"

/// From the axes of a method to the combinations that are measured.
namespace penumbra {

/// One combination of a method's axes.
struct SweepPoint {
  std::string sampler;
  int spp{1};  ///< estimates per pixel
  Srl srl;     ///< as written
  ParamSet::Map params;
};

/// All combinations: the product of the axes in the order sampler, spp, srl, parameters by name,
/// the last one fastest; axes that are zipped advance together in the place of the first of them;
/// without those that `exclude` names.
/// @param method  with zips of existing axes of equal length
/// @param scene  whose own numbers apply; nullptr: none
std::vector<SweepPoint> sweep_points(const ExperimentConfig& config, const MethodConfig& method,
                                     const SceneConfig* scene = nullptr);

/// More values of one axis, or more combinations of a method's axes, are taken for a mistake.
inline constexpr std::size_t kMaxAxisValues = 1000;
inline constexpr std::size_t kMaxCombinations = 10'000;

/// Number of combinations before any is excluded; counts no further than kMaxCombinations + 1.
std::size_t combination_count(const ExperimentConfig& config, const MethodConfig& method);

/// Number of values of an axis.
/// @return nullopt when the method has no axis of that name
std::optional<std::size_t> axis_size(const ExperimentConfig& config, const MethodConfig& method,
                                     const std::string& axis);

/// Names of a method's axes, in the order of the product.
std::vector<std::string> axis_names(const MethodConfig& method);

/// Evenly spaced values, on a linear or a logarithmic scale.
/// @param steps  at least 2; the first value is `from`, the last is `to`
/// @param logarithmic  needs from, to > 0
std::vector<double> spaced_values(double from, double to, int steps, bool logarithmic);

}  // namespace penumbra
