#pragma once

#include <nlohmann/json_fwd.hpp>

#include "harness/exr.h"

/// What a reference's file says of itself beside its pixels.
namespace penumbra {

/// The text of a key. @throws ReferenceError where there is none
const std::string& reference_text(const ExrFile& exr, const char* key);

/// The number of a key. @throws ReferenceError where it is no whole number from 1 to 2^31 - 1
int reference_count(const ExrFile& exr, const char* key);

/// How it was rendered: one object per call of the program that added samples, with "estimator"
/// (text) and "passes" (whole number >= 0), and "tile" (whole number >= 0) in all but the oldest.
/// @throws ReferenceError where it is anything else
nlohmann::json reference_lineage(const ExrFile& exr);

}  // namespace penumbra
