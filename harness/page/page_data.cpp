#include "harness/page/page_data.h"

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "harness/column_json.h"
#include "harness/summary.h"

namespace penumbra {
namespace {

using Json = nlohmann::ordered_json;

template <class Columns, class Rows>
Json table(const Columns& columns, const Rows& rows) {
  return {{"columns", json_columns(columns)}, {"rows", json_rows(columns, rows)}};
}

/// A JSON file of the folder; null where there is none that can be read.
Json json_file(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) return nullptr;
  Json json = Json::parse(stream, nullptr, false);
  return json.is_discarded() ? Json() : json;
}

/// Of a stability suite's rows what the matrix shows; the rest would be megabytes.
Json stability_json(const std::filesystem::path& file) {
  const Json suite = json_file(file);
  if (!suite.is_object() || !suite.contains("rows") || !suite["rows"].is_array()) return nullptr;
  Json rows = Json::array();
  for (const Json& row : suite["rows"]) {
    if (!row.is_object()) return nullptr;
    Json& shown = rows.emplace_back(Json::object());
    for (const char* name :
         {"case", "parameter", "step", "value", "method", "verdict", "bias", "reason"}) {
      if (!row.contains(name)) return nullptr;
      shown[name] = row[name];
    }
  }
  return {{"rows", std::move(rows)}};
}

Json statements_json(const ReportTables& tables) {
  constexpr std::array<const char*, 3> kKinds{"result", "leader", "caution"};
  Json list = Json::array();
  for (const Statement& statement : summarise(tables)) {
    list.push_back(
        {{"kind", kKinds[static_cast<std::size_t>(statement.kind)]}, {"text", statement.text}});
  }
  return list;
}

/// The rows of the table that stand for their methods.
Json headline_json(const ReportTables& tables) {
  Json indices = Json::array();
  for (const EfficiencyRow* row : headline_rows(tables.efficiency)) {
    indices.push_back(row - tables.efficiency.data());
  }
  return indices;
}

Json images_json(const PageImages& images) {
  Json list = Json::array();
  for (const PageImage& image : images.images) {
    list.push_back({{"key", image.key},
                    {"scene", image.scene},
                    {"label", image.label},
                    {"sampler", image.sampler},
                    {"layer", image.layer},
                    {"run_id", image.run_id},
                    {"row", image.row},
                    {"width", image.width},
                    {"height", image.height},
                    {"channels", image.channels},
                    {"script", image.script}});
  }
  return list;
}

Json crops_json(const ExperimentConfig& config) {
  Json list = Json::array();
  for (const CropConfig& crop : config.images.crops) {
    list.push_back({{"name", crop.name}, {"scene", crop.scene}, {"rectangle", crop.rectangle}});
  }
  return list;
}

/// The raw data beside the page.
Json files_json(const std::filesystem::path& folder) {
  constexpr std::array kNames{"measurements.csv", "efficiency.csv",       "efficiency.json",
                              "efficiency.md",    "efficiency.tex",       "curves.csv",
                              "curve_points.csv", "aggregate.csv",        "ecdf.csv",
                              "stages.csv",       "config.resolved.json", "plan.lock.json",
                              "environment.json", "events.txt",           "stability.csv"};
  Json list = Json::array();
  for (const char* name : kNames) {
    std::error_code fault;
    const auto bytes = std::filesystem::file_size(folder / name, fault);
    if (!fault) list.push_back({{"name", name}, {"bytes", bytes}});
  }
  return list;
}

}  // namespace

Json page_data(const std::filesystem::path& folder, const Report& report,
               const PageImages& images) {
  const ReportTables& tables = report.tables;
  const TableOptions& options = tables.options;
  Json missing = report.missing;
  for (const std::string& text : images.missing) missing.push_back(text);
  Json json;
  json["format"] = "penumbra-report";
  json["version"] = kPageDataVersion;
  json["name"] = report.config.name;
  json["summary"] = report.config.summary;
  json["folder"] = std::filesystem::absolute(folder).lexically_normal().string();
  json["baseline"] = options.baseline;
  json["tuned_baseline"] = options.tuned_baseline ? Json(*options.tuned_baseline) : Json();
  json["confidence"] = options.confidence;
  json["primary_time"] = options.primary == PrimaryTime::Cpu ? "cpu" : "wall";
  json["relmse_epsilon"] = options.relmse_epsilon;
  json["published_source"] = options.published_source;
  json["bias_level"] = kBiasLevel;
  json["statements"] = statements_json(tables);
  json["headline"] = headline_json(tables);
  json["efficiency"] = table(efficiency_table_columns(), tables.efficiency);
  json["curves"] = table(curve_table_columns(), tables.curves.rows);
  json["curve_points"] = table(curve_point_table_columns(), tables.curves.points);
  json["aggregate"] = table(aggregate_table_columns(), tables.aggregate);
  json["ecdf"] = table(ecdf_table_columns(), tables.ecdf);
  json["runs"] = table(run_table_columns(), report.rows);
  json["stages"] = table(stage_table_columns(), report.stages);
  json["images"] = images_json(images);
  json["crops"] = crops_json(report.config);
  json["exposure"] = report.config.images.exposure;
  json["missing"] = std::move(missing);
  json["stale_rows"] = report.stale_rows;
  json["files"] = files_json(folder);
  json["environment"] = json_file(folder / "environment.json");
  json["stability"] = stability_json(folder / "stability.json");
  return json;
}

}  // namespace penumbra
