#pragma once

#include <string>

namespace penumbra {

/// One word of a shell's command line, quoted where it must be: for commands that are printed to be
/// copied.
std::string shell_quoted(const std::string& text);

}  // namespace penumbra
