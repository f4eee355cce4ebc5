#pragma once

#include <span>
#include <string>

#include "harness/efficiency.h"

namespace penumbra {

/// The efficiency table as a LaTeX file for a preamble: \input{efficiency} prints nothing and needs
/// the package booktabs. It defines
/// - \PenumbraTable, the whole table as a tabular,
/// - \PenumbraRatio{scene}{label}, \PenumbraRatioInterval, \PenumbraRatioLow, \PenumbraRatioHigh,
///   \PenumbraMSE, \PenumbraRelMSE, \PenumbraTime and \PenumbraVerdict, likewise.
///
/// Where a label has several cells in a scene, what it takes to tell them apart follows, after "/":
/// sampler, budget as "B0.5", parameters, "SRL4-12", "SPP8". In scene and label every character
/// but letters, digits, blanks and ". + - = ( ) , : / _" is written "-", and names that then
/// coincide end in "/2" and so on; a comment lists all names. A name that is not there prints "??"
/// and warns.
std::string to_latex(std::span<const EfficiencyRow> rows, const TableOptions& options);

/// Text that prints as it is: special characters escaped, ASCII only; other code points that need
/// a package are printed as "U+03B1".
std::string latex_escaped(std::string_view text);

}  // namespace penumbra
