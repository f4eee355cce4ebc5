#pragma once

#include <iosfwd>

#include "harness/config.h"

namespace penumbra {

/// Measures what it is asked for, one run per line of `requests`, until they end (protocol.h).
/// Writes nothing else to `replies`.
/// @param config  without a time budget: pilots on two programs would find two plans
/// @throws InputError for a budget
/// @throws RunError for a line that is no request or a cell that the config does not have
void serve_gate(ExperimentConfig config, std::istream& requests, std::ostream& replies);

/// A gate needs the same number of samples on both sides.
/// @throws InputError when the config has a time budget
void refuse_budget(const ExperimentConfig& config);

}  // namespace penumbra
