#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "harness/config_reader.h"
#include "harness/config_values.h"
#include "harness/sweep.h"
#include "scenes/core/error.h"
#include "scenes/core/suggest.h"

/// The part of ConfigReader that reads the axes of a method: single values, lists, ranges, and how
/// they are combined.
namespace penumbra {

using nlohmann::json;

namespace {

/// Of ranges; whole numbers up to here are doubles.
constexpr double kMaxOfRange = 1e15;

/// As the schema has it for single numbers; those of a range are known here.
constexpr std::int64_t kMaxSpp = 1'000'000;

template <typename T>
void add_unless_twice(std::vector<T>& list, const T& value, bool& twice) {
  twice = std::find(list.begin(), list.end(), value) != list.end();
  if (!twice) list.push_back(value);
}

}  // namespace

std::vector<ConfigReader::Item> ConfigReader::axis_items(const json& value,
                                                         const std::string& pointer, bool whole) {
  if (value.is_array()) {
    std::vector<Item> items;
    if (value.size() > kMaxAxisValues) {
      fault(pointer, "has " + std::to_string(value.size()) + " values; allowed: up to " +
                         std::to_string(kMaxAxisValues));
      return items;
    }
    for (std::size_t i = 0; i < value.size(); ++i) {
      items.push_back({value[i], child_pointer(pointer, i)});
    }
    return items;
  }
  if (!value.is_object()) return {{value, pointer}};
  if (faults_.covers(pointer)) return {};
  double from = 0.0, to = 0.0;
  int steps = 0;
  std::string scale = "log";
  take(value, "from", from);
  take(value, "to", to);
  take(value, "steps", steps);
  take(value, "scale", scale);
  if (steps < 2) return {};
  if (scale == "log" && !(from > 0.0 && to > 0.0)) {
    fault(pointer,
          "a logarithmic range needs \"from\" and \"to\" above 0; \"scale\": \"linear\" does not");
    return {};
  }
  std::vector<Item> items;
  for (const double number : spaced_values(from, to, steps, scale == "log")) {
    // Also where the distance of the ends is beyond a double.
    if (!(std::abs(number) <= kMaxOfRange)) {
      fault(pointer, "expected a range within -1e+15 and 1e+15, found " + value.dump());
      return {};
    }
    const json item = whole ? json(std::llround(number)) : json(number);
    const bool twice = std::any_of(items.begin(), items.end(),
                                   [&](const Item& other) { return other.value == item; });
    if (twice) {
      fault(pointer, std::to_string(steps) +
                         " steps are too many for whole numbers: " + item.dump() + " comes twice");
      return {};
    }
    items.push_back({item, pointer});
  }
  return items;
}

std::optional<Srl> ConfigReader::read_srl(const json& value, const std::string& pointer,
                                          const EstimatorEntry* entry) {
  if (faults_.covers(pointer) || !(value.is_number_integer() || value.is_string())) return {};
  Srl srl;
  try {
    srl = parse_srl(value.is_string() ? value.get<std::string>() : value.dump());
  } catch (const InputError& error) {
    fault(pointer, error.what());
    return {};
  }
  if (entry == nullptr) return srl;
  if (srl.split && !entry->adaptive) {
    fault(pointer, std::string(entry->name) +
                       " does not adapt, so its shadow rays cannot be split \"" + srl.text() +
                       "\"; write " + std::to_string(srl.total()));
  } else if (srl.total() < entry->min_srl) {
    fault(pointer, std::string(entry->name) + " needs at least " + std::to_string(entry->min_srl) +
                       " shadow rays per light, found " + srl.text());
  }
  return srl;
}

// Every initial with every adaptive number.
std::vector<ConfigReader::Item> ConfigReader::srl_items(const json& value,
                                                        const std::string& pointer) {
  if (!value.is_object() || !value.contains("initial")) return axis_items(value, pointer, true);
  const std::vector<Item> initial =
      axis_items(value["initial"], child_pointer(pointer, "initial"), true);
  const std::vector<Item> adaptive =
      axis_items(value.value("adaptive", json(0)), child_pointer(pointer, "adaptive"), true);
  std::vector<Item> items;
  if (initial.size() * adaptive.size() > kMaxAxisValues) {
    fault(pointer, "makes " + std::to_string(initial.size() * adaptive.size()) +
                       " pairs; allowed: up to " + std::to_string(kMaxAxisValues));
    return items;
  }
  for (const Item& first : initial) {
    for (const Item& second : adaptive) {
      items.push_back({json(first.value.dump() + "-" + second.value.dump()), first.pointer});
    }
  }
  return items;
}

void ConfigReader::read_axes(const json& value, const std::string& pointer,
                             const EstimatorEntry* entry, MethodConfig& method) {
  bool twice = false;
  const json& object = value.is_object() ? value : object_member(value, "");
  const std::string srl_pointer = child_pointer(pointer, "srl");
  const json srl_value = object.value("srl", json(Srl{}.total()));
  for (const Item& item : srl_items(srl_value, srl_pointer)) {
    const std::optional<Srl> srl = read_srl(item.value, item.pointer, entry);
    if (!srl) continue;
    add_unless_twice(method.srl, *srl, twice);
    if (twice) fault(item.pointer, srl->text() + " is listed twice");
  }
  read_srl_by_scene(object_member(object, "srl_by_scene"), child_pointer(pointer, "srl_by_scene"),
                    entry, method);
  if (object.contains("spp")) {
    for (const Item& item : axis_items(object["spp"], child_pointer(pointer, "spp"), true)) {
      if (!item.value.is_number_integer()) continue;
      const auto spp = item.value.get<std::int64_t>();
      if (spp < 1 || spp > kMaxSpp) {
        fault(item.pointer, "expected whole numbers from 1 to " + std::to_string(kMaxSpp) +
                                ", found " + item.value.dump());
        continue;
      }
      method.spp.push_back(static_cast<int>(spp));
    }
  }
  if (object.contains("sampler")) {
    for (const Item& item :
         axis_items(object["sampler"], child_pointer(pointer, "sampler"), true)) {
      if (item.value.is_string()) method.samplers.push_back(item.value.get<std::string>());
    }
  }
  if (entry != nullptr) {
    read_params(object_member(value, "params"), child_pointer(pointer, "params"), *entry, method);
    read_preset(object, pointer, *entry, method);
  }
  read_zip(array_member(value, "zip"), child_pointer(pointer, "zip"), method);
  read_exclude(array_member(value, "exclude"), child_pointer(pointer, "exclude"), entry, method);
}

void ConfigReader::read_srl_by_scene(const json& by_scene, const std::string& pointer,
                                     const EstimatorEntry* entry, MethodConfig& method) {
  for (const auto& [scene, value] : by_scene.items()) {
    const std::string place = child_pointer(pointer, scene);
    if (!check_scene_key(scene, place)) continue;
    if (const auto srl = read_srl(value, place, entry)) method.srl_by_scene[scene] = *srl;
  }
  if (!method.srl_by_scene.empty() && method.srl.size() > 1) {
    fault(pointer, "\"srl\" is a sweep, which an SRL by scene cannot replace");
  }
}

void ConfigReader::read_params(const json& params, const std::string& pointer,
                               const EstimatorEntry& entry, MethodConfig& method) {
  for (const auto& [name, value] : params.items()) {
    const std::string place = child_pointer(pointer, name);
    const auto spec = std::find_if(entry.params().begin(), entry.params().end(),
                                   [&, &key = name](const ParamSpec& s) { return s.name == key; });
    const bool known = spec != entry.params().end();
    const bool whole = known && std::holds_alternative<std::int64_t>(spec->default_value);
    for (const Item& item : axis_items(value, place, whole)) {
      const std::optional<ParamValue> given = param_from_json(item.value);
      if (!given) continue;
      // One name at a time through the same function as everywhere else, so that messages are the
      // same.
      std::vector<ParamProblem> problems;
      const ParamSet resolved = resolve_params(entry.params(), {{name, *given}}, problems);
      if (problems.empty()) {
        method.params[name].push_back(resolved.values().find(name)->second);
      } else if (known) {
        fault(item.pointer, problems.front().message);
      } else if (!faults_.covers(place)) {
        faults_.add(document_.key_at(place), place, problems.front().message);
      }
    }
  }
}

// Fills in what a preset says and the method does not.
void ConfigReader::read_preset(const json& object, const std::string& pointer,
                               const EstimatorEntry& entry, MethodConfig& method) {
  if (!object.contains("preset") || !object["preset"].is_string()) return;
  const std::span<const Preset> presets = presets_of(entry);
  const auto wanted = object["preset"].get<std::string>();
  const auto found = std::find_if(presets.begin(), presets.end(),
                                  [&](const Preset& preset) { return preset.name == wanted; });
  if (found == presets.end()) {
    std::vector<std::string> names;
    for (const Preset& preset : presets) names.emplace_back(preset.name);
    fault(child_pointer(pointer, "preset"), names.empty()
                                                ? std::string(entry.name) + " has no presets"
                                                : unknown_name("preset", wanted, names));
    return;
  }
  for (const auto& [name, param] : found->params) {
    method.params.try_emplace(name, std::vector<ParamValue>{param});
  }
  if (method.samplers.empty()) method.samplers.emplace_back(found->sampler);
}

void ConfigReader::read_zip(const json& zip, const std::string& pointer, MethodConfig& method) {
  const std::vector<std::string> names = axis_names(method);
  std::vector<std::string> used;
  for (std::size_t g = 0; g < zip.size(); ++g) {
    const std::string place = child_pointer(pointer, g);
    std::vector<std::string> group;
    std::string sizes;
    bool equal = true;
    for (std::size_t i = 0; i < zip[g].size() && zip[g].is_array(); ++i) {
      if (!zip[g][i].is_string()) continue;
      const std::string axis = zip[g][i].get<std::string>();
      const std::optional<std::size_t> size = axis_size(config_, method, axis);
      bool twice = false;
      add_unless_twice(used, axis, twice);
      if (!size) {
        fault(child_pointer(place, i), unknown_name("axis", axis, names));
      } else if (twice) {
        fault(child_pointer(place, i), "axis \"" + axis + "\" is zipped twice");
      } else {
        sizes += (sizes.empty() ? "" : ", ") + axis + " has " + std::to_string(*size);
        equal = equal && (group.empty() || axis_size(config_, method, group.front()) == size);
        group.push_back(axis);
      }
    }
    if (!equal) fault(place, "axes that are zipped need equally many values: " + sizes);
    if (equal && group.size() >= 2) method.zip.push_back(group);
  }
}

void ConfigReader::read_exclude(const json& exclude, const std::string& pointer,
                                const EstimatorEntry* entry, MethodConfig& method) {
  const std::vector<std::string> names = axis_names(method);
  for (std::size_t i = 0; i < exclude.size(); ++i) {
    const std::string place = child_pointer(pointer, i);
    SweepValues values;
    for (const auto& [axis, value] : exclude[i].items()) {
      const std::string axis_place = child_pointer(place, axis);
      std::optional<ParamValue> given = param_from_json(value);
      if (!axis_size(config_, method, axis)) {
        fault(axis_place, unknown_name("axis", axis, names));
        given.reset();
      } else if (given && entry != nullptr && method.params.count(axis) != 0) {
        std::vector<ParamProblem> problems;
        const ParamSet resolved = resolve_params(entry->params(), {{axis, *given}}, problems);
        for (const ParamProblem& problem : problems) fault(axis_place, problem.message);
        if (problems.empty()) given = resolved.values().find(axis)->second;
      }
      if (given) values[axis] = *given;
    }
    if (!values.empty()) method.exclude.push_back(std::move(values));
  }
  if (combination_count(config_, method) > kMaxCombinations) {
    fault(pointer.substr(0, pointer.rfind('/')),
          "the axes of method \"" + method.label + "\" have more than " +
              std::to_string(kMaxCombinations) +
              " combinations; zip some, or make methods of them");
  } else if (faults_.all().empty() && sweep_points(config_, method).empty()) {
    fault(pointer, "nothing is left of method \"" + method.label + "\"");
  }
}

}  // namespace penumbra
