#include "harness/report.h"

#include <algorithm>
#include <set>
#include <string>

#include "harness/plan.h"
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
  return report;
}

}  // namespace penumbra
