#include "harness/gate/gate_run.h"

#include <array>
#include <utility>

namespace penumbra {
namespace {

#define PN_RUN(name) column<&GateRun::name>(#name)

// clang-format off
constexpr std::array kColumns{
    PN_RUN(phase), PN_RUN(side), PN_RUN(cell), PN_RUN(block), PN_RUN(seed), PN_RUN(threads),
    PN_RUN(image_hash), PN_RUN(half_hash), PN_RUN(estimates), PN_RUN(samples), PN_RUN(rays),
    PN_RUN(lit), PN_RUN(iterations), PN_RUN(instructions),
    column<&GateRun::time_cpu_s>("time_cpu_s", "s"),
    column<&GateRun::time_wall_s>("time_wall_s", "s"),
    PN_RUN(error), PN_RUN(p_eff), PN_RUN(tiles), PN_RUN(failure)};
// clang-format on

#undef PN_RUN

constexpr std::array<std::pair<GateSide, std::string_view>, 3> kSides{
    {{GateSide::Base, "base"}, {GateSide::Head, "head"}, {GateSide::Null, "null"}}};
constexpr std::array<std::pair<GatePhase, std::string_view>, 4> kPhases{
    {{GatePhase::Smoke, "smoke"},
     {GatePhase::Repeat, "repeat"},
     {GatePhase::Measure, "measure"},
     {GatePhase::Confirm, "confirm"}}};

template <class Table, class T>
std::string_view name_in(const Table& table, T value) {
  for (const auto& [key, name] : table) {
    if (key == value) return name;
  }
  return "";
}

template <class Table, class T>
bool find_in(const Table& table, std::string_view text, T& value) {
  for (const auto& [key, name] : table) {
    if (name != text) continue;
    value = key;
    return true;
  }
  return false;
}

}  // namespace

std::string_view to_string(GateSide side) noexcept { return name_in(kSides, side); }
std::string_view to_string(GatePhase phase) noexcept { return name_in(kPhases, phase); }

std::string csv_text(GateSide side) { return std::string(to_string(side)); }
std::string csv_text(GatePhase phase) { return std::string(to_string(phase)); }
bool parse_csv(std::string_view text, GateSide& side) { return find_in(kSides, text, side); }
bool parse_csv(std::string_view text, GatePhase& phase) { return find_in(kPhases, text, phase); }

std::string csv_text(const TileMeans& tiles) {
  std::string text;
  for (const double value : tiles.values) {
    if (!text.empty()) text += ' ';
    text += csv_text(value);
  }
  return text;
}

bool parse_csv(std::string_view text, TileMeans& tiles) {
  std::vector<double> values;
  while (!text.empty()) {
    const std::size_t space = text.find(' ');
    double value = 0;
    if (!parse_csv(text.substr(0, space), value)) return false;
    values.push_back(value);
    text = space == std::string_view::npos ? std::string_view{} : text.substr(space + 1);
  }
  tiles.values = std::move(values);
  return true;
}

CsvRecord gate_run_columns() { return names_of(kColumns); }

CsvRecord gate_run_record(const GateRun& run) { return record_of(kColumns, run); }

std::vector<GateRun> read_gate_runs(const std::filesystem::path& file) {
  return rows_of<GateRun>(kColumns, read_csv(file), file);
}

}  // namespace penumbra
