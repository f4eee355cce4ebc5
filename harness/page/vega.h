#pragma once

#include <string>

namespace penumbra {

/// Vega as one script that defines `vega` (View, parse), linked from the modules of Debian's
/// packages libjs-vega and node-d3-*, which have no bundle. Empty where one of them is missing: the
/// page then has no plots and says why.
std::string vega_script();

}  // namespace penumbra
