#pragma once

#include <nlohmann/json_fwd.hpp>

#include "harness/gate/gate_result.h"

/// gate.json: what a gate found, for machines. configs/gate_report.schema.json is its schema.
namespace penumbra {

/// Changes when a key changes its meaning or goes away.
inline constexpr int kGateJsonVersion = 1;

/// All of a result. Ratios are head over base, 1 where nothing changed; keys in _percent are
/// 100 (ratio - 1).
///
/// JSON has no NaN and no infinity, and a null would read as "not measured". So such a number is
/// the text "nan", "inf" or "-inf", a value that was not measured has no key, and null is never
/// written. Bytes that are not UTF-8 become U+FFFD.
nlohmann::ordered_json gate_json(const GateResult& result);

}  // namespace penumbra
