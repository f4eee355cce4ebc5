#pragma once

#include <string>

#include "harness/micro/suite.h"

namespace penumbra::micro {
inline int print_shares(Suite&, const std::string&) { return 0; }
}  // namespace penumbra::micro
