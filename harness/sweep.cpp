#include "harness/sweep.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

const std::vector<std::string>& samplers_of(const ExperimentConfig& config,
                                            const MethodConfig& method) {
  return method.samplers.empty() ? config.samplers : method.samplers;
}

std::vector<int> spp_of(const ExperimentConfig& config, const MethodConfig& method) {
  return method.spp.empty() ? std::vector<int>{config.spp} : method.spp;
}

/// Value `index` of an axis, as a config writes it.
ParamValue axis_value(const ExperimentConfig& config, const MethodConfig& method,
                      const std::string& axis, std::size_t index) {
  if (axis == "sampler") return samplers_of(config, method)[index];
  if (axis == "spp") return std::int64_t{spp_of(config, method)[index]};
  if (axis == "srl") return method.srl[index].text();
  return method.params.at(axis)[index];
}

void set_value(const ExperimentConfig& config, const MethodConfig& method, const std::string& axis,
               std::size_t index, SweepPoint& point) {
  if (axis == "sampler") {
    point.sampler = samplers_of(config, method)[index];
  } else if (axis == "spp") {
    point.spp = spp_of(config, method)[index];
  } else if (axis == "srl") {
    point.srl = method.srl[index];
  } else {
    point.params[axis] = method.params.at(axis)[index];
  }
}

/// Axes that advance together; most stand alone.
using AxisGroup = std::vector<std::string>;

std::vector<AxisGroup> groups_of(const MethodConfig& method) {
  std::vector<AxisGroup> groups;
  for (const std::string& axis : axis_names(method)) {
    const auto zip =
        std::find_if(method.zip.begin(), method.zip.end(), [&](const std::vector<std::string>& z) {
          return std::find(z.begin(), z.end(), axis) != z.end();
        });
    if (zip == method.zip.end()) {
      groups.push_back({axis});
    } else if (std::find(groups.begin(), groups.end(), *zip) == groups.end()) {
      groups.push_back(*zip);
    }
  }
  return groups;
}

/// Numbers and texts alike, so that 16 excludes an SRL of "16".
bool is_excluded(const ExperimentConfig& config, const MethodConfig& method,
                 const std::map<std::string, std::size_t>& indices) {
  const auto matches = [&](const SweepValues& values) {
    return std::all_of(values.begin(), values.end(), [&](const auto& item) {
      const auto& [axis, value] = item;
      return to_string(axis_value(config, method, axis, indices.at(axis))) == to_string(value);
    });
  };
  return std::any_of(method.exclude.begin(), method.exclude.end(), matches);
}

}  // namespace

std::vector<std::string> axis_names(const MethodConfig& method) {
  std::vector<std::string> names{"sampler", "spp", "srl"};
  for (const auto& [name, values] : method.params) names.push_back(name);
  return names;
}

std::optional<std::size_t> axis_size(const ExperimentConfig& config, const MethodConfig& method,
                                     const std::string& axis) {
  if (axis == "sampler") return samplers_of(config, method).size();
  if (axis == "spp") return spp_of(config, method).size();
  if (axis == "srl") return method.srl.size();
  const auto found = method.params.find(axis);
  if (found == method.params.end()) return std::nullopt;
  return found->second.size();
}

std::size_t combination_count(const ExperimentConfig& config, const MethodConfig& method) {
  std::size_t count = 1;
  for (const AxisGroup& group : groups_of(method)) {
    count *= axis_size(config, method, group.front()).value();
    if (count > kMaxCombinations) return kMaxCombinations + 1;
  }
  return count;
}

std::vector<SweepPoint> sweep_points(const ExperimentConfig& config, const MethodConfig& method,
                                     const SceneConfig* scene) {
  const std::vector<AxisGroup> groups = groups_of(method);
  std::vector<std::map<std::string, std::size_t>> combinations(1);
  for (const AxisGroup& group : groups) {
    const std::size_t size = axis_size(config, method, group.front()).value();
    std::vector<std::map<std::string, std::size_t>> grown;
    for (const auto& partial : combinations) {
      for (std::size_t i = 0; i < size; ++i) {
        grown.push_back(partial);
        for (const std::string& axis : group) grown.back()[axis] = i;
      }
    }
    combinations = std::move(grown);
  }
  std::vector<SweepPoint> points;
  for (const auto& indices : combinations) {
    if (is_excluded(config, method, indices)) continue;
    SweepPoint& point = points.emplace_back();
    for (const auto& [axis, index] : indices) set_value(config, method, axis, index, point);
    if (scene == nullptr) continue;
    if (scene->spp && method.spp.empty()) point.spp = *scene->spp;
    const auto srl = method.srl_by_scene.find(scene->name);
    if (srl != method.srl_by_scene.end()) point.srl = srl->second;
  }
  return points;
}

std::vector<double> spaced_values(double from, double to, int steps, bool logarithmic) {
  PN_CHECK(steps >= 2, "a range has two ends");
  std::vector<double> values;
  for (int i = 0; i < steps; ++i) {
    const double t = static_cast<double>(i) / (steps - 1);
    values.push_back(logarithmic ? from * std::pow(to / from, t) : from + (to - from) * t);
  }
  values.back() = to;
  return values;
}

}  // namespace penumbra
