#pragma once

#include "estimators/estimator.h"

namespace penumbra::light_tree {

extern const EstimatorEntry kEntry;

}  // namespace penumbra::light_tree
