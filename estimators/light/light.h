#pragma once

#include "estimators/estimator.h"

namespace penumbra::light {

extern const EstimatorEntry kEntry;

}  // namespace penumbra::light
