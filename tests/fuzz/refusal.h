#pragma once

#include <string>

#include "scenes/core/error.h"

namespace penumbra {

/// Runs a reader that may refuse what it is given.
/// @param file  which a refusal must name
/// @return whether it accepted
template <class Fault, class Read>
bool accepts(const std::string& file, Read read) {
  try {
    read();
    return true;
  } catch (const Fault& fault) {
    const std::string message = fault.what();
    PN_CHECK(message.find(file) != std::string::npos, message.c_str());
    return false;
  }
}

}  // namespace penumbra
