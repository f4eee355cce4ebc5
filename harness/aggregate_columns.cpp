#include <array>

#include "harness/aggregate.h"
#include "harness/table_columns.h"

namespace penumbra {
namespace {

#define PN_AGGREGATE(name) column<&AggregateRow::name>(#name)
#define PN_ECDF(name) column<&EcdfRow::name>(#name)

// clang-format off
constexpr std::array kAggregateColumns{
    PN_AGGREGATE(label), PN_AGGREGATE(sampler), PN_AGGREGATE(params), PN_AGGREGATE(srl),
    PN_AGGREGATE(spp), column<&AggregateRow::budget_s>("budget_s", "s"), PN_AGGREGATE(baseline),
    PN_AGGREGATE(n_scenes), PN_AGGREGATE(n_missing), PN_AGGREGATE(ratio), PN_AGGREGATE(fixed_lo),
    PN_AGGREGATE(fixed_hi), PN_AGGREGATE(random_lo), PN_AGGREGATE(random_hi),
    PN_AGGREGATE(worst_scene), PN_AGGREGATE(worst_ratio), PN_AGGREGATE(wins), PN_AGGREGATE(ties),
    PN_AGGREGATE(losses), PN_AGGREGATE(undecided), PN_AGGREGATE(targets),
    PN_AGGREGATE(targets_reached), PN_AGGREGATE(median_relative_time), PN_AGGREGATE(note)};

// The target has the unit of its metric.
constexpr std::array kEcdfColumns{
    PN_ECDF(metric), PN_ECDF(label), PN_ECDF(sampler), PN_ECDF(params), PN_ECDF(scene),
    PN_ECDF(srl), PN_ECDF(spp), PN_ECDF(curve), PN_ECDF(target),
    column<&EcdfRow::baseline_time_s>("baseline_time_s", "s"),
    column<&EcdfRow::time_s>("time_s", "s"), PN_ECDF(relative_time), PN_ECDF(reach),
    PN_ECDF(share)};
// clang-format on

#undef PN_AGGREGATE
#undef PN_ECDF

}  // namespace

std::string to_csv(std::span<const AggregateRow> rows) { return csv_of(kAggregateColumns, rows); }

std::string to_csv(std::span<const EcdfRow> rows) { return csv_of(kEcdfColumns, rows); }

std::span<const Column<AggregateRow>> aggregate_table_columns() { return kAggregateColumns; }

std::span<const Column<EcdfRow>> ecdf_table_columns() { return kEcdfColumns; }

std::vector<AggregateRow> read_aggregate_rows(const std::filesystem::path& file) {
  return read_whole_table<AggregateRow>(kAggregateColumns, file);
}

std::vector<EcdfRow> read_ecdf_rows(const std::filesystem::path& file) {
  return read_whole_table<EcdfRow>(kEcdfColumns, file);
}

}  // namespace penumbra
