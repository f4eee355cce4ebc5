#include "harness/stage_table.h"

#include <array>

namespace penumbra {
namespace {

#define PN_STAGE(name) column<&StageRow::name>(#name)

// clang-format off
constexpr std::array kColumns{
    PN_STAGE(scene), PN_STAGE(label), PN_STAGE(estimator), PN_STAGE(sampler), PN_STAGE(params),
    PN_STAGE(spp), PN_STAGE(srl), PN_STAGE(srl_initial), PN_STAGE(srl_adaptive),
    PN_STAGE(population), column<&StageRow::budget_s>("budget_s", "s"), PN_STAGE(cell),
    column<&StageRow::ns>("ns", "ns"), PN_STAGE(rays), PN_STAGE(samples), PN_STAGE(trace),
    PN_STAGE(sample), PN_STAGE(weigh), PN_STAGE(adapt), PN_STAGE(set_up), PN_STAGE(outside)};
// clang-format on

#undef PN_STAGE

}  // namespace

std::string to_csv(std::span<const StageRow> rows) { return csv_of(kColumns, rows); }

std::span<const Column<StageRow>> stage_table_columns() { return kColumns; }

std::vector<StageRow> read_stage_rows(const std::filesystem::path& file) {
  const CsvTable table = read_csv(file);
  if (table.torn_tail) {
    throw InputError(fmt::format(
        "{}: the last line is incomplete; remove the file, and `penumbra run` measures it again",
        file.string()));
  }
  return rows_of<StageRow>(kColumns, table, file);
}

}  // namespace penumbra
