#pragma once

#include "estimators/estimator.h"

namespace penumbra::mdhi {

/// Multidimensional adaptive sampling, reduced to the hemispherical integral at one point.
extern const EstimatorEntry kEntry;

}  // namespace penumbra::mdhi
