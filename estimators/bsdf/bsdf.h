#pragma once

#include "estimators/estimator.h"

namespace penumbra::bsdf {

extern const EstimatorEntry kEntry;

}  // namespace penumbra::bsdf
