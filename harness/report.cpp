#include "harness/report.h"

#include <fmt/format.h>

#include <algorithm>
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

/// Reads one file of the folder. Where it cannot be read, that is noted with what it means.
template <class Read>
auto read_part(const std::filesystem::path& file, const std::string& meaning,
               std::vector<std::string>& missing, const Read& read) -> decltype(read(file)) {
  if (!std::filesystem::exists(file)) {
    missing.push_back(fmt::format("{}: {}", file.filename().string(), meaning));
    return {};
  }
  try {
    return read(file);
  } catch (const InputError& error) {
    missing.push_back(fmt::format("{}: {} ({})", file.filename().string(), meaning, error.what()));
    return {};
  }
}

/// What the pictures of single runs say, where they and their reference are there.
void add_replicates(const std::filesystem::path& folder, ReplicatePictures pictures,
                    Report& report) {
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
    if (pictures == ReplicatePictures::Leave) continue;
    Cell cell;
    cell.id = first.cell;
    cell.label = row.label;
    cell.sampler = *parse_sampler_kind(row.sampler);
    const std::filesystem::path picture = image_file(folder, row.scene, cell, "-stddev.exr");
    std::filesystem::create_directories(picture.parent_path());
    write_replicate_picture(picture, *summary, *place->second);
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

Report make_report(const std::filesystem::path& folder, ReplicatePictures pictures) {
  const std::filesystem::path config = folder / "config.resolved.json";
  const std::filesystem::path plan = folder / "plan.lock.json";
  const std::filesystem::path measurements = folder / "measurements.csv";
  Report report;
  report.is_run = std::filesystem::exists(config) || std::filesystem::exists(plan) ||
                  std::filesystem::exists(measurements);
  if (!report.is_run) {
    if (!std::filesystem::exists(folder / "stability.json")) {
      throw InputError(folder.string() +
                       ": expected a folder of `penumbra run`, with measurements.csv, "
                       "config.resolved.json and plan.lock.json, or of `penumbra stability`; found "
                       "none of their files");
    }
    report.config.name = folder.filename().string();
    return report;
  }
  report.config =
      read_part(config, "the baseline is the first label by alphabet, published ratios are unknown",
                report.missing, [](const auto& file) { return load_config(file); });
  const PlanFile planned = read_part(plan, "rows of cells that the config no longer has are shown",
                                     report.missing, read_plan_file);
  report.rows = read_part(measurements, "nothing was measured", report.missing, read_run_rows).rows;
  report.stages = read_part(folder / "stages.csv",
                            "where the time of estimates goes is not known; another `penumbra run` "
                            "into this folder measures it",
                            report.missing, read_stage_rows);
  if (!planned.cells.empty()) {
    std::set<std::string> current;
    for (const PlannedCell& cell : planned.cells) current.insert(cell.id);
    const auto is_stale = [&](const auto& row) { return current.count(row.cell) == 0; };
    report.stale_rows = std::erase_if(report.rows, is_stale);
    std::erase_if(report.stages, is_stale);
  }
  if (report.config.name.empty()) report.config.name = folder.filename().string();
  if (report.config.baseline.empty() && !report.rows.empty()) {
    const auto first =
        std::min_element(report.rows.begin(), report.rows.end(),
                         [](const RunRow& a, const RunRow& b) { return a.label < b.label; });
    report.config.baseline = first->label;
  }
  report.tables = make_tables(report.rows, table_options(report.config));
  add_replicates(folder, pictures, report);
  return report;
}

}  // namespace penumbra
