#include <array>

#include "harness/curves.h"
#include "harness/table_columns.h"

namespace penumbra {
namespace {

constexpr std::string_view kErrorUnit = "(W/(m^2 sr))^2";
constexpr std::string_view kUnit = "W/(m^2 sr)";

#define PN_CURVE(name) column<&CurveRow::name>(#name)
#define PN_POINT(name) column<&CurvePointRow::name>(#name)
#define PN_MSE(name, unit) inner_column<&CurveRow::mse, &MetricCurve::name>("mse_" #name, unit)
#define PN_RELMSE(name, unit) \
  inner_column<&CurveRow::relmse, &MetricCurve::name>("relmse_" #name, unit)

// clang-format off
constexpr std::array kCurveColumns{
    PN_CURVE(curve), PN_CURVE(scene), PN_CURVE(label), PN_CURVE(estimator), PN_CURVE(sampler),
    PN_CURVE(params), PN_CURVE(population), PN_CURVE(srl), PN_CURVE(srl_initial),
    PN_CURVE(srl_adaptive), PN_CURVE(spp), PN_CURVE(baseline), PN_CURVE(n_points),
    PN_CURVE(n_blocks), column<&CurveRow::time_min_s>("time_min_s", "s"),
    column<&CurveRow::time_max_s>("time_max_s", "s"), column<&CurveRow::at_s>("at_s", "s"),
    PN_MSE(slope, ""), PN_MSE(slope_lo, ""), PN_MSE(slope_hi, ""), PN_MSE(slope_p, ""),
    PN_MSE(order, ""), PN_MSE(order_lo, ""), PN_MSE(order_hi, ""), PN_MSE(order_p, ""),
   
    PN_MSE(decay, "s (W/(m^2 sr))^2"), PN_MSE(floor, kUnit), PN_MSE(floor_lo, kUnit),
    PN_MSE(floor_hi, kUnit), PN_MSE(at, kErrorUnit), PN_MSE(at_lo, kErrorUnit),
    PN_MSE(at_hi, kErrorUnit), PN_MSE(target, kErrorUnit), PN_MSE(time_s, "s"),
    PN_MSE(time_lo_s, "s"), PN_MSE(time_hi_s, "s"), PN_MSE(speedup, ""), PN_MSE(speedup_lo, ""),
    PN_MSE(speedup_hi, ""),
    PN_RELMSE(slope, ""), PN_RELMSE(slope_lo, ""), PN_RELMSE(slope_hi, ""), PN_RELMSE(slope_p, ""),
    PN_RELMSE(order, ""), PN_RELMSE(order_lo, ""), PN_RELMSE(order_hi, ""), PN_RELMSE(order_p, ""),
   
    PN_RELMSE(decay, "s"), PN_RELMSE(floor, ""), PN_RELMSE(floor_lo, ""), PN_RELMSE(floor_hi, ""),
    PN_RELMSE(at, ""), PN_RELMSE(at_lo, ""), PN_RELMSE(at_hi, ""), PN_RELMSE(target, ""),
    PN_RELMSE(time_s, "s"), PN_RELMSE(time_lo_s, "s"), PN_RELMSE(time_hi_s, "s"),
    PN_RELMSE(speedup, ""), PN_RELMSE(speedup_lo, ""), PN_RELMSE(speedup_hi, ""),
    PN_CURVE(note)};

constexpr std::array kPointColumns{
    PN_POINT(curve), PN_POINT(scene), PN_POINT(label), PN_POINT(sampler), PN_POINT(params),
    column<&CurvePointRow::budget_s>("budget_s", "s"), PN_POINT(spp), PN_POINT(srl),
    PN_POINT(srl_initial), PN_POINT(srl_adaptive), PN_POINT(n_blocks),
    column<&CurvePointRow::time_s>("time_s", "s"), column<&CurvePointRow::time_wall_s>("T_s", "s"),
    column<&CurvePointRow::time_cpu_s>("T_cpu_s", "s"),
    column<&CurvePointRow::err>("err", kErrorUnit),
    column<&CurvePointRow::err_lo>("err_lo", kErrorUnit),
    column<&CurvePointRow::err_hi>("err_hi", kErrorUnit), PN_POINT(relmse), PN_POINT(relmse_lo),
    PN_POINT(relmse_hi), column<&CurvePointRow::p_eff>("p_eff", "pixels")};
// clang-format on

#undef PN_CURVE
#undef PN_POINT
#undef PN_MSE
#undef PN_RELMSE

}  // namespace

std::string to_csv(std::span<const CurveRow> rows) { return csv_of(kCurveColumns, rows); }

std::string to_csv(std::span<const CurvePointRow> rows) { return csv_of(kPointColumns, rows); }

std::span<const Column<CurveRow>> curve_table_columns() { return kCurveColumns; }

std::span<const Column<CurvePointRow>> curve_point_table_columns() { return kPointColumns; }

std::vector<CurveRow> read_curve_rows(const std::filesystem::path& file) {
  return read_whole_table<CurveRow>(kCurveColumns, file);
}

std::vector<CurvePointRow> read_curve_point_rows(const std::filesystem::path& file) {
  return read_whole_table<CurvePointRow>(kPointColumns, file);
}

}  // namespace penumbra
