#pragma once

#include <string>

#include "harness/gate/gate_result.h"

namespace penumbra {

/// The result for a terminal: a table with the worst cell first, the sentence of every verdict that
/// is not "unchanged", what to do next, and the verdict as the last line. Changes are of head
/// against base.
std::string gate_text(const GateResult& result);

}  // namespace penumbra
