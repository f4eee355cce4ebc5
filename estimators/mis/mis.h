#pragma once

#include "estimators/estimator.h"

namespace penumbra::mis {

extern const EstimatorEntry kEntry;

}  // namespace penumbra::mis
