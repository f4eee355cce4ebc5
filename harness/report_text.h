#pragma once

#include <span>
#include <string>

#include "harness/aggregate.h"
#include "harness/curves.h"

/// Curves and aggregates as text, each with its title and footnotes; empty where there are none, or
/// one scene only, of which the efficiency table says everything.
namespace penumbra {

std::string curves_markdown(std::span<const CurveRow> rows, const TableOptions& options);
std::string curves_terminal(std::span<const CurveRow> rows, const TableOptions& options);

std::string aggregate_markdown(std::span<const AggregateRow> rows, const TableOptions& options);
std::string aggregate_terminal(std::span<const AggregateRow> rows, const TableOptions& options);

}  // namespace penumbra
