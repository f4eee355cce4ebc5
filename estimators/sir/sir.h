#pragma once

#include "estimators/estimator.h"

namespace penumbra::sir {

extern const EstimatorEntry kEntry;

}  // namespace penumbra::sir
