#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "harness/config_reader.h"
#include "harness/config_values.h"
#include "harness/gate/gate_config_json.h"
#include "harness/sweep.h"
#include "scenes/core/error.h"
#include "scenes/core/scene_description.h"
#include "scenes/core/suggest.h"

/// The half of ConfigReader that looks at the experiment as a whole: budget, images, and what must
/// fit together.
namespace penumbra {

using nlohmann::json;

void ConfigReader::read_budget() {
  if (!root_.is_object() || !root_.contains("budget")) return;
  const json& value = object_member(root_, "budget");
  BudgetConfig& budget = config_.budget.emplace();
  read_budget_times(value, budget);
  take(value, "pilots", budget.pilots);
  take(value, "tolerance", budget.tolerance);
  std::string solve_for = "spp";
  take(value, "solve_for", solve_for);
  budget.solve_for = solve_for == "srl" ? SolveFor::Srl : SolveFor::Spp;
  const bool solves_spp = budget.solve_for == SolveFor::Spp;
  for (std::size_t i = 0; i < config_.methods.size(); ++i) {
    const MethodConfig& method = config_.methods[i];
    const std::string place = child_pointer("/methods", i);
    if (solves_spp && !budget.match && !method.spp.empty()) {
      fault(child_pointer(place, "spp"), "the budget solves for spp, so it cannot be given");
    }
    if (!solves_spp && method.srl.size() > 1) {
      fault(child_pointer(place, "srl"),
            "the budget solves for srl, so it cannot be a list; it gives the split and the start");
    }
  }
}

// Either seconds, or another method's time and its multiples.
void ConfigReader::read_budget_times(const json& value, BudgetConfig& budget) {
  const bool matches = value.contains("match");
  const std::string key = matches ? "times" : "time_cpu_s";
  const std::string place = child_pointer("/budget", key);
  if (matches == value.contains("time_cpu_s")) {
    fault("/budget", "expected either \"time_cpu_s\" or \"match\"");
    return;
  }
  if (!matches && value.contains("times")) {
    fault("/budget/times", "\"times\" are multiples of the time of \"match\", which is missing");
  }
  if (matches) take(value, "match", budget.match.emplace());
  for (const Item& item : axis_items(value.value(key, json(1.0)), place, false)) {
    if (item.value.is_number()) budget.times.push_back(item.value.get<double>());
  }
  for (const double time : budget.times) {
    if (!(time > 0.0)) fault(place, "expected times above 0, found " + json(time).dump());
  }
  if (!matches) return;
  std::vector<std::string> labels;
  for (const MethodConfig& method : config_.methods) {
    labels.push_back(method.label);
    if (method.label != *budget.match || combination_count(config_, method) > kMaxCombinations) {
      continue;
    }
    if (sweep_points(config_, method).size() > 1) {
      fault("/budget/match", "method \"" + method.label + "\" is a sweep; one cell is needed");
    }
  }
  if (std::find(labels.begin(), labels.end(), *budget.match) == labels.end()) {
    fault("/budget/match", unknown_name("label", *budget.match, labels));
  }
}

void ConfigReader::read_images() {
  const json& value = object_member(root_, "images");
  take(value, "maps", config_.images.maps);
  take(value, "runs", config_.images.runs);
  take(value, "exposure", config_.images.exposure);
  const json& crops = array_member(value, "crops");
  for (std::size_t i = 0; i < crops.size(); ++i) {
    read_crop(crops[i], child_pointer("/images/crops", i));
  }
}

void ConfigReader::read_gate() {
  if (!root_.is_object() || !root_.contains("gate")) return;
  GateConfig gate = gate_config_of(object_member(root_, "gate"));
  if (!std::is_sorted(gate.looks.begin(), gate.looks.end())) {
    fault("/gate/looks", "the numbers of blocks have to increase");
  }
  const auto check = [&](const GateThresholds& thresholds, const std::string& pointer) {
    if (thresholds.noise <= thresholds.fail && thresholds.fail <= thresholds.pass) return;
    fault(pointer, fmt::format("expected noise <= fail <= pass, found {}, {} and {}",
                               thresholds.noise, thresholds.fail, thresholds.pass));
  };
  check(gate.thresholds, "/gate");
  for (std::size_t i = 0; i < gate.overrides.size(); ++i) {
    check(gate.overrides[i].thresholds, child_pointer("/gate/overrides", i));
  }
  config_.gate = std::move(gate);
}

void ConfigReader::read_crop(const json& value, const std::string& pointer) {
  CropConfig crop{};
  take(value, "name", crop.name);
  take(value, "scene", crop.scene);
  const auto rectangle = take_integers<4>(value, "rectangle");
  crop.rectangle = rectangle.value_or(crop.rectangle);
  config_.images.crops.push_back(crop);

  const auto scene = std::find_if(config_.scenes.begin(), config_.scenes.end(),
                                  [&](const SceneConfig& s) { return s.name == crop.scene; });
  if (scene == config_.scenes.end()) {
    std::vector<std::string> names;
    for (const SceneConfig& known : config_.scenes) names.push_back(known.name);
    fault(child_pointer(pointer, "scene"), unknown_name("scene", crop.scene, names));
    return;
  }
  const auto resolution = resolution_of(*scene);
  const std::string place = child_pointer(pointer, "rectangle");
  if (!rectangle || !resolution || faults_.covers(place)) return;
  // Sums of two numbers that the schema may have refused.
  const std::int64_t x = (*rectangle)[0], y = (*rectangle)[1];
  const std::int64_t width = (*rectangle)[2], height = (*rectangle)[3];
  if (width < 1 || height < 1) {
    fault(place, "expected a width and height of at least 1, found " + value["rectangle"].dump());
  } else if (x + width > (*resolution)[0] || y + height > (*resolution)[1]) {
    fault(place, "reaches to (" + std::to_string(x + width) + ", " + std::to_string(y + height) +
                     "), outside the image of " + std::to_string((*resolution)[0]) + " x " +
                     std::to_string((*resolution)[1]) + " pixels");
  }
}

std::optional<std::array<int, 2>> ConfigReader::resolution_of(const SceneConfig& scene) const {
  if (scene.resolution) return scene.resolution;
  try {
    const LocatedJson document = LocatedJson::parse_file(scene.file);
    const json& camera = object_member(document.root(), "camera");
    if (!camera.contains("resolution")) return CameraDescription{}.resolution;
    return take_integers<2>(camera, "resolution");
  } catch (const InputError&) {
    // Whoever loads the scene reports its faults; here they only mean that the size is not known.
    return std::nullopt;
  }
}

void ConfigReader::check_names() {
  std::set<std::string> scenes;
  for (std::size_t i = 0; i < config_.scenes.size(); ++i) {
    const std::string& name = config_.scenes[i].name;
    if (scenes.insert(name).second) continue;
    fault(child_pointer(child_pointer("/scenes", i), "name"),
          "scene \"" + name + "\" is listed twice");
  }
  std::set<std::string> labels;
  for (std::size_t i = 0; i < config_.methods.size(); ++i) {
    const std::string& label = config_.methods[i].label;
    if (labels.insert(label).second) continue;
    fault(child_pointer(child_pointer("/methods", i), "label"),
          "label \"" + label + "\" is used twice");
  }
  std::set<std::pair<std::string, std::string>> crops;
  for (std::size_t i = 0; i < config_.images.crops.size(); ++i) {
    const CropConfig& crop = config_.images.crops[i];
    if (crops.insert({crop.scene, crop.name}).second) continue;
    fault(child_pointer(child_pointer("/images/crops", i), "name"),
          "crop \"" + crop.name + "\" of scene \"" + crop.scene + "\" is listed twice");
  }
}

void ConfigReader::check_baselines() {
  if (!root_.is_object() || config_.methods.empty()) return;
  std::vector<std::string> labels;
  for (const MethodConfig& method : config_.methods) labels.push_back(method.label);
  const auto find = [&](const std::string& label, const std::string& pointer) {
    const auto found = std::find(labels.begin(), labels.end(), label);
    if (found == labels.end()) fault(pointer, unknown_name("label", label, labels));
    return found == labels.end()
               ? nullptr
               : &config_.methods[static_cast<std::size_t>(found - labels.begin())];
  };
  if (root_.contains("baseline")) find(config_.baseline, "/baseline");
  if (!config_.tuned_baseline) return;
  const MethodConfig* const tuned = find(*config_.tuned_baseline, "/tuned_baseline");
  if (tuned != nullptr && tuned->samplers.size() != 1) {
    fault("/tuned_baseline",
          "method \"" + tuned->label + "\" must name one sampler to be the tuned baseline");
  }
}

void ConfigReader::check_samples() {
  const bool solved = config_.budget && config_.budget->solve_for == SolveFor::Spp;
  if (solved && !config_.budget->match) return;
  const bool spp_given = root_.is_object() && root_.contains("spp");
  for (std::size_t i = 0; i < config_.scenes.size(); ++i) {
    const std::string samples = child_pointer(child_pointer("/scenes", i), "camera_samples");
    const SceneConfig& scene = config_.scenes[i];
    if (scene.spp) {
      check_spp(*scene.spp, scene, child_pointer(child_pointer("/scenes", i), "spp"));
    } else {
      check_spp(config_.spp, scene, spp_given ? "/spp" : samples);
    }
    for (std::size_t m = 0; m < config_.methods.size(); ++m) {
      const std::string place = child_pointer(child_pointer("/methods", m), "spp");
      for (const int spp : config_.methods[m].spp) check_spp(spp, scene, place);
    }
  }
}

void ConfigReader::check_spp(int spp, const SceneConfig& scene, const std::string& pointer) {
  if (spp >= scene.camera_samples) return;
  fault(pointer,
        "every shading point needs an estimate: expected spp >= camera_samples, found spp " +
            std::to_string(spp) + " and camera_samples " + std::to_string(scene.camera_samples) +
            " of scene \"" + scene.name + "\"");
}

}  // namespace penumbra
