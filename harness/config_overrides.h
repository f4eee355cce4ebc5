#pragma once

#include <string>
#include <vector>

#include "scenes/core/located_json.h"

namespace penumbra {

/// Puts the values of --set into a document, in their order.
///
/// Each is "key.path=value". A path names keys of objects and elements of arrays, the latter by
/// their label or name, or by index from 0. Keys need not exist yet: whether they may is for the
/// schema to say. The value is JSON, or else a string. Places of what was set read "--set
/// key.path=value".
/// @param faults  paths that lead nowhere, with what would
void apply_overrides(const std::vector<std::string>& overrides, LocatedJson& document,
                     DiagnosticList& faults);

}  // namespace penumbra
