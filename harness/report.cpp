#include "harness/report.h"

#include <map>
#include <set>
#include <string>

#include "harness/image_file.h"
#include "harness/plan.h"
#include "harness/reference.h"
#include "harness/replicate_files.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

std::filesystem::path existing(const std::filesystem::path& folder, const char* name) {
  std::filesystem::path file = folder / name;
  if (!std::filesystem::exists(file)) {
    throw InputError(file.string() +
                     ": there is no such file; expected a folder of `penumbra run`");
  }
  return file;
}

/// What the pictures of single runs say, where they and their reference are there.
void add_replicates(const std::filesystem::path& folder, Report& report) {
  std::map<std::string, std::optional<Reference>> references;
  for (EfficiencyRow& row : report.tables.efficiency) {
    const std::vector<RunRow> runs = rows_of_cell(report.rows, row);
    const RunRow& first = runs.front();
    if (!std::filesystem::exists(run_picture(folder, first.run_id))) continue;
    const auto [place, added] = references.try_emplace(first.reference_id);
    if (added) place->second = find_reference(first.reference_id);
    if (!place->second) continue;
    const auto summary = summarise_replicates(folder, runs, *place->second);
    if (!summary) continue;
    add_replicates(row, *summary);
    Cell cell;
    cell.id = first.cell;
    cell.label = row.label;
    cell.sampler = *parse_sampler_kind(row.sampler);
    write_replicate_picture(image_file(folder, row.scene, cell, "-stddev.exr"), *summary,
                            *place->second);
  }
}

}  // namespace

TableOptions table_options(const ExperimentConfig& config) {
  TableOptions options;
  options.baseline = config.baseline;
  options.tuned_baseline = config.tuned_baseline;
  options.relmse_epsilon = config.relmse_epsilon;
  for (const SceneConfig& scene : config.scenes) options.scenes.push_back(scene.name);
  for (const MethodConfig& method : config.methods) {
    options.labels.push_back(method.label);
    if (!method.published.empty()) options.published[method.label] = method.published;
  }
  options.published_source = config.published_source;
  return options;
}

Report make_report(const std::filesystem::path& folder) {
  Report report;
  report.config = load_config(existing(folder, "config.resolved.json"));
  std::set<std::string> current;
  for (const PlannedCell& cell : read_plan_file(existing(folder, "plan.lock.json")).cells) {
    current.insert(cell.id);
  }
  report.rows = read_run_rows(existing(folder, "measurements.csv")).rows;
  report.stale_rows =
      std::erase_if(report.rows, [&](const RunRow& row) { return current.count(row.cell) == 0; });
  report.tables = make_tables(report.rows, table_options(report.config));
  add_replicates(folder, report);
  return report;
}

}  // namespace penumbra
