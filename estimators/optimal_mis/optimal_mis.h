#pragma once

#include "estimators/estimator.h"

namespace penumbra::optimal_mis {

extern const EstimatorEntry kEntry;

}  // namespace penumbra::optimal_mis
