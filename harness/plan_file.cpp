#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "harness/atomic_file.h"
#include "harness/build_info.h"
#include "harness/plan.h"
#include "scenes/core/error.h"
#include "scenes/core/file_bytes.h"

namespace penumbra {
namespace {

using nlohmann::json;

// Numbers are looked at first: nlohmann converts what does not fit in silence.
int whole_number(const json& object, const char* key, int least) {
  const json& value = object.at(key);
  constexpr int kMost = std::numeric_limits<int>::max();
  const bool fits =
      value.is_number_unsigned()
          ? value.get<std::uint64_t>() <= std::uint64_t{kMost}
          : value.is_number_integer() && value.get<std::int64_t>() >= std::int64_t{-kMost};
  if (!fits || value.get<int>() < least) {
    throw InputError(fmt::format("\"{}\" is {}; expected a whole number from {} to {}", key,
                                 value.dump(), least, kMost));
  }
  return value.get<int>();
}

PlannedCell read_cell(const json& cell) {
  PlannedCell result{cell.at("id"),
                     whole_number(cell, "spp", 1),
                     parse_srl(cell.at("srl")),
                     cell.at("fixed_s"),
                     cell.at("per_unit_s"),
                     cell.at("predicted_cpu_s"),
                     std::nullopt,
                     std::nullopt};
  if (cell.contains("budget_s")) result.budget_s = cell.at("budget_s").get<double>();
  return result;
}

PlanFile plan_of(const json& root) {
  PlanFile plan;
  plan.machine = root.at("machine");
  if (root.contains("core_version")) {
    plan.core_version = whole_number(root, "core_version", -std::numeric_limits<int>::max());
  }
  if (root.contains("scenes")) root.at("scenes").get_to(plan.scene_hashes);
  for (const json& cell : root.at("cells")) plan.cells.push_back(read_cell(cell));
  return plan;
}

}  // namespace

void write_plan(const std::filesystem::path& file, const std::vector<LoadedScene>& scenes,
                const std::vector<Cell>& cells, const std::vector<PlannedCell>& plan) {
  nlohmann::ordered_json root;
  root["version"] = 1;
  root["machine"] = machine_text();
  root["commit"] = build_info().commit;
  root["core_version"] = kCoreVersion;
  root["scenes"] = nlohmann::ordered_json::object();
  for (const LoadedScene& scene : scenes) {
    root["scenes"][scene.config->name] = scene.scene->content_hash();
  }
  root["cells"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const PlannedCell& cell = plan[i];
    root["cells"].push_back({{"id", cell.id},
                             {"label", cells[i].label},
                             {"sampler", std::string(to_string(cells[i].sampler))},
                             {"params", cells[i].params_text},
                             {"spp", cell.spp},
                             {"srl", cell.srl.text()},
                             {"fixed_s", cell.fixed_s},
                             {"per_unit_s", cell.per_unit_s},
                             {"predicted_cpu_s", cell.predicted_s}});
    if (cell.budget_s) root["cells"].back()["budget_s"] = *cell.budget_s;
  }
  write_file_atomically(file, root.dump(2) + "\n");
}

PlanFile read_plan_file(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  try {
    return plan_of(json::parse(bytes));
  } catch (const json::exception& e) {
    throw InputError(file.string() + ": not a plan: " + e.what());
  } catch (const InputError& e) {
    throw InputError(file.string() + ": not a plan: " + e.what());
  }
}

std::vector<PlannedCell> read_plan(const std::filesystem::path& file) {
  PlanFile plan = read_plan_file(file);
  const bool has_budget = std::any_of(plan.cells.begin(), plan.cells.end(),
                                      [](const PlannedCell& cell) { return cell.budget_s; });
  if (has_budget && plan.machine != machine_text()) {
    throw ReferenceError(file.string() + ": calibrated on \"" + plan.machine + "\", this is \"" +
                         machine_text() + "\"; a time budget is not portable, use another --out");
  }
  return std::move(plan.cells);
}

}  // namespace penumbra
