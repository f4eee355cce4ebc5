#pragma once

#include <string>

#include "harness/gate/gate_result.h"

namespace penumbra {

/// The result as JUnit XML for test reports of CI systems: one suite with a test for all cells
/// together, one per cell in the order of the config, and one for the null control where there was
/// one. A failed run is an error, any other failure a failure whose type is the reason; what is
/// inconclusive is skipped with its sentence. Characters that XML 1.0 cannot hold become U+FFFD.
/// Source of the elements: https://github.com/jenkinsci/xunit-plugin, junit-10.xsd.
std::string gate_junit(const GateResult& result);

}  // namespace penumbra
