#pragma once

#include "estimators/estimator.h"

namespace penumbra::pmc_hi_plus {

extern const EstimatorEntry kEntry;

}  // namespace penumbra::pmc_hi_plus
