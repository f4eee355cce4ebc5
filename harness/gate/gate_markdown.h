#pragma once

#include <string>

#include "harness/gate/gate_result.h"

namespace penumbra {

/// The result as GitHub Markdown, made for the summary of a pull request: verdict and sentence, a
/// table of all cells together and of each, worst first, with the sentence of each verdict, what to
/// do next, the null control and notes; numbers, both sides and the command that repeats it are
/// folded. Names and sentences are escaped: they show as they are.
std::string gate_markdown(const GateResult& result);

}  // namespace penumbra
