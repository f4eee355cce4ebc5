#pragma once

#include <span>
#include <string>

#include "harness/efficiency.h"

/// The efficiency table as text: for programs, for documents and for a terminal.
namespace penumbra {

/// The whole of efficiency.csv.
std::string to_csv(std::span<const EfficiencyRow> rows);

/// Pipe table for people, aligned, with footnotes on intervals, epsilon and what not to trust.
std::string to_markdown(std::span<const EfficiencyRow> rows, const TableOptions& options);

/// Plain text for a terminal: at most 119 columns, long names shortened in the middle with '~'.
std::string to_terminal(std::span<const EfficiencyRow> rows, const TableOptions& options);

}  // namespace penumbra
