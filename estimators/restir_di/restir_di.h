#pragma once

#include "estimators/estimator.h"

namespace penumbra::restir_di {

extern const EstimatorEntry kEntry;

}  // namespace penumbra::restir_di
