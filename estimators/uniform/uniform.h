#pragma once

#include "estimators/estimator.h"

namespace penumbra::uniform {

extern const EstimatorEntry kEntry;

}  // namespace penumbra::uniform
