#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/csv.h"
#include "harness/table_columns.h"

/// One run of one cell by one of the programs that a gate compares.
namespace penumbra {

enum class GateSide {
  Base,
  Head,
  Null,  ///< the base again, which must not differ from it
};

enum class GatePhase {
  Smoke,    ///< head: fewest estimates
  Repeat,   ///< head: block 0 again, on one thread and on several
  Measure,  ///< both sides, interleaved
  Confirm,  ///< both sides again with fresh seeds
};

/// One value per tile of `bias_tiles` with kBiasTileSides (replicates.h).
struct TileMeans {
  std::vector<double> values;
  friend bool operator==(const TileMeans&, const TileMeans&) = default;
};

struct GateRun {
  GatePhase phase{GatePhase::Measure};
  GateSide side{GateSide::Head};
  std::string cell;  ///< scene/label/sampler, and the rest where that is not unique
  int block{0};
  std::uint64_t seed{0};
  int threads{1};
  std::string image_hash;  ///< of all bits of the image in double precision
  std::string half_hash;   ///< of the image rounded to half precision
  std::uint64_t estimates{0};
  std::uint64_t samples{0};
  std::uint64_t rays{0};
  std::uint64_t lit{0};
  std::uint64_t iterations{0};
  std::optional<std::uint64_t> instructions;
  std::optional<double> time_cpu_s;
  std::optional<double> time_wall_s;
  std::optional<double> error;  ///< GateConfig::metric, debiased; may be negative
  std::optional<double> p_eff;
  TileMeans tiles;
  std::string failure;  ///< why the run failed; empty: it did not

  friend bool operator==(const GateRun&, const GateRun&) = default;
};

std::string_view to_string(GateSide side) noexcept;
std::string_view to_string(GatePhase phase) noexcept;

/// As in csv.h.
std::string csv_text(GateSide side);
std::string csv_text(GatePhase phase);
std::string csv_text(const TileMeans& tiles);
bool parse_csv(std::string_view text, GateSide& side);
bool parse_csv(std::string_view text, GatePhase& phase);
bool parse_csv(std::string_view text, TileMeans& tiles);

/// Column names of gate.rows.csv, and the fields in their order.
CsvRecord gate_run_columns();
CsvRecord gate_run_record(const GateRun& run);

/// Reads gate.rows.csv; a torn last line is left out.
/// @throws InputError as read_csv and rows_of
std::vector<GateRun> read_gate_runs(const std::filesystem::path& file);

}  // namespace penumbra
