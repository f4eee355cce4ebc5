#include "harness/micro/micro_config.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "harness/config_values.h"
#include "harness/keys.h"
#include "harness/micro/micro_schema.h"
#include "harness/project_root.h"
#include "scenes/core/json_schema.h"
#include "scenes/core/suggest.h"

namespace penumbra::micro {
namespace {

// Sets `result` to the list `key` where there is one. Its items are then what the schema asks for,
// or their faults are known and nothing is read from the config.
template <typename T>
void take_list(const nlohmann::json& object, const char* key, std::vector<T>& result) {
  const nlohmann::json& list = array_member(object, key);
  if (list.empty()) return;
  result.clear();
  for (const nlohmann::json& item : list) {
    if (holds<T>(item)) result.push_back(item.get<T>());
  }
}

// Sizes in ascending order: the fits of growth expect nothing of the order, readers do.
void take_sizes(const nlohmann::json& object, const char* key, std::vector<int>& result) {
  take_list(object, key, result);
  std::sort(result.begin(), result.end());
}

void read(const nlohmann::json& root, MicroConfig& config) {
  take(root, "seed", config.seed);
  take_list(root, "scenes", config.scenes);
  const nlohmann::json& adapt = object_member(root, "adapt");
  take_sizes(adapt, "populations", config.populations);
  take_sizes(adapt, "components", config.components);
  take(adapt, "fixed_components", config.fixed_components);
  take(adapt, "fixed_population", config.fixed_population);
  const nlohmann::json& alsd = object_member(root, "alsd");
  take_sizes(alsd, "lights", config.alsd_lights);
  take(alsd, "srl", config.alsd_srl);
  take_sizes(object_member(root, "mdhi"), "samples", config.tree_samples);
  take_sizes(object_member(root, "sampler"), "counts", config.point_counts);
  take_sizes(object_member(root, "light"), "mesh_levels", config.mesh_levels);
  take_list(object_member(root, "bsdf"), "alphas", config.alphas);
  take_sizes(object_member(root, "rays"), "per_batch", config.rays_per_batch);
  const nlohmann::json& estimate = object_member(root, "estimate");
  take_sizes(estimate, "srl", config.estimate_srl);
  take(estimate, "check_spp", config.check_spp);
  const nlohmann::json& shares = object_member(root, "shares");
  take_sizes(shares, "srl", config.shares_srl);
  take(shares, "rounds", config.shares_rounds);
}

}  // namespace

MicroConfig load_micro_config(const std::filesystem::path& file) {
  const LocatedJson document = LocatedJson::parse_file(file);
  DiagnosticList faults;
  JsonSchema(kMicroSchemaJson).validate(document, faults);
  const nlohmann::json& scenes = array_member(document.root(), "scenes");
  const std::vector<std::string> known = scene_names(project_root());
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (!scenes[i].is_string()) continue;  // a fault of the schema
    const auto name = scenes[i].get<std::string>();
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const std::string pointer = child_pointer("/scenes", i);
    faults.add(document.value_at(pointer), pointer, unknown_name("scene", name, known));
  }
  faults.throw_if_any();
  MicroConfig config;
  config.file = file;
  config.hash = hash_id({"micro", document.root().dump()});
  read(document.root(), config);
  return config;
}

std::filesystem::path default_micro_config() { return project_root() / "configs" / "micro.json"; }

}  // namespace penumbra::micro
