#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/report_tables.h"

/// What the tables say, in sentences: who wins where, by how much, how sure that is, and what keeps
/// it from being believed. Made from the data alone.
namespace penumbra {

enum class StatementKind {
  Result,   ///< how a method compares with the baseline
  Leader,   ///< what is most efficient on a scene
  Caution,  ///< what limits the trust in the numbers
};

struct Statement {
  StatementKind kind{StatementKind::Result};
  std::string text;  ///< one sentence, without markup

  friend bool operator==(const Statement&, const Statement&) = default;
};

/// Results by method, then leaders by scene, then cautions, worst first. A method that was swept
/// counts with its most efficient cell (EfficiencyRow::best_of); of several budgets the largest.
std::vector<Statement> summarise(const ReportTables& tables);

/// Whether an interval of a ratio lies above 1, below, or holds 1.
enum class Standing { Better, Worse, Undecided };
Standing standing_of(double lo, double hi) noexcept;

/// The rows that stand for their method in the summary: of the largest budget (or SPP) of each
/// scene, the best cell of a sweep; in the order of the table.
std::vector<const EfficiencyRow*> headline_rows(std::span<const EfficiencyRow> rows);

}  // namespace penumbra
