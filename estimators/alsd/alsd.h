#pragma once

#include "estimators/estimator.h"

namespace penumbra::alsd {

extern const EstimatorEntry kEntry;

}  // namespace penumbra::alsd
