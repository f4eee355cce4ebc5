#pragma once

#include <span>
#include <string>
#include <vector>

#include "estimators/estimator.h"

namespace penumbra::stability {

/// An estimator with parameters: a column of the matrix.
struct Method {
  std::string label;
  const EstimatorEntry* entry{nullptr};
  ParamSet::Map given;      ///< what differs from the defaults
  std::string bias_reason;  ///< declared by the estimator; empty: it claims to be unbiased

  bool has_param(std::string_view name) const;
  /// All parameters. @param more  set on top of `given`, as far as the estimator has them
  ParamSet params(const ParamSet::Map& more = {}) const;
};

/// Every estimator with its defaults; again with light sampling by solid angle where it has that
/// choice ("NAME sa"); and PMC-HI as the paper reads literally.
std::vector<Method> stability_methods(std::span<const EstimatorEntry* const> estimators);

/// @param srl  shadow rays per light
/// @return a quarter of them initial, where the estimator adapts; all of them otherwise
Budget split_budget(const EstimatorEntry& entry, int srl);

}  // namespace penumbra::stability
