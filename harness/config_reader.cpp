#include "harness/config_reader.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "harness/config_values.h"
#include "harness/project_root.h"
#include "scenes/core/error.h"
#include "scenes/core/suggest.h"

namespace penumbra {

using nlohmann::json;
namespace fs = std::filesystem;

namespace {

std::vector<std::string> estimator_names() {
  std::vector<std::string> names;
  for (const EstimatorEntry* entry : all_estimators()) names.emplace_back(entry->name);
  return names;
}

}  // namespace

ConfigReader::ConfigReader(const LocatedJson& document, fs::path file, DiagnosticList& faults)
    : document_(document), root_(document.root()), project_root_(project_root()), faults_(faults) {
  config_.file = std::move(file);
}

void ConfigReader::fault(const std::string& pointer, std::string message) {
  // A value that breaks the schema cannot be expected to obey anything else, and a missing one is
  // reported as missing.
  if (faults_.covers(pointer)) return;
  if (!root_.contains(json::json_pointer(pointer))) {
    const std::string parent = pointer.substr(0, pointer.rfind('/'));
    const auto& known = faults_.all();
    if (std::any_of(known.begin(), known.end(),
                    [&](const Diagnostic& d) { return d.pointer == parent; })) {
      return;
    }
  }
  faults_.add(document_.value_at(pointer), pointer, std::move(message));
}

ExperimentConfig ConfigReader::read() {
  read_top_level();
  const json& scenes = array_member(root_, "scenes");
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    config_.scenes.push_back(read_scene(scenes[i], child_pointer("/scenes", i)));
  }
  const json& methods = array_member(root_, "methods");
  for (std::size_t i = 0; i < methods.size(); ++i) {
    config_.methods.push_back(read_method(methods[i], child_pointer("/methods", i)));
  }
  read_budget();
  read_images();
  read_gate();
  check_names();
  check_baselines();
  check_samples();
  return std::move(config_);
}

void ConfigReader::read_top_level() {
  take(root_, "name", config_.name);
  take(root_, "summary", config_.summary);
  take(root_, "seed", config_.seed);
  take(root_, "threads", config_.threads);
  take(root_, "tile", config_.tile);
  std::string quantity;
  take(root_, "quantity", quantity);
  // Another name is a fault of the schema.
  config_.quantity = parse_quantity(quantity).value_or(Quantity::Radiance);
  take(root_, "baseline", config_.baseline);
  if (root_.is_object() && root_.contains("tuned_baseline")) {
    take(root_, "tuned_baseline", config_.tuned_baseline.emplace());
  }
  take(root_, "published_source", config_.published_source);
  take(root_, "spp", config_.spp);
  take(root_, "blocks", config_.blocks);
  take(root_, "attempts", config_.attempts);
  take(root_, "relmse_epsilon", config_.relmse_epsilon);
  const json& samplers = array_member(root_, "samplers");
  if (!samplers.empty()) config_.samplers.clear();
  for (const json& sampler : samplers) {
    if (sampler.is_string()) config_.samplers.push_back(sampler.get<std::string>());
  }
}

SceneConfig ConfigReader::read_scene(const json& value, const std::string& pointer) {
  SceneConfig scene;
  take(value, "name", scene.name);
  find_scene_file(value, pointer, scene);
  scene.resolution = take_integers<2>(value, "resolution");
  take(value, "camera_samples", scene.camera_samples);
  if (value.is_object() && value.contains("spp")) take(value, "spp", scene.spp.emplace());
  read_reference(object_member(value, "reference"), child_pointer(pointer, "reference"), scene,
                 scene.reference);
  return scene;
}

void ConfigReader::find_scene_file(const json& value, const std::string& pointer,
                                   SceneConfig& scene) {
  std::string given;
  take(value, "file", given);
  std::error_code ignored;
  if (given.empty()) {
    scene.file = project_root_ / "scenes" / scene.name / "scene.json";
    if (fs::is_regular_file(scene.file, ignored)) return;
    fault(child_pointer(pointer, "name"),
          unknown_name("scene", scene.name, scene_names(project_root_)));
    return;
  }
  const fs::path beside_config = fs::absolute(config_.file).parent_path() / given;
  for (const fs::path& candidate : {beside_config, project_root_ / given}) {
    scene.file = candidate.lexically_normal();
    if (!fs::is_regular_file(candidate, ignored)) continue;
    if (!is_utf8(scene.file.string())) {
      fault(child_pointer(pointer, "file"),
            "the path " + scene.file.string() + " is not UTF-8, so no file can record it");
    }
    return;
  }
  fault(child_pointer(pointer, "file"), "scene file not found; looked for " +
                                            beside_config.lexically_normal().string() + " and " +
                                            scene.file.string());
}

void ConfigReader::read_reference(const json& value, const std::string& pointer,
                                  const SceneConfig& scene, ReferenceConfig& reference) {
  std::string type;
  take(value, "type", type);
  // Another name is a fault of the schema.
  reference.type = parse_reference_type(type).value_or(ReferenceType::Auto);
  take(value, "estimator", reference.estimator);
  take(value, "sampler", reference.sampler);
  take(value, "spp", reference.spp);
  const std::string estimator_pointer = child_pointer(pointer, "estimator");
  const EstimatorEntry* const entry = find_entry(reference.estimator, estimator_pointer);
  if (value.contains("srl")) {
    const auto srl = read_srl(value["srl"], child_pointer(pointer, "srl"), entry);
    reference.srl = srl.value_or(reference.srl);
  }
  if (reference.spp / 2 < scene.camera_samples) {
    fault(child_pointer(pointer, "spp"),
          "each half of the reference needs an estimate at every shading point: expected at least "
          "2 x "
          "camera_samples = " +
              std::to_string(std::int64_t{2} * scene.camera_samples) + ", found " +
              std::to_string(reference.spp));
  }
  if (entry == nullptr) return;
  if (entry->name == "pmc_hi") {
    fault(estimator_pointer,
          "pmc_hi may not make a reference: a method under test must not make its own reference");
    return;
  }
  if (entry->may_be_negative) {
    fault(estimator_pointer, reference.estimator +
                                 " may not make a reference: its pixels may be negative, and the "
                                 "truth is not");
    return;
  }
  const std::string params_pointer = child_pointer(pointer, "params");
  ParamSet::Map given;
  for (const auto& [name, item] : object_member(value, "params").items()) {
    if (const auto param = param_from_json(item)) given[name] = *param;
  }
  std::vector<ParamProblem> problems;
  const ParamSet params = resolve_params(entry->params(), given, problems);
  for (const ParamProblem& problem : problems) {
    fault(child_pointer(params_pointer, problem.name), problem.message);
  }
  if (!problems.empty()) return;
  reference.params = std::move(given);
  if (const std::string reason = entry->bias_reason(params); !reason.empty()) {
    fault(estimator_pointer, "a reference must be unbiased: " + reason);
  }
}

const EstimatorEntry* ConfigReader::find_entry(const std::string& name,
                                               const std::string& pointer) {
  const EstimatorEntry* const entry = find_estimator(name);
  if (entry == nullptr) fault(pointer, unknown_name("estimator", name, estimator_names()));
  return entry;
}

MethodConfig ConfigReader::read_method(const json& value, const std::string& pointer) {
  MethodConfig method;
  take(value, "label", method.label);
  take(value, "estimator", method.estimator);
  const EstimatorEntry* const entry =
      find_entry(method.estimator, child_pointer(pointer, "estimator"));
  read_axes(value, pointer, entry, method);
  const json& tags = array_member(value, "tags");
  for (const json& tag : tags) {
    if (tag.is_string()) method.tags.push_back(tag.get<std::string>());
  }
  read_published(object_member(value, "published"), child_pointer(pointer, "published"), method);
  return method;
}

void ConfigReader::read_published(const json& published, const std::string& pointer,
                                  MethodConfig& method) {
  for (const auto& [scene, efficiency] : published.items()) {
    if (!check_scene_key(scene, child_pointer(pointer, scene))) continue;
    if (efficiency.is_number()) method.published[scene] = efficiency.get<double>();
  }
}

/// @return whether a key names a scene of this config
bool ConfigReader::check_scene_key(const std::string& scene, const std::string& pointer) {
  std::vector<std::string> scenes;
  for (const SceneConfig& known : config_.scenes) scenes.push_back(known.name);
  if (std::find(scenes.begin(), scenes.end(), scene) != scenes.end()) return true;
  faults_.add(document_.key_at(pointer), pointer, unknown_name("scene", scene, scenes));
  return false;
}

}  // namespace penumbra
