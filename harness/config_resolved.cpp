#include "harness/config_resolved.h"

#include <charconv>
#include <nlohmann/json.hpp>

#include "estimators/estimator.h"
#include "harness/config_values.h"
#include "harness/gate/gate_config_json.h"
#include "harness/project_root.h"
#include "scenes/core/error.h"

namespace penumbra {

using nlohmann::json;
using nlohmann::ordered_json;

namespace {

/// The shortest decimal of a float; as a double, 0.1f would print seventeen digits.
double shortest(float value) {
  std::array<char, 32> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  PN_CHECK(error == std::errc(), "a float needs at most 16 characters");
  double result = 0.0;
  std::from_chars(buffer.data(), end, result);
  return result;
}

std::string portable_path(const std::filesystem::path& file) {
  const std::filesystem::path relative = file.lexically_relative(project_root());
  const bool below = !relative.empty() && *relative.begin() != "..";
  return (below ? relative : std::filesystem::absolute(file)).generic_string();
}

ordered_json srl_json(const Srl& srl) {
  if (srl.split) return srl.text();
  return srl.total();
}

/// One value as itself, several as a list.
template <typename T, typename ToJson>
ordered_json axis_json(const std::vector<T>& values, ToJson to_json) {
  if (values.size() == 1) return to_json(values.front());
  ordered_json list = ordered_json::array();
  for (const T& value : values) list.push_back(ordered_json(to_json(value)));
  return list;
}

/// Values of every declared parameter, the default where none is given.
template <typename Values, typename ToJson>
ordered_json params_json(const std::string& estimator, const Values& given, ToJson to_json) {
  ordered_json result = ordered_json::object();
  const EstimatorEntry* const entry = find_estimator(estimator);
  PN_CHECK(entry != nullptr, "the config was checked");
  for (const ParamSpec& spec : entry->params()) {
    const auto found = given.find(spec.name);
    result[spec.name] = found == given.end() ? ordered_json(param_to_json(spec.default_value))
                                             : ordered_json(to_json(found->second));
  }
  return result;
}

ordered_json scene_json(const SceneConfig& scene) {
  ordered_json result;
  result["name"] = scene.name;
  result["file"] = portable_path(scene.file);
  if (scene.resolution) result["resolution"] = *scene.resolution;
  result["camera_samples"] = scene.camera_samples;
  if (scene.spp) result["spp"] = *scene.spp;
  const ReferenceConfig& reference = scene.reference;
  result["reference"] = {
      {"type", to_string(reference.type)},
      {"estimator", reference.estimator},
      {"sampler", reference.sampler},
      {"params", params_json(reference.estimator, reference.params, param_to_json)},
      {"srl", srl_json(reference.srl)},
      {"spp", reference.spp}};
  return result;
}

ordered_json method_json(const MethodConfig& method) {
  ordered_json result;
  result["label"] = method.label;
  result["estimator"] = method.estimator;
  const auto itself = [](const auto& value) { return value; };
  if (!method.samplers.empty()) result["sampler"] = axis_json(method.samplers, itself);
  if (!method.spp.empty()) result["spp"] = axis_json(method.spp, itself);
  result["srl"] = axis_json(method.srl, srl_json);
  result["params"] = params_json(
      method.estimator, method.params,
      [](const std::vector<ParamValue>& values) { return axis_json(values, param_to_json); });
  for (const auto& [scene, srl] : method.srl_by_scene) {
    result["srl_by_scene"][scene] = srl_json(srl);
  }
  if (!method.zip.empty()) result["zip"] = method.zip;
  for (const SweepValues& values : method.exclude) {
    ordered_json entry = ordered_json::object();
    for (const auto& [axis, value] : values) entry[axis] = param_to_json(value);
    result["exclude"].push_back(entry);
  }
  if (!method.tags.empty()) result["tags"] = method.tags;
  if (!method.published.empty()) result["published"] = method.published;
  return result;
}

ordered_json images_json(const ImagesConfig& images) {
  ordered_json result;
  result["maps"] = images.maps;
  result["runs"] = images.runs;
  result["exposure"] = shortest(images.exposure);
  result["crops"] = ordered_json::array();
  for (const CropConfig& crop : images.crops) {
    result["crops"].push_back(
        {{"name", crop.name}, {"scene", crop.scene}, {"rectangle", crop.rectangle}});
  }
  return result;
}

}  // namespace

std::string resolved_json(const ExperimentConfig& config) {
  ordered_json result;
  result["version"] = 1;
  result["name"] = config.name;
  result["summary"] = config.summary;
  result["seed"] = config.seed;
  result["threads"] = config.threads;
  result["tile"] = config.tile;
  result["quantity"] = to_string(config.quantity);
  for (const SceneConfig& scene : config.scenes) result["scenes"].push_back(scene_json(scene));
  for (const MethodConfig& method : config.methods) {
    result["methods"].push_back(method_json(method));
  }
  result["baseline"] = config.baseline;
  if (config.tuned_baseline) result["tuned_baseline"] = *config.tuned_baseline;
  if (!config.published_source.empty()) result["published_source"] = config.published_source;
  result["samplers"] = config.samplers;
  result["spp"] = config.spp;
  if (config.budget) {
    const auto itself = [](double value) { return value; };
    const BudgetConfig& budget = *config.budget;
    result["budget"] = ordered_json::object();
    if (budget.match) result["budget"]["match"] = *budget.match;
    result["budget"][budget.match ? "times" : "time_cpu_s"] = axis_json(budget.times, itself);
    result["budget"].update(
        {{"solve_for", config.budget->solve_for == SolveFor::Spp ? "spp" : "srl"},
         {"pilots", config.budget->pilots},
         {"tolerance", config.budget->tolerance}});
  }
  result["blocks"] = config.blocks;
  result["attempts"] = config.attempts;
  result["relmse_epsilon"] = config.relmse_epsilon;
  result["images"] = images_json(config.images);
  if (config.gate) result["gate"] = gate_config_json(*config.gate);
  return result.dump(2);
}

}  // namespace penumbra
