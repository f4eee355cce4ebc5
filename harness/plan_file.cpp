#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "harness/atomic_file.h"
#include "harness/build_info.h"
#include "harness/plan.h"
#include "scenes/core/error.h"

namespace penumbra {

void write_plan(const std::filesystem::path& file, const std::vector<LoadedScene>& scenes,
                const std::vector<Cell>& cells, const std::vector<PlannedCell>& plan) {
  nlohmann::ordered_json json;
  json["version"] = 1;
  json["machine"] = machine_text();
  json["commit"] = build_info().commit;
  json["core_version"] = kCoreVersion;
  json["scenes"] = nlohmann::ordered_json::object();
  for (const LoadedScene& scene : scenes) {
    json["scenes"][scene.config->name] = scene.scene->content_hash();
  }
  json["cells"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const PlannedCell& cell = plan[i];
    json["cells"].push_back({{"id", cell.id},
                             {"label", cells[i].label},
                             {"sampler", std::string(to_string(cells[i].sampler))},
                             {"params", cells[i].params_text},
                             {"spp", cell.spp},
                             {"srl", cell.srl.text()},
                             {"fixed_s", cell.fixed_s},
                             {"per_unit_s", cell.per_unit_s},
                             {"predicted_cpu_s", cell.predicted_s}});
    if (cell.budget_s) json["cells"].back()["budget_s"] = *cell.budget_s;
  }
  write_file_atomically(file, json.dump(2) + "\n");
}

PlanFile read_plan_file(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw InputError(file.string() + ": cannot be read");
  PlanFile plan;
  try {
    const nlohmann::json json = nlohmann::json::parse(stream);
    plan.machine = json.at("machine");
    if (json.contains("core_version")) plan.core_version = json.at("core_version").get<int>();
    if (json.contains("scenes")) json.at("scenes").get_to(plan.scene_hashes);
    for (const nlohmann::json& cell : json.at("cells")) {
      plan.cells.push_back({cell.at("id"), cell.at("spp"), parse_srl(cell.at("srl")),
                            cell.at("fixed_s"), cell.at("per_unit_s"), cell.at("predicted_cpu_s"),
                            std::nullopt, std::nullopt});
      if (cell.contains("budget_s")) plan.cells.back().budget_s = cell.at("budget_s").get<double>();
    }
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file.string() + ": not a plan: " + e.what());
  }
  return plan;
}

std::vector<PlannedCell> read_plan(const std::filesystem::path& file) {
  PlanFile plan = read_plan_file(file);
  if (plan.machine != machine_text()) {
    throw ReferenceError(file.string() + ": calibrated on \"" + plan.machine + "\", this is \"" +
                         machine_text() + "\"; a time budget is not portable, use another --out");
  }
  return std::move(plan.cells);
}

}  // namespace penumbra
