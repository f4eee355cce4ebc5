#pragma once

#include "harness/micro/points.h"

/// Registration of the microbenchmarks, each group in a file of its own. The tile must outlive the
/// run.
namespace penumbra::micro {

/// estimate/<name>/<scene>/srl:<A-B>: whole estimates of every registered estimator.
void register_estimates(const BenchTile& tile);

/// adapt/...: what the adaptive estimators spend on learning, next to whole estimates.
void register_adaptation(const BenchTile& tile);

}  // namespace penumbra::micro
